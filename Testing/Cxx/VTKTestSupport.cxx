// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKTestSupport.h"

#include "ErrorText.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>

namespace teravox::test
{

void ErrorRecorder::Observe(vtkObject* object)
{
  object->AddObserver(vtkCommand::ErrorEvent, this);
}

void ErrorRecorder::Execute(vtkObject*, unsigned long, void* data)
{
  this->Errors.push_back(ErrorText(static_cast<const char*>(data)));
}

IndexBrickSource::IndexBrickSource(VolumeInfo info)
  : Info_(std::move(info))
{
}

std::shared_ptr<IndexBrickSource> IndexBrickSource::Make(
  const Int3& dimensions, int brickSize, int components)
{
  VolumeInfo info;
  info.Layout = PyramidLayout::MakeDefault(dimensions, { 1, 1, 1 }, brickSize).Value();
  info.Type = ScalarType::Float64;
  info.Components = components;
  info.Name = "test volume";
  return std::make_shared<IndexBrickSource>(info);
}

double IndexBrickSource::ValueAt(
  int level, std::int64_t x, std::int64_t y, std::int64_t z, int component)
{
  return static_cast<double>(x + 100 * y + 10000 * z) + 1e6 * level + 1e7 * component;
}

Result<BrickPointer> IndexBrickSource::ReadBrick(const BrickKey& key)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Log.push_back(key);
  }
  if (this->Fails && this->Fails(key))
  {
    return Status(StatusCode::Corrupt, "The test volume can't read " + key.ToString() + ".");
  }
  auto brick = std::make_shared<Brick>();
  brick->Type = this->Info_.Type;
  brick->Components = this->Info_.Components;
  brick->StoredSize = this->Info_.Layout.StoredSize();
  const std::int64_t edge = brick->StoredSize;
  std::vector<double> values;
  const Int3& size = this->Info_.Layout.Dimensions(key.Level);
  const std::int64_t inner = this->Info_.Layout.BrickSize();
  for (std::int64_t z = 0; z < edge; ++z)
  {
    for (std::int64_t y = 0; y < edge; ++y)
    {
      for (std::int64_t x = 0; x < edge; ++x)
      {
        const Int3 at{ std::clamp<std::int64_t>(key.X * inner + x - BrickBorder, 0, size[0] - 1),
          std::clamp<std::int64_t>(key.Y * inner + y - BrickBorder, 0, size[1] - 1),
          std::clamp<std::int64_t>(key.Z * inner + z - BrickBorder, 0, size[2] - 1) };
        for (int c = 0; c < brick->Components; ++c)
        {
          values.push_back(ValueAt(key.Level, at[0], at[1], at[2], c));
        }
      }
    }
  }
  brick->Voxels.resize(values.size() * sizeof(double));
  std::memcpy(brick->Voxels.data(), values.data(), brick->Voxels.size());
  return BrickPointer(brick);
}

Result<std::vector<ValueRange>> IndexBrickSource::ReadRanges(const BrickKey&, const Int3& count)
{
  return std::vector<ValueRange>(
    static_cast<std::size_t>(count[0] * count[1] * count[2]), ValueRange::Unknown());
}

std::vector<BrickKey> IndexBrickSource::Reads()
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Log;
}

vtkStandardNewMacro(AnySourceAlgorithm);

std::shared_ptr<BrickSource> AnySourceAlgorithm::MakeBrickSource(std::string& reason)
{
  reason = this->Source ? "" : "There is no test source.";
  return this->Source;
}

vtkSmartPointer<vtkImageData> MakeRandomImage(
  int vtkType, const int extent[6], int components, bool cellData, unsigned seed)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetExtent(extent[0], extent[1], extent[2], extent[3], extent[4], extent[5]);
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(vtkType));
  array->SetName("density");
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(cellData ? image->GetNumberOfCells() : image->GetNumberOfPoints());
  std::mt19937 random(seed);
  const bool real = vtkType == VTK_FLOAT || vtkType == VTK_DOUBLE;
  const double low = array->GetDataTypeMin();
  const double high = array->GetDataTypeMax();
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < components; ++c)
    {
      const double unit = static_cast<double>(random()) / 4294967296.0;
      array->SetComponent(
        i, c, real ? unit * 200.0 - 100.0 : low + std::floor(unit * (high - low)));
    }
  }
  if (cellData)
  {
    image->GetCellData()->SetScalars(array);
  }
  else
  {
    image->GetPointData()->SetScalars(array);
  }
  return image;
}

namespace
{

/// The folder of this process; gone when it ends.
class TemporaryFolder
{
public:
  TemporaryFolder()
    : Path(std::filesystem::temp_directory_path() / ("teravox-test-" + std::to_string(getpid())))
  {
    std::filesystem::create_directories(this->Path);
  }
  ~TemporaryFolder()
  {
    std::error_code error;
    std::filesystem::remove_all(this->Path, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  const std::filesystem::path Path;
};

} // namespace

std::string FreshFileName(const std::string& name)
{
  static const TemporaryFolder folder;
  const auto file = folder.Path / name;
  std::filesystem::remove_all(file);
  return file.string();
}

} // namespace teravox::test
