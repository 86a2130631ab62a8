// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkHDF5PyramidReader.h"

#include "BrickSeries.h"
#include "HDF5BrickSource.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <system_error>
#include <utility>
#include <vector>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkHDF5PyramidReader);

namespace
{

/// Changes when the file is replaced or written to; empty if there is none.
std::string VersionOf(const std::string& fileName)
{
  std::error_code error;
  const auto size = std::filesystem::file_size(fileName, error);
  if (error)
  {
    return {};
  }
  const auto time = std::filesystem::last_write_time(fileName, error);
  return std::to_string(size) + "/" + std::to_string(time.time_since_epoch().count());
}

teravox::HDF5OpenOptions OptionsOf(vtkHDF5PyramidReader& reader, int channel, int time)
{
  teravox::HDF5OpenOptions options;
  options.DatasetPath = reader.GetDatasetPath();
  options.BrickSize = reader.GetBrickSize();
  options.Channel = channel;
  options.TimePoint = time;
  if (!reader.GetPreviews())
  {
    options.PreviewsFrom = teravox::HDF5OpenOptions::NoPreviews;
  }
  return options;
}

/// Steps that are opened when they are asked for: a file each, or the time points of one file.
class OpenedSteps : public teravox::BrickSeries
{
public:
  using Opener =
    std::function<teravox::Result<std::shared_ptr<teravox::HDF5BrickSource>>(int step)>;

  /// `first`: step 0, if it is open; let go of once it was asked for something.
  OpenedSteps(int steps, Opener opener, std::shared_ptr<teravox::BrickSource> first = nullptr)
    : Open(std::move(opener))
    , First(std::move(first))
    , Opened(static_cast<std::size_t>(steps))
  {
    this->Opened[0] = this->First;
  }
  int NumberOfSteps() const override { return static_cast<int>(this->Opened.size()); }
  teravox::Result<std::shared_ptr<teravox::BrickSource>> Step(int step) override
  {
    const auto i = static_cast<std::size_t>(step);
    const std::lock_guard<std::mutex> lock(this->Mutex);
    const auto first = std::move(this->First);
    if (auto source = this->Opened[i].lock())
    {
      return source;
    }
    auto opened = this->Open(step);
    if (!opened)
    {
      return opened.GetStatus();
    }
    const std::shared_ptr<teravox::BrickSource> source = opened.Value();
    this->Opened[i] = source;
    return source;
  }

private:
  const Opener Open;
  std::mutex Mutex;
  std::shared_ptr<teravox::BrickSource> First;
  std::vector<std::weak_ptr<teravox::BrickSource>> Opened;
};

} // namespace

vtkHDF5PyramidReader::vtkHDF5PyramidReader() = default;
vtkHDF5PyramidReader::~vtkHDF5PyramidReader() = default;
void vtkHDF5PyramidReader::AddFileName(const char* name)
{
  this->FileNames.emplace_back(name ? name : "");
  this->TimeValues.push_back(static_cast<double>(this->TimeValues.size()));
  this->BrickSourceModified();
}

void vtkHDF5PyramidReader::RemoveAllFileNames()
{
  if (!this->FileNames.empty())
  {
    this->FileNames.clear();
    this->TimeValues.clear();
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetTimeValue(int step, double time)
{
  if (step < 0 || step >= this->GetNumberOfFileNames())
  {
    vtkErrorMacro("There is no step " << step << " among " << this->GetNumberOfFileNames() << ".");
    return;
  }
  if (this->TimeValues[static_cast<std::size_t>(step)] != time)
  {
    this->TimeValues[static_cast<std::size_t>(step)] = time;
    this->BrickSourceModified();
  }
}

std::vector<double> vtkHDF5PyramidReader::FindTimes()
{
  if (!this->FileNames.empty())
  {
    return this->TimeValues;
  }
  if (this->FileName.empty() || this->TimePoint >= 0)
  {
    return {};
  }
  std::string reason; // told by MakeBrickSource(), which tries again
  this->JustOpened = this->OpenTimePoint(0, reason);
  std::vector<double> times =
    this->JustOpened ? this->JustOpened->Description().Times : std::vector<double>{};
  if (times.size() < 2)
  {
    return {};
  }
  if (!std::is_sorted(times.begin(), times.end()))
  {
    std::iota(times.begin(), times.end(), 0.0);
  }
  return times;
}

std::shared_ptr<teravox::BrickSeries> vtkHDF5PyramidReader::MakeBrickSeries(std::string& reason)
{
  const auto open = [options = OptionsOf(*this, this->Channel, 0)](
                      const std::string& name, int time)
  {
    teravox::HDF5OpenOptions wish = options;
    wish.TimePoint = time;
    return teravox::HDF5BrickSource::Open(name, wish);
  };
  if (this->FileNames.empty())
  {
    return std::make_shared<OpenedSteps>(
      static_cast<int>(this->Description->Times.size()),
      [open, name = this->FileName](int step) { return open(name, step); },
      std::exchange(this->JustOpened, nullptr));
  }
  if (!std::is_sorted(this->TimeValues.begin(), this->TimeValues.end()))
  {
    reason = "The times of the steps don't ascend.";
    return nullptr;
  }
  this->CheckedTime = this->GetMTime();
  this->OpenedVersion = this->VersionOfFiles();
  return std::make_shared<OpenedSteps>(this->GetNumberOfFileNames(),
    [open, names = this->FileNames](int step)
    { return open(names[static_cast<std::size_t>(step)], 0); });
}

std::string vtkHDF5PyramidReader::VersionOfFiles() const
{
  std::string version = VersionOf(this->FileName);
  for (const std::string& name : this->FileNames)
  {
    version += ";" + VersionOf(name);
  }
  return version;
}

void vtkHDF5PyramidReader::SetFileName(const char* name)
{
  const std::string value = name ? name : "";
  if (this->FileName != value)
  {
    this->FileName = value;
    this->VolumeModified();
  }
}

void vtkHDF5PyramidReader::SetDatasetPath(const char* path)
{
  const std::string value = path ? path : "";
  if (this->DatasetPath != value)
  {
    this->DatasetPath = value;
    this->VolumeModified();
  }
}

void vtkHDF5PyramidReader::SetBrickSize(int size)
{
  size = std::clamp(size, 2, 1024);
  if (this->BrickSize != size)
  {
    this->BrickSize = size;
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetPreviews(bool previews)
{
  if (this->Previews != previews)
  {
    this->Previews = previews;
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetChannel(int channel)
{
  channel = std::max(channel, teravox::VolumeRequest::AllChannels);
  if (this->Channel != channel)
  {
    this->Channel = channel;
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetTimePoint(int timePoint)
{
  timePoint = std::max(timePoint, -1);
  if (this->TimePoint != timePoint)
  {
    this->TimePoint = timePoint;
    this->BrickSourceModified();
  }
}

int vtkHDF5PyramidReader::CanReadFile(const char* name)
{
  return name && teravox::HDF5BrickSource::Open(name, OptionsOf(*this, 0, 0)).Ok() ? 1 : 0;
}

std::shared_ptr<teravox::HDF5BrickSource> vtkHDF5PyramidReader::OpenTimePoint(
  int time, std::string& reason)
{
  this->CheckedTime = this->GetMTime();
  this->OpenedVersion = this->VersionOfFiles();
  this->Description.reset();
  auto opened =
    teravox::HDF5BrickSource::Open(this->FileName, OptionsOf(*this, this->Channel, time));
  if (!opened)
  {
    reason = opened.GetStatus().Message();
    return nullptr;
  }
  this->Description = std::make_unique<teravox::VolumeDescription>(opened.Value()->Description());
  return opened.Value();
}

std::shared_ptr<teravox::BrickSource> vtkHDF5PyramidReader::MakeBrickSource(std::string& reason)
{
  if (this->FileName.empty())
  {
    reason = "No file name was set.";
    return nullptr;
  }
  if (this->JustOpened)
  {
    return std::exchange(this->JustOpened, nullptr);
  }
  return this->OpenTimePoint(std::max(this->TimePoint, 0), reason);
}

const teravox::VolumeDescription* vtkHDF5PyramidReader::EnsureDescription()
{
  return this->FileNames.empty() && this->GetNumberOfLevels() > 0 ? this->Description.get()
                                                                  : nullptr;
}

int vtkHDF5PyramidReader::GetNumberOfChannels()
{
  const auto* description = this->EnsureDescription();
  return description ? static_cast<int>(description->Channels.size()) : 0;
}

int vtkHDF5PyramidReader::GetNumberOfTimePoints()
{
  const auto* description = this->EnsureDescription();
  return description ? static_cast<int>(description->Times.size()) : 0;
}

std::string vtkHDF5PyramidReader::GetChannelName(int channel)
{
  const auto* description = this->EnsureDescription();
  const auto index = static_cast<std::size_t>(channel);
  return description && channel >= 0 && index < description->Channels.size()
    ? description->Channels[index].Name
    : std::string();
}

std::string vtkHDF5PyramidReader::GetDescriptionText()
{
  const auto* description = this->EnsureDescription();
  std::string text;
  if (description)
  {
    for (const std::string& line : description->Seen)
    {
      text += line + "\n";
    }
  }
  return text;
}

bool vtkHDF5PyramidReader::IsBrickSourceOutdated()
{
  if (this->GetMTime() == this->CheckedTime)
  {
    return false;
  }
  this->CheckedTime = this->GetMTime();
  return this->VersionOfFiles() != this->OpenedVersion;
}

void vtkHDF5PyramidReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << "\n";
  os << indent << "FileNames: " << this->FileNames.size() << "\n";
  os << indent << "DatasetPath: " << this->DatasetPath << "\n";
  os << indent << "BrickSize: " << this->BrickSize << "\n";
  os << indent << "Previews: " << (this->Previews ? "On" : "Off") << "\n";
  os << indent << "Channel: " << this->Channel << "\n";
  os << indent << "TimePoint: " << this->TimePoint << "\n";
}
