// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SelfOutput.h"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace teravox::program
{
namespace
{

/// Both ends of a pipe, closed with it.
class Pipe
{
public:
  Pipe() { this->Open = pipe2(this->Ends.data(), O_CLOEXEC) == 0; }
  ~Pipe()
  {
    this->CloseWriting();
    if (this->Open)
    {
      close(this->Ends[0]);
    }
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  Pipe(Pipe&&) = delete;
  Pipe& operator=(Pipe&&) = delete;

  bool IsOpen() const { return this->Open; }
  int Reading() const { return this->Ends[0]; }
  int Writing() const { return this->Ends[1]; }
  void CloseWriting()
  {
    if (this->Open && this->Ends[1] >= 0)
    {
      close(this->Ends[1]);
      this->Ends[1] = -1;
    }
  }

private:
  std::array<int, 2> Ends{ -1, -1 };
  bool Open = false;
};

/// Reads both pipes until their writers are gone.
void ReadBoth(
  const Pipe& first, std::string& firstText, const Pipe& second, std::string& secondText)
{
  std::array<pollfd, 2> waiting{ pollfd{ first.Reading(), POLLIN, 0 },
    pollfd{ second.Reading(), POLLIN, 0 } };
  std::array<char, 4096> buffer{};
  while (waiting[0].fd >= 0 || waiting[1].fd >= 0)
  {
    if (poll(waiting.data(), waiting.size(), -1) < 0)
    {
      if (errno == EINTR)
      {
        continue;
      }
      return;
    }
    for (std::size_t i = 0; i < waiting.size(); ++i)
    {
      if (waiting[i].revents == 0)
      {
        continue;
      }
      const ssize_t count = read(waiting[i].fd, buffer.data(), buffer.size());
      if (count > 0)
      {
        (i == 0 ? firstText : secondText).append(buffer.data(), static_cast<std::size_t>(count));
      }
      else if (count == 0 || errno != EINTR)
      {
        waiting[i].fd = -1; // poll() passes over it
      }
    }
  }
}

} // namespace

Result<std::string> OutputOfSelf(const std::vector<std::string>& arguments)
{
  std::array<char, 4096> self{};
  const ssize_t length = readlink("/proc/self/exe", self.data(), self.size() - 1);
  Pipe output;
  Pipe error;
  if (length <= 0 || !output.IsOpen() || !error.IsOpen())
  {
    return Status(StatusCode::InputOutput, "The program can't start itself to measure with.");
  }
  std::vector<std::string> words{ self.data() };
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words)
  {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, output.Writing(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, error.Writing(), STDERR_FILENO);
  pid_t child = -1;
  const int failed = posix_spawn(&child, self.data(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0)
  {
    return Status(StatusCode::InputOutput, "The program can't start itself to measure with.");
  }
  output.CloseWriting();
  error.CloseWriting();
  std::string text;
  std::string complaint;
  ReadBoth(output, text, error, complaint);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR)
  {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
  {
    // Its own sentence without the program's name; drivers may have written before it.
    complaint.erase(complaint.find_last_not_of('\n') + 1);
    complaint.erase(0, complaint.rfind('\n') == std::string::npos ? 0 : complaint.rfind('\n') + 1);
    const std::size_t colon =
      complaint.rfind("teravox ", 0) == 0 ? complaint.find(": ") : std::string::npos;
    return Status(StatusCode::InputOutput,
      complaint.empty() ? std::string("A measurement failed.")
                        : complaint.substr(colon == std::string::npos ? 0 : colon + 2));
  }
  return text;
}

} // namespace teravox::program
