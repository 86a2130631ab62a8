// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SelfProcess.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <spawn.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

namespace teravox::program
{

Status RunSelf(const std::vector<std::string>& arguments)
{
  std::error_code error;
  std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
  {
    return { StatusCode::InputOutput, "The program doesn't find itself." };
  }
  std::vector<std::string> copies = arguments;
  std::vector<char*> pointers{ self.data() };
  for (std::string& argument : copies)
  {
    pointers.push_back(argument.data());
  }
  pointers.push_back(nullptr);
  std::fflush(stdout); // what has been printed stays before what it prints
  pid_t child = 0;
  if (posix_spawn(&child, self.c_str(), nullptr, nullptr, pointers.data(), environ) != 0)
  {
    return { StatusCode::InputOutput, "The program can't start itself." };
  }
  int state = 0;
  while (waitpid(child, &state, 0) < 0 && errno == EINTR)
  {
  }
  return WIFEXITED(state) && WEXITSTATUS(state) == 0
    ? Status()
    : Status(StatusCode::InputOutput, "A process of its own failed.");
}

} // namespace teravox::program
