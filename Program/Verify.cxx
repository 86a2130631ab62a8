// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Commands.h"
#include "HDF5BrickSource.h"
#include "Interrupt.h"
#include "VolumeVerifier.h"

#include <cstdio>
#include <fmt/format.h>

namespace teravox::program
{

Status RunVerify(const VerifyOptions& options)
{
  HDF5OpenOptions open;
  open.DatasetPath = options.Volume.Dataset;
  open.Channel = options.Volume.Channel;
  open.TimePoint = options.Volume.TimePoint;
  open.PreviewsFrom = HDF5OpenOptions::NoPreviews; // they are what level 0 makes them
  auto source = HDF5BrickSource::Open(options.Volume.Name, open);
  if (!source.Ok())
  {
    return source.GetStatus();
  }
  CatchInterrupts({});
  VerifyReport report;
  const Status status =
    VerifyVolume(*source.Value(), report, [](double) { return !WasInterrupted(); });
  for (const std::string& finding : report.Findings)
  {
    fmt::print("{}\n", finding);
  }
  if (!status.Ok())
  {
    return { status.Code(), fmt::format("{}: interrupted.", options.Volume.Name) };
  }
  if (!report.Findings.empty())
  {
    return { StatusCode::Corrupt,
      fmt::format("{} isn't right, see the list: unreadable bricks {}, wrong ranges {}, lines {}.",
        options.Volume.Name, report.UnreadableBricks, report.WrongRanges, report.Findings.size()) };
  }
  if (!options.Quiet)
  {
    fmt::print("{}: {} bricks, all readable; levels and ranges agree.\n", options.Volume.Name,
      report.Bricks);
  }
  return {};
}

} // namespace teravox::program
