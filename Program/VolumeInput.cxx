// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeInput.h"

#include "Formula.h"
#include "VTKScalarType.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkProceduralVolumeSource.h"
#include "vtkRepeatVolume.h"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <system_error>

namespace teravox::program
{
namespace
{

constexpr const char* FormulaPrefix = "formula:";

using Opened = Result<vtkSmartPointer<vtkBrickSourceAlgorithm>>;

Opened OpenFormula(const VolumeOptions& options, const std::string& name)
{
  const auto kind = FormulaKindFromName(name);
  if (!kind.Ok())
  {
    return kind.GetStatus();
  }
  const auto type = ScalarTypeFromName(options.Type);
  if (!type)
  {
    return Status(StatusCode::InvalidArgument,
      fmt::format("'{}' is none of u8, i8, u16, i16, u32, i32, f32, f64.", options.Type));
  }
  const auto source = vtkSmartPointer<vtkProceduralVolumeSource>::New();
  source->SetFunctionName(name.c_str());
  source->SetDimensions(options.Dimensions[0], options.Dimensions[1], options.Dimensions[2]);
  source->SetScalarType(ToVTK(*type));
  source->SetBrickSize(options.BrickSize);
  return vtkSmartPointer<vtkBrickSourceAlgorithm>(source.GetPointer());
}

Opened OpenFile(const VolumeOptions& options)
{
  std::error_code error;
  const auto status = std::filesystem::status(options.Name, error);
  if (!std::filesystem::exists(status))
  {
    return Status(StatusCode::NotFound, fmt::format("{} doesn't exist.", options.Name));
  }
  if (std::filesystem::is_directory(status))
  {
    return Status(StatusCode::InvalidArgument, fmt::format("{} is a folder.", options.Name));
  }
  const auto reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
  reader->SetFileName(options.Name.c_str());
  reader->SetDatasetPath(options.Dataset.c_str());
  reader->SetBrickSize(options.BrickSize);
  reader->SetChannel(options.Channel);
  reader->SetTimePoint(options.TimePoint);
  return vtkSmartPointer<vtkBrickSourceAlgorithm>(reader.GetPointer());
}

} // namespace

std::optional<ScalarType> ScalarTypeFromName(const std::string& name)
{
  const auto* found = std::find_if(AllScalarTypes.begin(), AllScalarTypes.end(),
    [&](ScalarType type) { return name == ToString(type); });
  return found == AllScalarTypes.end() ? std::nullopt : std::optional<ScalarType>(*found);
}

bool IsFormula(const std::string& name)
{
  return name.rfind(FormulaPrefix, 0) == 0;
}

Result<VolumePipeline> OpenVolume(const VolumeOptions& options)
{
  const Opened base = IsFormula(options.Name)
    ? OpenFormula(options, options.Name.substr(std::string(FormulaPrefix).size()))
    : OpenFile(options);
  if (!base.Ok())
  {
    return base.GetStatus();
  }
  VolumePipeline pipeline;
  pipeline.Base = base.Value();
  pipeline.Last = base.Value();
  if (options.Repeat != Int3{ 1, 1, 1 } || options.Pitch != Int3{ 0, 0, 0 })
  {
    const auto repeat = vtkSmartPointer<vtkRepeatVolume>::New();
    repeat->SetInputConnection(pipeline.Base->GetOutputPort());
    repeat->SetRepetitions(options.Repeat[0], options.Repeat[1], options.Repeat[2]);
    repeat->SetPitch(options.Pitch[0], options.Pitch[1], options.Pitch[2]);
    pipeline.Last = repeat.GetPointer();
  }
  return pipeline;
}

} // namespace teravox::program
