// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "vtkBrickSourceAlgorithm.h"

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>
#include <vtkCommand.h>
#include <vtkSmartPointer.h>

class vtkImageData;

namespace teravox::test
{

/// Collects the errors of the objects that it observes; VTK prints nothing then.
class ErrorRecorder : public vtkCommand
{
public:
  static ErrorRecorder* New() { return new ErrorRecorder; }
  void Observe(vtkObject* object);
  void Execute(vtkObject* caller, unsigned long event, void* data) override;

  std::vector<std::string> Errors;
};

/// A pyramid without storage whose voxels tell where they are: component c of voxel (x,y,z) of
/// level l has the value x + 100 y + 10000 z + 1e6 l + 1e7 c, as double. Bricks can be made to
/// fail.
class IndexBrickSource : public BrickSource
{
public:
  explicit IndexBrickSource(VolumeInfo info);
  /// A source of f64 voxels with default levels.
  static std::shared_ptr<IndexBrickSource> Make(
    const Int3& dimensions, int brickSize, int components = 1);
  static double ValueAt(int level, std::int64_t x, std::int64_t y, std::int64_t z, int component);

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

  VolumeInfo Info_;
  std::function<bool(const BrickKey&)> Fails;
  std::vector<BrickKey> Reads();

private:
  std::mutex Mutex;
  std::vector<BrickKey> Log;
};

/// Presents any brick source.
class AnySourceAlgorithm : public vtkBrickSourceAlgorithm
{
public:
  static AnySourceAlgorithm* New();
  vtkTypeMacro(AnySourceAlgorithm, vtkBrickSourceAlgorithm);

  std::shared_ptr<BrickSource> Source;
  void SourceModified() { this->BrickSourceModified(); }

protected:
  std::shared_ptr<BrickSource> MakeBrickSource(std::string& reason) override;
};

/// An image with voxels from a fixed-seed generator, of any scalar type.
vtkSmartPointer<vtkImageData> MakeRandomImage(
  int vtkType, const int extent[6], int components, bool cellData, unsigned seed);

/// A name for a file in the test's own folder; the file doesn't exist.
std::string FreshFileName(const std::string& name);

} // namespace teravox::test
