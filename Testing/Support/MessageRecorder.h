// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>
#include <vtkCommand.h>

namespace teravox::test
{

/// Keeps the texts of the events that it observes: errors, or warnings.
class MessageRecorder : public vtkCommand
{
public:
  static MessageRecorder* New() { return new MessageRecorder; }
  void Execute(vtkObject*, unsigned long, void* data) override
  {
    this->Messages.emplace_back(static_cast<const char*>(data));
  }
  std::vector<std::string> Messages;
};

} // namespace teravox::test
