// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace teravox
{

/// Why an operation failed. The numbers are not part of any file.
enum class StatusCode
{
  Ok,
  InvalidArgument,   ///< the caller asked for something that can't be
  NotFound,          ///< a file, dataset or brick isn't there
  Corrupt,           ///< the data contradict themselves or don't decode
  Unsupported,       ///< valid, but not implemented or not installed (a filter, a type)
  ResourceExhausted, ///< a budget, the memory or the disk is too small
  InputOutput,       ///< the operating system reported an error
  Cancelled          ///< stopped on request
};

/// How an operation ended, by value. The message is a full sentence for the user: it names the
/// file, the dataset and the brick where there are any.
class Status
{
public:
  Status() = default;
  Status(StatusCode code, std::string message)
    : Code_(code)
    , Message_(std::move(message))
  {
  }

  bool Ok() const { return this->Code_ == StatusCode::Ok; }
  explicit operator bool() const { return this->Ok(); }
  StatusCode Code() const { return this->Code_; }
  const std::string& Message() const { return this->Message_; }

private:
  StatusCode Code_ = StatusCode::Ok;
  std::string Message_;
};

/// A value, or the status that says why there is none.
template <typename T>
class Result
{
public:
  Result(T value) // NOLINT: conversion intended, `return value;`
    : Content(std::move(value))
  {
  }
  Result(Status status) // NOLINT: conversion intended, `return status;`
    : Content(std::move(status))
  {
    assert(!std::get<Status>(this->Content).Ok());
  }

  bool Ok() const { return std::holds_alternative<T>(this->Content); }
  explicit operator bool() const { return this->Ok(); }
  /// Requires: Ok().
  T& Value() { return std::get<T>(this->Content); }
  const T& Value() const { return std::get<T>(this->Content); }
  /// The reason of the failure, or an Ok status.
  Status GetStatus() const { return this->Ok() ? Status() : std::get<Status>(this->Content); }

private:
  std::variant<T, Status> Content;
};

} // namespace teravox
