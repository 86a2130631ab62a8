// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkOutOfCoreVolumeRepresentation.h"

#include "OpacityExchange.h"
#include "ProcessShare.h"
#include "vtkAlgorithmOutput.h"
#include "vtkBrickSource.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkOutOfCoreTransferFunction.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkOutlineSource.h"
#include "vtkPVRenderView.h"
#include "vtkPointData.h"
#include "vtkPolyDataMapper.h"
#include "vtkRenderWindow.h"
#include "vtkSmartPointer.h"
#include "vtkTrivialProducer.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace
{
constexpr double Mebibyte = 1024.0 * 1024.0;
constexpr double LongestPass = 8; // seconds

vtkTypeUInt64 BytesOf(double mebibytes)
{
  return mebibytes > 0 ? static_cast<vtkTypeUInt64>(mebibytes * Mebibyte) : 0;
}

double MebibytesOf(vtkTypeUInt64 bytes)
{
  return static_cast<double>(bytes) / Mebibyte;
}

int Count(double n)
{
  return static_cast<int>(std::min<double>(n, VTK_INT_MAX));
}

// The view keeps these for itself and its subclasses.
class ViewAccess : public vtkPVView
{
public:
  static bool TakesScreenshot(vtkPVView* view)
  {
    return (view->*(&ViewAccess::GetInCaptureScreenshot))();
  }
  static vtkPVSession* Session(vtkPVView* view) { return (view->*(&ViewAccess::GetSession))(); }
};

// What a process has of the data.
struct Part
{
  vtkSmartPointer<vtkImageData> Image;        // of the input, its arrays the very same
  vtkSmartPointer<vtkImageData> Ordinary;     // as vtkImageVolumeRepresentation would draw it
  double Bounds[6] = { 1, -1, 1, -1, 1, -1 }; // of the image, as ParaView's crop box has it
};

// Whether an array to colour by is chosen: not with ParaView's Solid Color.
bool IsChosen(vtkInformation* array)
{
  const char* name = array->Get(vtkDataObject::FIELD_NAME());
  return name && *name;
}

// Whether a picture can be blended of those of blocks: not those of modes that look for extremes or
// sum up, nor where volumes are drawn one over the other.
bool IsBlendable(vtkPVView* view, int mode)
{
  int volumes = 0;
  for (int i = 0; view && i < view->GetNumberOfRepresentations(); ++i)
  {
    auto* volume = vtkVolumeRepresentation::SafeDownCast(view->GetRepresentation(i));
    volumes += volume && volume->GetVisibility() ? 1 : 0;
  }
  return volumes <= 1 &&
    (mode == vtkVolumeMapper::COMPOSITE_BLEND || mode == vtkVolumeMapper::ISOSURFACE_BLEND ||
      mode == vtkVolumeMapper::SLICE_BLEND);
}
} // namespace

class vtkOutOfCoreVolumeRepresentation::vtkInternals
{
public:
  const Part* FindPart(double key) const
  {
    const auto found = this->Parts.find(key);
    return found != this->Parts.end() ? &found->second : nullptr;
  }

  vtkDoubleArray* OfProcesses(vtkDoubleArray* array, double ProcessFacts::*fact) const
  {
    array->Initialize();
    for (const ProcessFacts& facts : this->Share.Facts())
    {
      array->InsertNextValue(facts.*fact);
    }
    return array;
  }

  std::map<double, Part> Parts; // by the key under which the view keeps frames of animations
  ProcessShare Share;
  OpacityExchange Exchange;
  bool Updated = false; // RequestData() has run in this update
  vtkNew<vtkDoubleArray> ReadOfProcesses;
  vtkNew<vtkDoubleArray> NeededOfProcesses;
  vtkSmartPointer<vtkTrivialProducer> Producer = vtkSmartPointer<vtkTrivialProducer>::New();
  vtkIdType InputVoxels = 0;
  bool WarnedOfOpacityArray = false;
  vtkNew<vtkVolumeProperty> Functions; // of an array that nobody chose
  vtkSmartPointer<vtkBrickSource> FunctionsOf;
  int Pass = 0;           // of refinement, since something else was rendered
  bool PassComes = false; // the next render is one
};

vtkStandardNewMacro(vtkOutOfCoreVolumeRepresentation);

vtkOutOfCoreVolumeRepresentation::vtkOutOfCoreVolumeRepresentation()
  : Internals(std::make_unique<vtkInternals>())
{
  this->VolumeMapper = vtkSmartPointer<vtkOutOfCoreVolumeMapper>::New();
}

vtkOutOfCoreVolumeRepresentation::~vtkOutOfCoreVolumeRepresentation() = default;

vtkOutOfCoreVolumeMapper* vtkOutOfCoreVolumeRepresentation::GetMapper()
{
  return static_cast<vtkOutOfCoreVolumeMapper*>(this->VolumeMapper.GetPointer());
}

vtkDataArray* vtkOutOfCoreVolumeRepresentation::FindArray(vtkImageData* image)
{
  if (!image || IsChosen(this->GetInputArrayInformation(0)))
  {
    return image ? this->GetInputArrayToProcess(0, image) : nullptr;
  }
  for (vtkFieldData* data : { static_cast<vtkFieldData*>(image->GetPointData()),
         static_cast<vtkFieldData*>(image->GetCellData()) })
  {
    for (int i = 0; i < data->GetNumberOfArrays(); ++i)
    {
      vtkDataArray* array = data->GetArray(i);
      vtkBrickSource* source = array ? vtkBrickSource::Get(array) : nullptr;
      if (source && source->GetBrickSource())
      {
        return array;
      }
    }
  }
  return nullptr;
}

vtkBrickSource* vtkOutOfCoreVolumeRepresentation::FindSource(vtkImageData* image)
{
  vtkDataArray* array = this->FindArray(image);
  vtkBrickSource* source = array ? vtkBrickSource::Get(array) : nullptr;
  return source && source->GetBrickSource() ? source : nullptr;
}

int vtkOutOfCoreVolumeRepresentation::RequestData(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkInternals& in = *this->Internals;
  in.Updated = true;
  auto* view = vtkPVView::SafeDownCast(this->GetView());
  if (!(view && view->GetUseCache()) && !this->GetForceUseCache())
  {
    in.Parts.clear();
  }
  vtkImageData* image = inputVector[0]->GetNumberOfInformationObjects() == 1
    ? vtkImageData::GetData(inputVector[0], 0)
    : nullptr;
  if (!image && inputVector[0]->GetNumberOfInformationObjects() == 1)
  {
    vtkErrorMacro("Only images are drawn out of core, not "
      << vtkDataObject::GetData(inputVector[0], 0)->GetClassName()
      << ". Choose another representation, or resample to an image.");
    return 0;
  }
  // Bounds, outline and the part of an ordinary image, without its ghost cells.
  if (!this->Superclass::RequestData(request, inputVector, outputVector))
  {
    return 0;
  }
  in.InputVoxels = image ? image->GetNumberOfPoints() : 0;
  if (!image)
  {
    in.Parts.erase(this->GetCacheKey());
    return 1;
  }
  Part part;
  part.Image.TakeReference(image->NewInstance());
  part.Image->ShallowCopy(image);
  part.Ordinary = vtkImageData::SafeDownCast(this->Cache);
  std::copy_n(part.Ordinary->GetBounds(), 6, part.Bounds);
  if (this->FindSource(part.Image))
  {
    // Of this process it may be a piece; the crop box is that of all.
    vtkNew<vtkImageData> whole;
    whole->CopyStructure(image);
    whole->SetExtent(this->WholeExtent);
    whole->GetBounds(part.Bounds);
    this->HandOver(part.Image);
    this->UpdateMapperParameters();
    this->VolumeMapper->GetBounds(this->DataBounds);
    this->OutlineSource->SetBounds(this->DataBounds);
    this->OutlineSource->Update();
  }
  in.Parts[this->GetCacheKey()] = part;
  // What is delivered isn't drawn.
  vtkNew<vtkImageData> nothing;
  this->Cache = nothing.GetPointer();
  return 1;
}

void vtkOutOfCoreVolumeRepresentation::HandOver(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  vtkBrickSource* source = this->FindSource(image);
  if (in.Producer->GetOutputDataObject(0) != image)
  {
    in.Producer->SetOutput(image);
  }
  vtkAlgorithmOutput* port = image ? in.Producer->GetOutputPort() : nullptr;
  if (this->VolumeMapper->GetNumberOfInputConnections(0) != (port ? 1 : 0) ||
    this->VolumeMapper->GetInputConnection(0, 0) != port)
  {
    this->VolumeMapper->SetInputConnection(port);
  }
  this->GetMapper()->SetBrickSource(source && source->IsInPlace(image) ? source : nullptr);
}

int vtkOutOfCoreVolumeRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  if (request == vtkPVView::REQUEST_UPDATE())
  {
    this->Internals->Updated = false;
    if (!this->Superclass::ProcessViewRequest(request, inInfo, outInfo))
    {
      return 0;
    }
    vtkPVRenderView::SetStreamable(inInfo, this, vtkPVView::GetEnableStreaming());
    if (this->ChooseShare() && !this->Internals->Updated)
    {
      // The view looks at bounds only where it gets something new.
      this->MarkModified();
      this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
    }
    // By these the view resets its camera and sorts processes.
    const ProcessShare& share = this->Internals->Share;
    double bounds[6] = { 1, -1, 1, -1, 1, -1 };
    if (share.GetPart() == ProcessShare::Part::Block)
    {
      std::copy_n(share.Bounds(), 6, bounds);
    }
    else if (share.GetPart() == ProcessShare::Part::All)
    {
      ProcessShare::InWorld(this->DataBounds, this->Actor).GetBounds(bounds);
    }
    vtkPVRenderView::SetGeometryBounds(inInfo, this, bounds);
    return 1;
  }
  if (request == vtkPVRenderView::REQUEST_STREAMING_UPDATE())
  {
    // Any piece makes the view render again; the bricks come by themselves.
    if (vtkPVView::GetEnableStreaming() && this->Actor->GetVisibility() &&
      !this->GetMapper()->IsConverged() && this->FactsHere().FailedBricks == 0 &&
      this->VolumeMapper->GetNumberOfInputConnections(0) > 0)
    {
      vtkNew<vtkImageData> nothing;
      vtkPVRenderView::SetNextStreamedPiece(inInfo, this, nothing);
      this->Internals->PassComes = true;
    }
    return 1;
  }
  if (request != vtkPVView::REQUEST_RENDER())
  {
    return this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
  }
  // Without vtkImageVolumeRepresentation, whose mapper draws what was delivered.
  if (!this->vtkVolumeRepresentation::ProcessViewRequest(request, inInfo, outInfo))
  {
    return 0;
  }
  vtkImageData* image = nullptr;
  if (const Part* part = this->Internals->FindPart(this->GetCacheKey()))
  {
    image = this->FindSource(part->Image) ? part->Image : part->Ordinary;
  }
  this->HandOver(image);
  this->UpdateMapperParameters();
  this->OutlineMapper->SetInputConnection(vtkPVRenderView::GetPieceProducer(inInfo, this, 1));
  this->ChooseFrameTime(inInfo);
  this->LearnOfOthers(inInfo);
  return 1;
}

bool vtkOutOfCoreVolumeRepresentation::ChooseShare()
{
  vtkInternals& in = *this->Internals;
  const Part* part = in.FindPart(this->GetCacheKey());
  vtkImageData* image = part ? part->Image.GetPointer() : nullptr;
  auto* view = vtkPVView::SafeDownCast(this->GetView());
  return in.Share.Choose(this->FindSource(image), image, this->Actor,
    IsBlendable(view, this->VolumeMapper->GetBlendMode()), this->GetMapper(), this->FactsHere(),
    view ? ViewAccess::Session(view) : nullptr);
}

void vtkOutOfCoreVolumeRepresentation::ChooseFrameTime(vtkInformation* inInfo)
{
  vtkInternals& in = *this->Internals;
  auto* view = vtkPVView::SafeDownCast(inInfo->Get(vtkPVView::VIEW()));
  in.Pass = in.PassComes ? in.Pass + 1 : 0;
  in.PassComes = false;
  double time = 0; // until the picture is complete
  if (view && view->GetRenderWindow() && !ViewAccess::TakesScreenshot(view))
  {
    // Windows are off-screen even where a user interacts. The view tells by the rate it wishes.
    if (view->GetRenderWindow()->GetDesiredUpdateRate() >= 1)
    {
      time = this->InteractiveFrameTime;
    }
    else if (vtkPVView::GetEnableStreaming() &&
      (in.Pass == 0 || this->GetMapper()->GetNumberOfMissingBricks() > 0))
    {
      // Longer and longer: where the bricks don't fit the budgets all at once, only a frame without
      // a limit ends.
      time = std::ldexp(this->InteractiveFrameTime, std::min(in.Pass, 30));
      time = time < LongestPass ? time : 0;
    }
  }
  this->GetMapper()->SetFrameTimeBudget(time);
}

void vtkOutOfCoreVolumeRepresentation::LearnOfOthers(vtkInformation* inInfo)
{
  vtkInternals& in = *this->Internals;
  auto* view = vtkPVRenderView::SafeDownCast(inInfo->Get(vtkPVView::VIEW()));
  const bool willing = this->ExchangeOpacities && view && !view->InTileDisplayMode() &&
    !view->InCaveDisplayMode() && this->GetMapper()->GetFrameTimeBudget() == 0;
  in.Exchange.Before(view, in.Share, this->Actor, this->GetMapper(), willing);
}

void vtkOutOfCoreVolumeRepresentation::UpdateMapperParameters()
{
  this->Superclass::UpdateMapperParameters();
  vtkInternals& in = *this->Internals;
  vtkOutOfCoreVolumeMapper* mapper = this->GetMapper();
  const Part* part = in.FindPart(this->GetCacheKey());
  mapper->SetBlock(in.Share.GetPart() == ProcessShare::Part::Block);
  mapper->SetRecordBricks(mapper->GetBlock());
  mapper->SetBlockExtent(in.Share.Extent());
  if (in.Share.GetPart() == ProcessShare::Part::Nothing)
  {
    this->Actor->SetVisibility(0); // another process draws
    return;
  }
  if (part && !IsChosen(this->GetInputArrayInformation(0)) && this->FindSource(part->Image))
  {
    this->ColorAutomatically(part->Image);
  }
  else
  {
    this->ColorAsChosen();
  }
  // The box of ParaView's widget is that of the image, whose outermost voxels are larger than those
  // of level 0: where it wasn't moved, it cuts nothing.
  if (part && mapper->GetCropping())
  {
    double planes[6];
    for (int i = 0; i < 6; ++i)
    {
      planes[i] = this->CroppingOrigin[i / 2] + part->Bounds[i] * this->CroppingScale[i / 2];
      planes[i] = planes[i] == part->Bounds[i] ? this->DataBounds[i] : planes[i];
    }
    mapper->SetCroppingRegionPlanes(planes);
  }
}

void vtkOutOfCoreVolumeRepresentation::ColorAsChosen()
{
  vtkInternals& in = *this->Internals;
  vtkOutOfCoreVolumeMapper* mapper = this->GetMapper();
  this->Actor->SetProperty(this->Property);
  if (this->UseSeparateOpacityArray && mapper->GetBrickSource())
  {
    if (!in.WarnedOfOpacityArray)
    {
      in.WarnedOfOpacityArray = true;
      vtkWarningMacro("Use Separate Opacity Array is ignored: a pyramid is drawn of one array.");
    }
    vtkInformation* array = this->GetInputArrayInformation(0);
    mapper->SelectScalarArray(array->Get(vtkDataObject::FIELD_NAME()));
    this->Property->SetIndependentComponents(this->MapScalars && !this->MultiComponentsMapping);
  }
  // Of vectors, as for vtkSmartVolumeMapper: a scalar where components are independent.
  vtkColorTransferFunction* colors = this->Property->GetRGBTransferFunction(0);
  mapper->SetVectorMode(this->Property->GetIndependentComponents() && !this->UseTransfer2D
      ? colors->GetVectorMode()
      : vtkOutOfCoreVolumeMapper::DISABLED);
  mapper->SetVectorComponent(std::clamp(colors->GetVectorComponent(), 0, 3));
}

void vtkOutOfCoreVolumeRepresentation::ColorAutomatically(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  vtkBrickSource* source = this->FindSource(image);
  if (in.FunctionsOf != source)
  {
    vtkOutOfCoreTransferFunction::MakeAutomatic(source, in.Functions);
    in.FunctionsOf = source;
  }
  in.Functions->SetShade(this->Property->GetShade());
  in.Functions->SetInterpolationType(this->Property->GetInterpolationType());
  this->Actor->SetProperty(in.Functions);
  this->Actor->SetVisibility(1); // without a name ParaView shows none
  vtkDataArray* array = this->FindArray(image);
  const bool ofPoints = image->GetPointData()->HasArray(array->GetName()) != 0;
  this->VolumeMapper->SetScalarMode(
    ofPoints ? VTK_SCALAR_MODE_USE_POINT_FIELD_DATA : VTK_SCALAR_MODE_USE_CELL_FIELD_DATA);
  this->VolumeMapper->SelectScalarArray(array->GetName());
  this->GetMapper()->SetVectorMode(vtkOutOfCoreVolumeMapper::DISABLED);
}

void vtkOutOfCoreVolumeRepresentation::SetGPUMemoryBudget(double mebibytes)
{
  this->GetMapper()->SetGPUMemoryBudget(BytesOf(mebibytes));
}

void vtkOutOfCoreVolumeRepresentation::SetHostMemoryBudget(double mebibytes)
{
  this->GetMapper()->SetHostMemoryBudget(BytesOf(mebibytes));
}

void vtkOutOfCoreVolumeRepresentation::SetImageErrorTolerance(double tolerance)
{
  this->GetMapper()->SetImageErrorTolerance(tolerance);
}

void vtkOutOfCoreVolumeRepresentation::SetLevelOfDetailBias(double bias)
{
  this->GetMapper()->SetLevelOfDetailBias(bias);
}

void vtkOutOfCoreVolumeRepresentation::SetMinimumLevel(int level)
{
  this->GetMapper()->SetMinimumLevel(level);
}

void vtkOutOfCoreVolumeRepresentation::SetMaximumLevel(int level)
{
  this->GetMapper()->SetMaximumLevel(level);
}

void vtkOutOfCoreVolumeRepresentation::SetMarcher(int marcher)
{
  this->GetMapper()->SetMarcher(marcher);
}

void vtkOutOfCoreVolumeRepresentation::SetConvergeTimeout(double seconds)
{
  this->GetMapper()->SetConvergeTimeout(seconds);
}

void vtkOutOfCoreVolumeRepresentation::SetDebugView(int view)
{
  this->GetMapper()->SetDebugView(view);
}

void vtkOutOfCoreVolumeRepresentation::SetGlobalIlluminationReach(float reach)
{
  this->GetMapper()->SetGlobalIlluminationReach(reach);
}

void vtkOutOfCoreVolumeRepresentation::SetVolumetricScatteringBlending(float blending)
{
  this->GetMapper()->SetVolumetricScatteringBlending(blending);
}

ProcessFacts vtkOutOfCoreVolumeRepresentation::FactsHere()
{
  const vtkInternals& in = *this->Internals;
  vtkOutOfCoreVolumeMapper* mapper = this->GetMapper();
  ProcessFacts facts;
  facts.InputVoxels = static_cast<double>(in.InputVoxels);
  auto* image = vtkImageData::SafeDownCast(in.Producer->GetOutputDataObject(0));
  facts.DrawsPyramid = this->FindSource(image) ? 1 : 0;
  const bool draws = in.Share.GetPart() != ProcessShare::Part::Nothing;
  facts.Converged = mapper->IsConverged() || !draws ? 1 : 0;
  facts.MissingBricks = static_cast<double>(mapper->GetNumberOfMissingBricks());
  facts.FailedBricks =
    static_cast<double>(mapper->GetNumberOfFailedBricks() + mapper->GetNumberOfFailedPageBlocks());
  facts.BricksLoaded = static_cast<double>(mapper->GetNumberOfBricksLoaded());
  facts.Read = MebibytesOf(mapper->GetBytesRead());
  facts.GPUMemory = MebibytesOf(mapper->GetGPUMemoryUsed());
  facts.HostMemory = MebibytesOf(mapper->GetHostMemoryUsed());
  facts.Needed = in.Share.NeedOf(mapper);
  facts.LeftOut = in.Exchange.LeavesOut() ? 1 : 0;
  return facts;
}

ProcessFacts vtkOutOfCoreVolumeRepresentation::Facts()
{
  const auto together = this->Internals->Share.FactsTogether();
  return together ? *together : this->FactsHere();
}

int vtkOutOfCoreVolumeRepresentation::GetConverged()
{
  return this->Facts().Converged > 0 ? 1 : 0;
}

int vtkOutOfCoreVolumeRepresentation::GetMissingBricks()
{
  return Count(this->Facts().MissingBricks);
}

int vtkOutOfCoreVolumeRepresentation::GetFailedBricks()
{
  return Count(this->Facts().FailedBricks);
}

double vtkOutOfCoreVolumeRepresentation::GetMebibytesRead()
{
  return this->Facts().Read;
}

int vtkOutOfCoreVolumeRepresentation::GetBricksLoaded()
{
  return Count(this->Facts().BricksLoaded);
}

double vtkOutOfCoreVolumeRepresentation::GetGPUMebibytesUsed()
{
  return this->Facts().GPUMemory;
}

double vtkOutOfCoreVolumeRepresentation::GetHostMebibytesUsed()
{
  return this->Facts().HostMemory;
}

vtkIdType vtkOutOfCoreVolumeRepresentation::GetNumberOfInputVoxels()
{
  return static_cast<vtkIdType>(this->Facts().InputVoxels);
}

int vtkOutOfCoreVolumeRepresentation::GetDrawsPyramid()
{
  return this->Facts().DrawsPyramid > 0 ? 1 : 0;
}

int vtkOutOfCoreVolumeRepresentation::GetDrawsBlock()
{
  return this->Internals->Share.IsDivided() ? 1 : 0;
}

vtkDoubleArray* vtkOutOfCoreVolumeRepresentation::GetMebibytesReadOfProcesses()
{
  return this->Internals->OfProcesses(this->Internals->ReadOfProcesses, &ProcessFacts::Read);
}

vtkDoubleArray* vtkOutOfCoreVolumeRepresentation::GetMebibytesNeededOfProcesses()
{
  return this->Internals->OfProcesses(this->Internals->NeededOfProcesses, &ProcessFacts::Needed);
}

void vtkOutOfCoreVolumeRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "InteractiveFrameTime: " << this->InteractiveFrameTime << "\n";
  os << indent << "ExchangeOpacities: " << this->ExchangeOpacities << "\n";
  os << indent << "VolumeMapper:\n";
  this->VolumeMapper->PrintSelf(os, indent.GetNextIndent());
}
