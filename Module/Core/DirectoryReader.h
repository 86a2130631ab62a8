// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace teravox
{

/// Reads the value ranges of a volume's page directory, all levels, in a thread of its own: a
/// picture can be begun before they are known, and a disk that stalls holds nobody up.
/// Thread: used by one thread.
class DirectoryReader
{
public:
  /// Ranges per level as PageTable::SetDirectoryRanges() takes them; empty where not known.
  using Levels = std::vector<std::vector<ValueRange>>;

  /// Begins to read. `known`: levels that needn't be read; may be shorter than the volume is deep.
  /// Requires: source isn't null.
  DirectoryReader(std::shared_ptr<BrickSource> source, Levels known);
  DirectoryReader(const DirectoryReader&) = delete;
  DirectoryReader& operator=(const DirectoryReader&) = delete;
  DirectoryReader(DirectoryReader&&) = delete;
  DirectoryReader& operator=(DirectoryReader&&) = delete;
  /// Waits for the read that is under way, see EndOrLeave().
  ~DirectoryReader();

  /// Waits until all levels have been read or have failed; false after `seconds`.
  bool Wait(double seconds);
  /// Reads no other level, and waits as Wait() does.
  bool EndWithin(double seconds);
  /// What was read; levels that can't be read, or of which the source gives another number of
  /// ranges than there are regions, are empty. Requires: Wait() has returned true.
  Levels Take();

private:
  void Work();

  const std::shared_ptr<BrickSource> Source;
  std::mutex Mutex;
  std::condition_variable Changed;
  Levels Read;
  bool Stop = false;
  bool Done = false;
  std::thread Thread; // last: started when all else is ready
};

} // namespace teravox
