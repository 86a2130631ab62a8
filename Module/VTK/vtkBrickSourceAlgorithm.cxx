// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkBrickSourceAlgorithm.h"

#include "BrickSeries.h"
#include "PresentedLevel.h"
#include "ReadBox.h"
#include "VTKScalarType.h"
#include "VoxelArray.h"
#include "vtkBrickSource.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>

namespace
{

/// Voxels of the level that is presented by default.
constexpr double DefaultPresentedVoxels = 2.0 * 1024 * 1024;

} // namespace

class vtkBrickSourceAlgorithm::vtkInternals
{
public:
  std::shared_ptr<teravox::BrickSource> Source;
  vtkSmartPointer<vtkBrickSource> Holder;
  std::vector<double> Times;
  std::shared_ptr<teravox::BrickSeries> Series;
  int Step = 0;
  int SourceStep = 0; // whose source Source is
};

vtkBrickSourceAlgorithm::vtkBrickSourceAlgorithm()
  : Internals(std::make_unique<vtkInternals>())
{
  this->SetNumberOfInputPorts(0);
}

vtkBrickSourceAlgorithm::~vtkBrickSourceAlgorithm() = default;

void vtkBrickSourceAlgorithm::SetLevel(int level)
{
  level = std::max(level, -1);
  if (this->Level != level)
  {
    this->Level = level;
    this->Modified();
  }
}

void vtkBrickSourceAlgorithm::BrickSourceModified()
{
  this->Internals->Series.reset();
  this->Internals->Times.clear();
  this->Internals->Source.reset();
  this->Internals->Holder = nullptr;
  this->Modified();
}

void vtkBrickSourceAlgorithm::VolumeModified()
{
  this->Internals->Step = 0;
  this->BrickSourceModified();
}

std::shared_ptr<teravox::BrickSource> vtkBrickSourceAlgorithm::EnsureBrickSource()
{
  vtkInternals& internals = *this->Internals;
  if (internals.Source && this->IsBrickSourceOutdated())
  {
    internals.Source.reset();
    internals.Series.reset();
    internals.Holder = nullptr;
  }
  if (internals.Source && internals.Series && internals.SourceStep != internals.Step)
  {
    internals.Source.reset();
    internals.Holder = nullptr;
  }
  if (!internals.Source)
  {
    std::string reason;
    internals.Source = this->MakeSourceOfStep(reason);
    if (!internals.Source && !reason.empty())
    {
      vtkErrorMacro(<< reason);
    }
  }
  return internals.Source;
}

std::shared_ptr<teravox::BrickSeries> vtkBrickSourceAlgorithm::MakeBrickSeries(std::string& reason)
{
  reason = "There is no series of steps.";
  return nullptr;
}

std::shared_ptr<teravox::BrickSource> vtkBrickSourceAlgorithm::MakeSourceOfStep(std::string& reason)
{
  vtkInternals& internals = *this->Internals;
  if (!internals.Series)
  {
    internals.Times = this->FindTimes();
    if (internals.Times.empty())
    {
      return this->MakeBrickSource(reason);
    }
    internals.Series = this->MakeBrickSeries(reason);
    if (!internals.Series)
    {
      return nullptr;
    }
  }
  internals.Step = std::clamp(internals.Step, 0, internals.Series->NumberOfSteps() - 1);
  internals.SourceStep = internals.Step;
  auto source = internals.Series->Step(internals.Step);
  if (!source)
  {
    reason = source.GetStatus().Message();
    return nullptr;
  }
  return source.Value();
}

void vtkBrickSourceAlgorithm::ChooseStep(vtkInformation* outInfo)
{
  vtkInternals& internals = *this->Internals;
  if (!internals.Series || !outInfo->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP()))
  {
    return;
  }
  const double time = outInfo->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP());
  const auto later = std::upper_bound(internals.Times.begin(), internals.Times.end(), time);
  internals.Step = std::max(static_cast<int>(later - internals.Times.begin()) - 1, 0);
}

int vtkBrickSourceAlgorithm::GetNumberOfTimeSteps()
{
  const auto source = this->EnsureBrickSource();
  const auto& series = this->Internals->Series;
  return series ? series->NumberOfSteps() : source ? 1 : 0;
}

int vtkBrickSourceAlgorithm::GetPresentedTimeStep() const
{
  return this->Internals->Step;
}

int vtkBrickSourceAlgorithm::ResolveLevel(const teravox::BrickSource& source)
{
  const teravox::PyramidLayout& layout = source.Info().Layout;
  if (this->Level >= layout.NumberOfLevels())
  {
    vtkErrorMacro("Level " << this->Level << " was asked for, but " << source.Info().Name << " has "
                           << layout.NumberOfLevels() << " levels, the coarsest is "
                           << layout.NumberOfLevels() - 1 << ".");
    return -1;
  }
  if (this->Level >= 0)
  {
    return this->Level;
  }
  int level = 0;
  for (; level < layout.NumberOfLevels() - 1; ++level)
  {
    const teravox::Int3& size = layout.Dimensions(level);
    if (static_cast<double>(size[0]) * static_cast<double>(size[1]) *
        static_cast<double>(size[2]) <=
      DefaultPresentedVoxels)
    {
      break;
    }
  }
  return level;
}

int vtkBrickSourceAlgorithm::GetPresentedLevel()
{
  const auto source = this->EnsureBrickSource();
  return source ? this->ResolveLevel(*source) : -1;
}

int vtkBrickSourceAlgorithm::GetNumberOfLevels()
{
  const auto source = this->EnsureBrickSource();
  return source ? source->Info().Layout.NumberOfLevels() : 0;
}

void vtkBrickSourceAlgorithm::GetLevelDimensions(int level, long long dimensions[3])
{
  std::fill_n(dimensions, 3, 0);
  const auto source = this->EnsureBrickSource();
  if (source && level >= 0 && level < source->Info().Layout.NumberOfLevels())
  {
    const teravox::Int3& size = source->Info().Layout.Dimensions(level);
    std::copy_n(size.begin(), 3, dimensions);
  }
}

vtkBrickSource* vtkBrickSourceAlgorithm::GetBrickSource()
{
  const auto source = this->EnsureBrickSource();
  if (!source)
  {
    return nullptr;
  }
  if (!this->Internals->Holder)
  {
    this->Internals->Holder = vtkSmartPointer<vtkBrickSource>::New();
    this->Internals->Holder->SetBrickSource(source);
    const long long first[3] = { 0, 0, 0 };
    long long dimensions[3];
    this->Internals->Holder->GetLevelDimensions(0, dimensions);
    this->Internals->Holder->SetPresentation(0, first, dimensions);
    this->Internals->Holder->SetBrickSeries(this->Internals->Series, this->Internals->Step);
  }
  return this->Internals->Holder;
}

int vtkBrickSourceAlgorithm::FillOutputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), "vtkImageData");
  return 1;
}

int vtkBrickSourceAlgorithm::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  const auto source = this->EnsureBrickSource();
  const int level = source ? this->ResolveLevel(*source) : -1;
  if (level < 0)
  {
    return 0;
  }
  const teravox::VolumeInfo& info = source->Info();
  const teravox::Result<teravox::PresentedLevel> presented =
    teravox::PresentedLevel::Make(info, level);
  if (!presented.Ok())
  {
    vtkErrorMacro(<< presented.GetStatus().Message());
    return 0;
  }
  const teravox::PresentedLevel& image = presented.Value();
  vtkInformation* outInfo = outputVector->GetInformationObject(0);
  outInfo->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), image.WholeExtent.data(), 6);
  outInfo->Set(vtkDataObject::ORIGIN(), image.Origin.data(), 3);
  outInfo->Set(vtkDataObject::SPACING(), image.Spacing.data(), 3);
  outInfo->Set(vtkDataObject::DIRECTION(), image.Direction.data(), 9);
  outInfo->Set(vtkAlgorithm::CAN_PRODUCE_SUB_EXTENT(), 1);
  const std::vector<double>& times = this->Internals->Times;
  if (this->Internals->Series)
  {
    const double range[2] = { times.front(), times.back() };
    outInfo->Set(
      vtkStreamingDemandDrivenPipeline::TIME_STEPS(), times.data(), static_cast<int>(times.size()));
    outInfo->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
  }
  else
  {
    outInfo->Remove(vtkStreamingDemandDrivenPipeline::TIME_STEPS());
    outInfo->Remove(vtkStreamingDemandDrivenPipeline::TIME_RANGE());
  }
  vtkDataObject::SetActiveAttributeInfo(outInfo,
    info.CellData ? vtkDataObject::FIELD_ASSOCIATION_CELLS
                  : vtkDataObject::FIELD_ASSOCIATION_POINTS,
    vtkDataSetAttributes::SCALARS, info.ArrayName.c_str(), teravox::ToVTK(info.Type),
    info.Components, -1);
  return 1;
}

int vtkBrickSourceAlgorithm::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  this->ChooseStep(outputVector->GetInformationObject(0));
  const auto source = this->EnsureBrickSource();
  const int level = source ? this->ResolveLevel(*source) : -1;
  if (level < 0)
  {
    return 0;
  }
  const teravox::VolumeInfo& info = source->Info();
  const auto presented = teravox::PresentedLevel::Make(info, level);
  if (!presented.Ok())
  {
    vtkErrorMacro(<< presented.GetStatus().Message());
    return 0;
  }
  const teravox::PresentedLevel& image = presented.Value();
  vtkInformation* outInfo = outputVector->GetInformationObject(0);
  vtkImageData* output = vtkImageData::GetData(outInfo);
  int extent[6];
  outInfo->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent);
  output->Initialize();
  output->SetExtent(extent);
  output->SetOrigin(image.Origin.data());
  output->SetSpacing(image.Spacing.data());
  output->SetDirectionMatrix(image.Direction.data());
  if (this->Internals->Series)
  {
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(),
      this->Internals->Times[static_cast<std::size_t>(this->Internals->Step)]);
  }

  const teravox::PresentedLevel::Box box = image.VoxelsOf(extent);
  const vtkSmartPointer<vtkDataArray> array = teravox::NewVoxelArray(info, box.Size);
  if (!array)
  {
    vtkErrorMacro("The memory for " << box.Size[0] << " x " << box.Size[1] << " x " << box.Size[2]
                                    << " voxels of level " << level << " of " << info.Name
                                    << " can't be had; present a coarser level.");
    return 0;
  }
  const teravox::ReadBoxReport report = teravox::ReadBox(*source, level, box.First, box.Size,
    static_cast<std::byte*>(array->GetVoidPointer(0)),
    [this](double fraction)
    {
      this->UpdateProgress(fraction);
      return this->GetAbortExecute() == 0;
    });
  if (report.FailedBricks > 0)
  {
    vtkErrorMacro(<< report.FirstFailure.Message() << " (" << report.FailedBricks
                  << " of the bricks of level " << level
                  << " were replaced by their coarser ancestors.)");
  }
  if (info.CellData)
  {
    output->GetCellData()->SetScalars(array);
  }
  else
  {
    output->GetPointData()->SetScalars(array);
  }
  if (!report.Cancelled)
  {
    vtkNew<vtkBrickSource> holder;
    holder->SetBrickSource(source);
    const long long first[3] = { box.First[0], box.First[1], box.First[2] };
    const long long size[3] = { box.Size[0], box.Size[1], box.Size[2] };
    holder->SetPresentation(level, first, size);
    holder->SetBrickSeries(this->Internals->Series, this->Internals->Step);
    holder->Attach(array);
  }
  return 1;
}

void vtkBrickSourceAlgorithm::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Level: " << this->Level << "\n";
  os << indent << "BrickSource: "
     << (this->Internals->Source ? this->Internals->Source->Info().Name : "(not open)") << "\n";
}
