// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RefinementBoard.h"

#include <map>
#include <mutex>

namespace teravox
{

namespace
{

struct Board
{
  int Opened = 0; // how often
  std::vector<DrawnPicture> Pictures;
};

std::mutex Lock;

std::map<const void*, Board>& Boards()
{
  static std::map<const void*, Board> boards;
  return boards;
}

} // namespace

void RefinementBoard::Open(const void* window)
{
  const std::lock_guard<std::mutex> guard(Lock);
  ++Boards()[window].Opened;
}

void RefinementBoard::Close(const void* window)
{
  const std::lock_guard<std::mutex> guard(Lock);
  const auto found = Boards().find(window);
  if (found != Boards().end() && --found->second.Opened == 0)
  {
    Boards().erase(found);
  }
}

void RefinementBoard::Clear(const void* window)
{
  const std::lock_guard<std::mutex> guard(Lock);
  const auto found = Boards().find(window);
  if (found != Boards().end())
  {
    found->second.Pictures.clear();
  }
}

void RefinementBoard::Post(const void* window, const DrawnPicture& picture)
{
  const std::lock_guard<std::mutex> guard(Lock);
  const auto found = Boards().find(window);
  if (found != Boards().end())
  {
    found->second.Pictures.push_back(picture);
  }
}

std::vector<DrawnPicture> RefinementBoard::Read(const void* window)
{
  const std::lock_guard<std::mutex> guard(Lock);
  const auto found = Boards().find(window);
  return found != Boards().end() ? found->second.Pictures : std::vector<DrawnPicture>{};
}

} // namespace teravox
