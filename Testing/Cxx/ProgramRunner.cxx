// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ProgramRunner.h"

#include "VTKTestSupport.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace teravox::test
{
namespace
{

std::string ReadAll(const std::string& fileName)
{
  std::ifstream stream(fileName);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void Redirect(const std::string& fileName, int descriptor)
{
  const int file = open(fileName.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  dup2(file, descriptor);
  close(file);
}

/// Becomes the program; in the child only.
[[noreturn]] void Become(const std::vector<std::string>& arguments, const RunOptions& options,
  const std::string& output, const std::string& error)
{
  Redirect(output, STDOUT_FILENO);
  Redirect(error, STDERR_FILENO);
  if (options.Display)
  {
    setenv("DISPLAY", options.Display->c_str(), 1);
  }
  if (options.GLVersion)
  {
    setenv("MESA_GL_VERSION_OVERRIDE", options.GLVersion->c_str(), 1);
  }
  if (!options.TemporaryFolder.empty())
  {
    setenv("TMPDIR", options.TemporaryFolder.c_str(), 1);
  }
  if (options.AddressSpaceLimit > 0)
  {
    const rlimit limit{ options.AddressSpaceLimit, options.AddressSpaceLimit };
    setrlimit(RLIMIT_AS, &limit);
  }
  if (options.FileSizeLimit > 0)
  {
    // Without the signal a write beyond the limit fails like one on a full disk.
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{ options.FileSizeLimit, options.FileSizeLimit };
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  std::vector<char*> argv;
  std::string program = TERAVOX_PROGRAM;
  argv.push_back(program.data());
  for (const std::string& argument : arguments)
  {
    argv.push_back(const_cast<char*>(argument.c_str())); // execv doesn't write
  }
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  _exit(127);
}

bool AnyFileBegins(const std::filesystem::path& name)
{
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(name.parent_path(), error))
  {
    if (entry.path().filename().string().rfind(name.filename().string(), 0) == 0)
    {
      return true;
    }
  }
  return false;
}

} // namespace

Outcome RunProgram(const std::vector<std::string>& arguments, const RunOptions& options)
{
  const std::string output = FreshFileName("stdout.txt");
  const std::string error = FreshFileName("stderr.txt");
  const pid_t child = fork();
  if (child == 0)
  {
    Become(arguments, options, output, error);
  }
  int status = 0;
  rusage usage{};
  if (!options.InterruptWhenExists.empty())
  {
    while (wait4(child, &status, WNOHANG, &usage) == 0)
    {
      if (AnyFileBegins(options.InterruptWhenExists))
      {
        std::this_thread::sleep_for(std::chrono::milliseconds(options.DelayMilliseconds));
        for (const int number : options.Signals)
        {
          kill(child, number);
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        wait4(child, &status, 0, &usage);
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  else
  {
    wait4(child, &status, 0, &usage);
  }
  Outcome outcome;
  outcome.PeakBytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  outcome.ExitCode = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  outcome.Output = ReadAll(output);
  outcome.Error = ReadAll(error);
  return outcome;
}

} // namespace teravox::test
