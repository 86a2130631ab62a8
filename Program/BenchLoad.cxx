// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the way from a file to bricks costs beside decoding itself: bricks through source and
// loader, and the same chunks decoded by the codec's library alone, in turns.
#include "BenchChunks.h"
#include "BenchClock.h"
#include "BrickCache.h"
#include "BrickLoader.h"
#include "ByteCount.h"
#include "Commands.h"
#include "HDF5BrickSource.h"
#include "Interrupt.h"
#include "TemporaryFolder.h"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace teravox::program
{
namespace
{

using Json = nlohmann::ordered_json;

constexpr double LongestWait = 60;  // seconds until the next brick
constexpr double CacheShare = 0.75; // of the volume; a layer of bricks needs three of chunks
/// The same source under several numbers: what one pass leaves in the cache isn't what the next
/// asks for, but what it evicts.
constexpr std::uint32_t Volumes = 3;

/// Bricks of one pass through source and loader.
struct Delivery
{
  double Seconds = 0;
  double CPUSeconds = 0;
  std::uint64_t Bricks = 0;
  std::uint64_t Bytes = 0;     ///< of bricks with their borders
  std::uint64_t BytesRead = 0; ///< of the file
};

/// Source and loader as a renderer has them that has drawn for a while: their caches are full, and
/// hold a part of the volume, so that each pass reads and decodes each chunk once.
struct Loading
{
  std::shared_ptr<BrickSource> Source;
  std::unique_ptr<BrickLoader> Loader;
  std::uint32_t Pass = 0;
};

Result<Loading> OpenLoading(const std::string& fileName, BenchFilter filter, int threads)
{
  HDF5OpenOptions options;
  options.DatasetPath = HasPyramid(filter) ? "" : DatasetOf(filter);
  options.PreviewsFrom = HDF5OpenOptions::NoPreviews;
  auto source = HDF5BrickSource::Open(fileName, options);
  if (!source.Ok())
  {
    return source.GetStatus();
  }
  const VolumeInfo& info = source.Value()->Info();
  const Int3& size = info.Layout.Dimensions(0);
  const auto bytes = static_cast<std::uint64_t>(size[0] * size[1] * size[2]) * SizeOf(info.Type);
  const auto share = static_cast<std::uint64_t>(CacheShare * static_cast<double>(bytes));
  source.Value()->SetMemoryBudget(share);
  Loading loading{ source.Value(),
    std::make_unique<BrickLoader>(std::make_shared<BrickCache>(share), threads), 0 };
  for (std::uint32_t volume = 0; volume < Volumes; ++volume)
  {
    loading.Loader->SetSource(volume, source.Value());
  }
  return loading;
}

/// All bricks of level 0, one layer after another.
Result<Delivery> Deliver(Loading& loading)
{
  BrickLoader& loader = *loading.Loader;
  const VolumeInfo& info = loading.Source->Info();
  const std::uint64_t readBefore = loading.Source->BytesRead();
  const Int3& bricks = info.Layout.Bricks(0);
  std::vector<LoadRequest> wishes;
  for (std::int64_t i = 0; i < bricks[0] * bricks[1] * bricks[2]; ++i)
  {
    LoadRequest wish;
    wish.Key.Volume = loading.Pass % Volumes;
    wish.Key.X = static_cast<std::uint32_t>(i % bricks[0]);
    wish.Key.Y = static_cast<std::uint32_t>(i / bricks[0] % bricks[1]);
    wish.Key.Z = static_cast<std::uint32_t>(i / bricks[0] / bricks[1]);
    wish.Priority = -static_cast<double>(i);
    wishes.push_back(wish);
  }
  Delivery delivery;
  const std::size_t wanted = wishes.size();
  ++loading.Pass;
  const BenchClock clock;
  loader.Request(std::move(wishes));
  while (delivery.Bricks < wanted)
  {
    if (!loader.WaitFinished(LongestWait))
    {
      return Status(StatusCode::InputOutput, fmt::format("No brick came of the {}.", info.Name));
    }
    for (const LoadResult& result : loader.TakeFinished())
    {
      if (!result.Outcome.Ok())
      {
        return result.Outcome;
      }
      delivery.Bytes += result.Brick->Voxels.size();
      ++delivery.Bricks;
    }
  }
  delivery.Seconds = clock.Seconds();
  delivery.CPUSeconds = clock.CPUSeconds();
  delivery.BytesRead = loading.Source->BytesRead() - readBefore;
  return delivery;
}

/// One row of the table.
Result<Json> MeasureOne(const LoadOptions& options, const std::string& folder, BenchFilter filter,
  ScalarType type, int threads)
{
  const std::string file = fmt::format("{}/{}-{}.h5", folder, ToString(filter), ToString(type));
  Status written = WriteBenchFile(file, filter, type, options.Edge);
  if (!written.Ok())
  {
    return written;
  }
  auto chunks = BenchChunks::Read(file, filter, type, options.Edge);
  if (!chunks.Ok())
  {
    return chunks.GetStatus();
  }
  auto loading = OpenLoading(file, filter, threads);
  if (!loading.Ok())
  {
    return loading.GetStatus();
  }
  std::vector<double> codec;
  std::vector<double> codecCPU;
  std::vector<double> delivering;
  std::vector<double> deliveringCPU;
  std::vector<double> ratios;
  std::vector<double> ratiosCPU;
  Delivery delivery;
  for (int i = -1; i < options.Repetitions; ++i)
  {
    const BenchClock clock;
    const bool good = chunks.Value().Decode(threads);
    const double seconds = clock.Seconds();
    const double cpu = clock.CPUSeconds();
    auto delivered = Deliver(loading.Value());
    if (WasInterrupted())
    {
      return Status(StatusCode::Cancelled, "It was interrupted; its files are removed.");
    }
    if (!good || !delivered.Ok())
    {
      return good ? delivered.GetStatus()
                  : Status(StatusCode::Corrupt, fmt::format("{} doesn't decode.", file));
    }
    delivery = delivered.Value();
    if (i < 0)
    {
      continue; // warms caches and memory
    }
    codec.push_back(seconds);
    codecCPU.push_back(cpu);
    delivering.push_back(delivery.Seconds);
    deliveringCPU.push_back(delivery.CPUSeconds);
    ratios.push_back(seconds / delivery.Seconds);
    ratiosCPU.push_back(cpu / delivery.CPUSeconds);
  }
  std::remove(file.c_str());
  const auto decoded = static_cast<double>(chunks.Value().DecodedBytes());
  Json row;
  row["filter"] = ToString(filter);
  row["type"] = ToString(type);
  row["stored_bytes"] = chunks.Value().StoredBytes();
  row["decoded_bytes"] = chunks.Value().DecodedBytes();
  row["delivered_bytes"] = delivery.Bytes;
  row["bricks"] = delivery.Bricks;
  // 1: no chunk was read, and so decoded, twice.
  row["reads_per_chunk"] =
    static_cast<double>(delivery.BytesRead) / static_cast<double>(chunks.Value().StoredBytes());
  row["codec_seconds"] = MedianOf(codec);
  row["codec_cpu_seconds"] = MedianOf(codecCPU);
  row["loading_seconds"] = MedianOf(delivering);
  row["loading_cpu_seconds"] = MedianOf(deliveringCPU);
  row["codec_bytes_per_second"] = decoded / MedianOf(codec);
  row["loading_bytes_per_second"] = decoded / MedianOf(delivering);
  row["delivered_bytes_per_second"] = static_cast<double>(delivery.Bytes) / MedianOf(delivering);
  row["ratio"] = MedianOf(ratios);
  row["cpu_ratio"] = MedianOf(ratiosCPU);
  return row;
}

void PrintHead(int threads)
{
  fmt::print(
    "Voxels decoded per second, on {} threads; with borders: as bricks are delivered.\n", threads);
  fmt::print("{:<16} {:<6} {:>8} {:>12} {:>12} {:>12} {:>7} {:>9} {:>12}\n", "filter", "type",
    "ratio", "codec", "bricks", "with borders", "share", "CPU share", "reads/chunk");
}

void PrintRow(const Json& row)
{
  const auto number = [&row](const char* name) { return row.at(name).get<double>(); };
  const auto speed = [&number](const char* name)
  { return fmt::format("{}/s", FormatByteCount(number(name))); };
  fmt::print("{:<16} {:<6} {:>8.2f} {:>12} {:>12} {:>12} {:>6.0f}% {:>8.0f}% {:>12.2f}\n",
    row.at("filter").get<std::string>(), row.at("type").get<std::string>(),
    number("decoded_bytes") / number("stored_bytes"), speed("codec_bytes_per_second"),
    speed("loading_bytes_per_second"), speed("delivered_bytes_per_second"), 100 * number("ratio"),
    100 * number("cpu_ratio"), number("reads_per_chunk"));
  std::fflush(stdout);
}

} // namespace

Status RunBenchLoad(const LoadOptions& options)
{
  if (options.Edge % 64 != 0)
  {
    return { StatusCode::InvalidArgument, "The edge must be a multiple of 64 voxels." };
  }
  // Until the folder is gone, Ctrl-C only asks.
  CatchInterrupts("");
  const TemporaryFolder folder(options.Folder);
  if (folder.Path().empty())
  {
    return { StatusCode::InputOutput, "There is no folder for temporary files." };
  }
  const int threads = options.Threads > 0
    ? options.Threads
    : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  Json all;
  all["voxels_per_axis"] = options.Edge;
  all["threads"] = threads;
  all["repetitions"] = options.Repetitions;
  all["rows"] = Json::array();
  if (!options.Json)
  {
    PrintHead(threads);
  }
  for (const std::string& name : options.Filters)
  {
    const auto filter = ParseBenchFilter(name);
    if (!filter.Ok())
    {
      return filter.GetStatus();
    }
    for (const ScalarType type : options.Types)
    {
      const auto row = MeasureOne(options, folder.Path(), filter.Value(), type, threads);
      if (!row.Ok())
      {
        return row.GetStatus();
      }
      all["rows"].push_back(row.Value());
      if (!options.Json)
      {
        PrintRow(row.Value());
      }
    }
  }
  if (options.Json)
  {
    fmt::print("{}\n", all.dump(2));
  }
  return {};
}

} // namespace teravox::program
