// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>

/// Arguments that several commands have, and those of commands with many.
namespace teravox::program
{

/// What a command does once its arguments are there.
using Run = std::function<Status()>;

/// An option that takes a number of bytes with a unit.
CLI::Option* AddBytes(
  CLI::App* app, const std::string& name, std::uint64_t& bytes, const std::string& description);

/// Which volume of a file.
void AddSelection(CLI::App* command, std::string& dataset, int& channel, int& timePoint);

Run AddConvert(CLI::App& app);

} // namespace teravox::program
