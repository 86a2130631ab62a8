// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkOutOfCoreVolumeMapper.h"

#include "ArrayBrickSource.h"
#include "RefinementBoard.h"
#include "SliceDepths.h"
#include "VTKScalarType.h"
#include "VolumeEngine.h"
#include "vtkBrickSource.h"
#include "vtkCamera.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkCommand.h"
#include "vtkContourValues.h"
#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkImplicitFunction.h"
#include "vtkInformation.h"
#include "vtkLight.h"
#include "vtkLightCollection.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPlane.h"
#include "vtkPlaneCollection.h"
#include "vtkPointData.h"
#include "vtkPropCollection.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkTrivialProducer.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"
#include "vtkWeakPointer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <thread>

#if defined(__unix__)
#include <unistd.h>
#endif

using teravox::Double3;
using teravox::Int3;
using teravox::Matrix4;

namespace
{
// Of NVIDIA's and AMD's memory extensions; kibibytes of dedicated memory.
constexpr GLenum DedicatedVideoMemory = 0x9047;
constexpr GLenum TextureFreeMemory = 0x87FC;
constexpr vtkTypeInt64 DefaultMaxMemoryInBytes = vtkTypeInt64{ 128 } << 20;

std::uint64_t MainMemory()
{
#if defined(__unix__)
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long size = sysconf(_SC_PAGE_SIZE);
  if (pages > 0 && size > 0)
  {
    return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size);
  }
#endif
  return std::uint64_t{ 4 } << 30;
}

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Matrix4 ToMatrix(vtkMatrix4x4* m)
{
  Matrix4 result{};
  std::copy_n(m->GetData(), 16, result.begin());
  return result;
}

// From voxel indices (centres at whole numbers) to the image's space.
Matrix4 IndexToDataset(const Double3& origin, const Double3& spacing, const double* direction)
{
  Matrix4 m{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    for (std::size_t j = 0; j < 3; ++j)
    {
      m[4 * i + j] = direction[3 * i + j] * spacing[j];
    }
    m[4 * i + 3] = origin[i];
  }
  m[15] = 1;
  return m;
}

Matrix4 ScaleAndShift(const Double3& scale, const Double3& shift)
{
  return { scale[0], 0, 0, shift[0], 0, scale[1], 0, shift[1], 0, 0, scale[2], shift[2], 0, 0, 0,
    1 };
}

teravox::TransferFunction MakeTransferFunction(vtkVolumeProperty* property)
{
  // Copies: the function is sampled later, and must be what it is now.
  auto opacity = vtkSmartPointer<vtkPiecewiseFunction>::New();
  opacity->DeepCopy(property->GetScalarOpacity());
  teravox::TransferFunction function;
  function.UnitDistance = property->GetScalarOpacityUnitDistance();
  function.Opacity = [opacity](double v) { return opacity->GetValue(v); };
  function.IsConstantBeyond = opacity->GetClamping() != 0;
  for (int i = 0; i < opacity->GetSize(); ++i)
  {
    double node[4];
    opacity->GetNodeValue(i, node);
    function.Knots.push_back(node[0]);
    if (i + 1 < opacity->GetSize())
    {
      double next[4];
      opacity->GetNodeValue(i + 1, next);
      function.Knots.push_back(node[0] + node[2] * (next[0] - node[0]));
    }
  }
  if (property->GetColorChannels() == 3)
  {
    auto color = vtkSmartPointer<vtkColorTransferFunction>::New();
    color->DeepCopy(property->GetRGBTransferFunction());
    function.IsConstantBeyond = function.IsConstantBeyond && color->GetClamping() != 0;
    function.Color = [color](double v, double* rgb) { color->GetColor(v, rgb); };
    for (int i = 0; i < color->GetSize(); ++i)
    {
      double node[6];
      color->GetNodeValue(i, node);
      function.Knots.push_back(node[0]);
      if (i + 1 < color->GetSize())
      {
        double next[6];
        color->GetNodeValue(i + 1, next);
        function.Knots.push_back(node[0] + node[4] * (next[0] - node[0]));
      }
    }
  }
  else
  {
    auto gray = vtkSmartPointer<vtkPiecewiseFunction>::New();
    gray->DeepCopy(property->GetGrayTransferFunction());
    function.IsConstantBeyond = function.IsConstantBeyond && gray->GetClamping() != 0;
    function.Color = [gray](double v, double* rgb)
    { rgb[0] = rgb[1] = rgb[2] = gray->GetValue(v); };
    for (int i = 0; i < gray->GetSize(); ++i)
    {
      double node[4];
      gray->GetNodeValue(i, node);
      function.Knots.push_back(node[0]);
    }
  }
  std::sort(function.Knots.begin(), function.Knots.end());
  function.Knots.erase(
    std::unique(function.Knots.begin(), function.Knots.end()), function.Knots.end());
  return function;
}
} // namespace

class vtkOutOfCoreVolumeMapper::vtkInternals
{
public:
  teravox::VolumeEngine Engine;
  teravox::SliceDepths Slice;
  vtkSmartPointer<vtkBrickSource> Explicit;
  vtkSmartPointer<vtkTrivialProducer> StandIn; // input for volumes that come from SetBrickSource()
  bool UsesStandIn = false;

  // The source made from an ordinary array, and of what.
  std::shared_ptr<teravox::BrickSource> OfArray;
  vtkSmartPointer<vtkDataArray> Array;
  vtkMTimeType ArrayTime = 0;
  int ArrayBrickSize = 0;
  Int3 ArrayExtentStart{};
  Int3 ArrayDimensions{};
  bool ArrayIsCellData = false;

  vtkWeakPointer<vtkRenderWindow> Window;
  vtkMTimeType FunctionTime = 0;
  vtkVolumeProperty* FunctionOf = nullptr;
  std::shared_ptr<teravox::BrickSource> FunctionFor;
  double FunctionLength = 0; // ShortestLength that it was sampled for
  std::uint64_t FunctionVersion = 0;
  std::set<std::string> Warned;
  std::string LastError;
  std::set<std::string> ReportedFailures;
  bool WasConverged = false;
  double SourceTime = 0;
  double FirstPicture = 0;
  double ConvergedAfter = 0;
  std::shared_ptr<teravox::BrickSource> Timed;
  const void* LastView = nullptr;
};

vtkStandardNewMacro(vtkOutOfCoreVolumeMapper);

vtkOutOfCoreVolumeMapper::vtkOutOfCoreVolumeMapper()
  : Internals(std::make_unique<vtkInternals>())
{
  this->NumberOfLoaderThreads =
    static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 8u));
}

vtkOutOfCoreVolumeMapper::~vtkOutOfCoreVolumeMapper()
{
  if (this->Internals->Window)
  {
    this->vtkOutOfCoreVolumeMapper::ReleaseGraphicsResources(this->Internals->Window);
  }
}

void vtkOutOfCoreVolumeMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "GPUMemoryBudget: " << this->GPUMemoryBudget << "\n"
     << indent << "HostMemoryBudget: " << this->HostMemoryBudget << "\n"
     << indent << "FrameTimeBudget: " << this->FrameTimeBudget << "\n"
     << indent << "ImageErrorTolerance: " << this->ImageErrorTolerance << "\n"
     << indent << "LevelOfDetailBias: " << this->LevelOfDetailBias << "\n"
     << indent << "MinimumLevel: " << this->MinimumLevel << "\n"
     << indent << "MaximumLevel: " << this->MaximumLevel << "\n"
     << indent << "EmptySpaceSkipping: " << this->EmptySpaceSkipping << "\n"
     << indent << "PictureReuse: " << this->PictureReuse << "\n"
     << indent << "NumberOfLoaderThreads: " << this->NumberOfLoaderThreads << "\n"
     << indent << "BrickSize: " << this->BrickSize << "\n"
     << indent << "MaximumNumberOfSlots: " << this->MaximumNumberOfSlots << "\n"
     << indent << "Marcher: " << this->Marcher << "\n"
     << indent << "ArrivalShuffleSeed: " << this->ArrivalShuffleSeed << "\n"
     << indent << "ConvergeTimeout: " << this->ConvergeTimeout << "\n"
     << indent << "CountSamples: " << this->CountSamples << "\n"
     << indent << "ShowLevels: " << this->ShowLevels << "\n"
     << indent << "ErrorEstimate: " << this->ErrorEstimate << "\n"
     << indent << "WarnOfSampling: " << this->WarnOfSampling << "\n"
     << indent << "BrickSource: " << this->Internals->Explicit << "\n"
     << indent << "Converged: " << (this->IsConverged() ? "yes" : "no") << "\n";
}

void vtkOutOfCoreVolumeMapper::SetBrickSource(vtkBrickSource* source)
{
  vtkInternals& in = *this->Internals;
  if (in.Explicit == source)
  {
    return;
  }
  in.Explicit = source;
  if (in.UsesStandIn)
  {
    this->SetInputConnection(nullptr);
    in.StandIn = nullptr;
    in.UsesStandIn = false;
  }
  if (source && source->GetBrickSource() && this->GetNumberOfInputConnections(0) == 0)
  {
    // Two points per axis with the bounds of the volume and the ends of its range.
    const teravox::VolumeInfo& info = source->GetBrickSource()->Info();
    vtkNew<vtkImageData> image;
    image->SetDimensions(2, 2, 2);
    double bounds[6];
    this->GetBounds(bounds);
    image->SetOrigin(bounds[0], bounds[2], bounds[4]);
    image->SetSpacing(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]);
    vtkNew<vtkFloatArray> scalars;
    scalars->SetName(info.ArrayName.c_str());
    scalars->SetNumberOfTuples(8);
    const bool known = info.Range.IsKnown() && !info.Range.IsVoid();
    scalars->FillValue(static_cast<float>(known ? info.Range.Min : 0));
    scalars->SetValue(7, static_cast<float>(known ? info.Range.Max : 1));
    image->GetPointData()->SetScalars(scalars);
    in.StandIn = vtkSmartPointer<vtkTrivialProducer>::New();
    in.StandIn->SetOutput(image);
    this->SetInputConnection(in.StandIn->GetOutputPort());
    in.UsesStandIn = true;
  }
  this->Modified();
}

vtkBrickSource* vtkOutOfCoreVolumeMapper::GetBrickSource()
{
  return this->Internals->Explicit;
}

namespace
{
// What the mapper draws: a source, and where its level 0 lies.
struct Drawn
{
  std::shared_ptr<teravox::BrickSource> Source;
  Matrix4 DatasetFromVoxel{}; // corner coordinates of level 0
  bool CellData = false;
};

Drawn PlaceBySource(const std::shared_ptr<teravox::BrickSource>& source)
{
  const teravox::VolumeInfo& info = source->Info();
  const Matrix4 place = IndexToDataset(info.Origin, info.Spacing, info.Direction.data());
  return { source,
    teravox::MultiplyMatrices(place, ScaleAndShift({ 1, 1, 1 }, { -0.5, -0.5, -0.5 })),
    info.CellData };
}

Matrix4 ImageToDataset(vtkImageData* image)
{
  const double* origin = image->GetOrigin();
  const double* spacing = image->GetSpacing();
  return IndexToDataset({ origin[0], origin[1], origin[2] }, { spacing[0], spacing[1], spacing[2] },
    image->GetDirectionMatrix()->GetData());
}

// The image shows one level, or a part of it; its index space is that level's.
Drawn PlaceByImage(vtkImageData* image, vtkBrickSource* holder)
{
  const std::shared_ptr<teravox::BrickSource>& source = holder->GetBrickSource();
  const teravox::VolumeInfo& info = source->Info();
  long long first[3];
  holder->GetPresentedFirstVoxel(first);
  const Int3& factor = info.Layout.Factor(holder->GetPresentedLevel());
  const int* extent = image->GetExtent();
  // Index of VTK of a point p in corner coordinates of level 0: centres of the presented level lie
  // at whole indices for point data, cells between them for cell data.
  const double half = info.CellData ? 0.0 : 0.5;
  Double3 scale{};
  Double3 shift{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    scale[a] = 1.0 / static_cast<double>(factor[a]);
    shift[a] = extent[2 * a] - static_cast<double>(first[a]) - half;
  }
  return { source, teravox::MultiplyMatrices(ImageToDataset(image), ScaleAndShift(scale, shift)),
    info.CellData };
}
} // namespace

// Finds what is to be drawn; an empty source and a message if there is nothing.
static Drawn FindDrawn(vtkBrickSource* explicitSource, vtkImageData* image, vtkDataArray* scalars,
  int cellFlag, const std::function<std::shared_ptr<teravox::BrickSource>(std::string&)>& ofArray,
  std::string& error)
{
  if (explicitSource)
  {
    if (!explicitSource->GetBrickSource())
    {
      error = "The vtkBrickSource given to the mapper holds no source.";
      return {};
    }
    return PlaceBySource(explicitSource->GetBrickSource());
  }
  if (!image || !scalars)
  {
    error = image ? "The input has no scalars that the mapper is told to draw."
                  : "There is no image to draw.";
    return {};
  }
  vtkBrickSource* holder = vtkBrickSource::Get(scalars);
  if (holder && holder->GetBrickSource())
  {
    return PlaceByImage(image, holder);
  }
  Drawn drawn;
  drawn.Source = ofArray(error);
  drawn.CellData = cellFlag != 0;
  const int* extent = image->GetExtent();
  const double half = drawn.CellData ? 0.0 : 0.5;
  drawn.DatasetFromVoxel = teravox::MultiplyMatrices(ImageToDataset(image),
    ScaleAndShift({ 1, 1, 1 }, { extent[0] - half, extent[2] - half, extent[4] - half }));
  return drawn;
}

double* vtkOutOfCoreVolumeMapper::GetBounds()
{
  vtkInternals& in = *this->Internals;
  std::string error;
  vtkImageData* image = nullptr;
  vtkDataArray* scalars = nullptr;
  int cellFlag = 0;
  if (!in.Explicit)
  {
    if (this->GetNumberOfInputConnections(0) == 0)
    {
      vtkMath::UninitializeBounds(this->Bounds);
      return this->Bounds;
    }
    this->Update();
    image = vtkImageData::SafeDownCast(this->GetInputDataObject(0, 0));
    scalars = image ? vtkAbstractMapper::GetScalars(image, this->ScalarMode, this->ArrayAccessMode,
                        this->ArrayId, this->ArrayName, cellFlag)
                    : nullptr;
    vtkBrickSource* holder = scalars ? vtkBrickSource::Get(scalars) : nullptr;
    if (!holder || !holder->GetBrickSource())
    {
      return this->Superclass::GetBounds();
    }
  }
  const Drawn drawn = FindDrawn(
    in.Explicit, image, scalars, cellFlag, [](std::string&) { return nullptr; }, error);
  if (!drawn.Source)
  {
    vtkMath::UninitializeBounds(this->Bounds);
    return this->Bounds;
  }
  const Int3& n = drawn.Source->Info().Layout.Dimensions(0);
  const double inset = drawn.CellData ? 0.0 : 0.5;
  for (std::size_t a = 0; a < 3; ++a)
  {
    this->Bounds[2 * a] = VTK_DOUBLE_MAX;
    this->Bounds[2 * a + 1] = VTK_DOUBLE_MIN;
  }
  for (int corner = 0; corner < 8; ++corner)
  {
    Double3 p{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = (corner >> a & 1) != 0 ? static_cast<double>(n[a]) - inset : inset;
    }
    for (std::size_t i = 0; i < 3; ++i)
    {
      const double* row = &drawn.DatasetFromVoxel[4 * i];
      const double v = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
      this->Bounds[2 * i] = corner == 0 ? v : std::min(this->Bounds[2 * i], v);
      this->Bounds[2 * i + 1] = corner == 0 ? v : std::max(this->Bounds[2 * i + 1], v);
    }
  }
  return this->Bounds;
}

int vtkOutOfCoreVolumeMapper::IsRenderSupported(vtkRenderWindow* window, vtkVolumeProperty*)
{
  auto* gl = vtkOpenGLRenderWindow::SafeDownCast(window);
  if (!gl)
  {
    return 0;
  }
  gl->MakeCurrent();
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  return major > teravox::MinimumGLMajor ||
    (major == teravox::MinimumGLMajor && minor >= teravox::MinimumGLMinor);
}

void vtkOutOfCoreVolumeMapper::GetReductionRatio(double ratio[3])
{
  ratio[0] = ratio[1] = ratio[2] = 1;
}

void vtkOutOfCoreVolumeMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  vtkInternals& in = *this->Internals;
  auto* gl = vtkRenderWindow::SafeDownCast(window);
  if (gl && gl == in.Window)
  {
    gl->MakeCurrent();
    in.Engine.ReleaseGraphics();
    in.Window = nullptr;
  }
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetEffectiveGPUMemoryBudget()
{
  if (this->GPUMemoryBudget != 0)
  {
    return this->GPUMemoryBudget;
  }
  // VTK's own default of 128 MiB says nothing about the machine; what a user set does.
  if (this->MaxMemoryInBytes > 0 && this->MaxMemoryInBytes != DefaultMaxMemoryInBytes)
  {
    return static_cast<vtkTypeUInt64>(
      static_cast<double>(this->MaxMemoryInBytes) * static_cast<double>(this->MaxMemoryFraction));
  }
  constexpr vtkTypeUInt64 unknown = vtkTypeUInt64{ 1 } << 30;
  if (!this->Internals->Window)
  {
    return unknown;
  }
  this->Internals->Window->MakeCurrent();
  if (teravox::IsSoftwareRenderer())
  {
    return MainMemory() / 4;
  }
  GLint kibibytes[4] = { 0, 0, 0, 0 };
  while (glGetError() != GL_NO_ERROR)
  {
  }
  if (vtkOpenGLRenderWindow::SafeDownCast(this->Internals->Window) != nullptr)
  {
    glGetIntegerv(DedicatedVideoMemory, kibibytes);
    if (glGetError() != GL_NO_ERROR || kibibytes[0] <= 0)
    {
      glGetIntegerv(TextureFreeMemory, kibibytes);
      if (glGetError() != GL_NO_ERROR)
      {
        kibibytes[0] = 0;
      }
    }
  }
  return kibibytes[0] > 0 ? static_cast<vtkTypeUInt64>(kibibytes[0]) * 1024 / 4 * 3 : unknown;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetEffectiveHostMemoryBudget()
{
  return this->HostMemoryBudget != 0 ? this->HostMemoryBudget : MainMemory() / 4;
}

namespace
{
// Properties of VTK that this mapper doesn't do; each warns once, by name.
std::vector<std::string> FindUnsupported(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p)
{
  std::vector<std::string> names;
  const auto check = [&names](bool differs, const char* name)
  {
    if (differs)
    {
      names.emplace_back(name);
    }
  };
  // Those that a later VTK may add.
  check(m->GetBlendMode() < vtkVolumeMapper::COMPOSITE_BLEND ||
      m->GetBlendMode() > vtkVolumeMapper::SLICE_BLEND,
    "BlendMode");
  check(m->GetMaskInput() != nullptr, "MaskInput");
  check(m->GetMaskType() != vtkGPUVolumeRayCastMapper::LabelMapMaskType, "MaskType");
  check(m->GetMaskBlendFactor() != 1.0f, "MaskBlendFactor");
  check(m->GetUseJittering() != 0, "UseJittering");
  check(m->GetUseDepthPass() != 0, "UseDepthPass");
  check(m->GetRenderToImage() != 0, "RenderToImage");
  check(m->GetClampDepthToBackface() != 0, "ClampDepthToBackface");
  check(m->GetDepthImageScalarType() != VTK_FLOAT, "DepthImageScalarType");
  check(m->GetFinalColorWindow() != 1.0f, "FinalColorWindow");
  check(m->GetFinalColorLevel() != 0.5f, "FinalColorLevel");
  if (m->GetWarnOfSampling())
  {
    check(m->GetImageSampleDistance() != 1.0f, "ImageSampleDistance");
    check(m->GetMinimumImageSampleDistance() != 1.0f, "MinimumImageSampleDistance");
    check(m->GetMaximumImageSampleDistance() != 10.0f, "MaximumImageSampleDistance");
    check(m->GetAutoAdjustSampleDistances() != 1, "AutoAdjustSampleDistances");
    check(m->GetLockSampleDistanceToInputSpacing() != 0, "LockSampleDistanceToInputSpacing");
    check(m->GetSampleDistance() != 1.0f && m->GetImageErrorTolerance() > 0, "SampleDistance");
  }
  check(m->GetReportProgress() != true, "ReportProgress");
  check(m->GetColorRangeType() != vtkGPUVolumeRayCastMapper::SCALAR, "ColorRangeType");
  check(
    m->GetScalarOpacityRangeType() != vtkGPUVolumeRayCastMapper::SCALAR, "ScalarOpacityRangeType");
  check(m->GetGradientOpacityRangeType() != vtkGPUVolumeRayCastMapper::SCALAR,
    "GradientOpacityRangeType");
  check(m->GetTransfer2DYAxisArray() != nullptr, "Transfer2DYAxisArray");
  check(p->HasGradientOpacity(), "GradientOpacity");
  check(p->GetTransferFunctionMode() != vtkVolumeProperty::TF_1D, "TransferFunctionMode");
  check(p->GetIndependentComponents() != 1, "IndependentComponents");
  check(p->GetComponentWeight(0) != 1.0, "ComponentWeight");
  check(p->GetUseClippedVoxelIntensity() != 0, "UseClippedVoxelIntensity");
  check(p->GetNumberOfLabels() > 0, "LabelColor, LabelScalarOpacity, LabelGradientOpacity");
  check(m->GetBlendMode() == vtkVolumeMapper::ISOSURFACE_BLEND &&
      p->GetIsoSurfaceValues()->GetNumberOfContours() > static_cast<int>(teravox::MaximumIsoValues),
    "IsoSurfaceValues beyond the first 256 visible ones");
  return names;
}

// What VTK's blend mode is here, with the values that belong to it.
teravox::Projection MakeProjection(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p)
{
  teravox::Projection projection;
  switch (m->GetBlendMode())
  {
    case vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND:
      projection.Kind = teravox::BlendKind::Maximum;
      break;
    case vtkVolumeMapper::MINIMUM_INTENSITY_BLEND:
      projection.Kind = teravox::BlendKind::Minimum;
      break;
    case vtkVolumeMapper::AVERAGE_INTENSITY_BLEND:
    {
      double range[2];
      m->GetAverageIPScalarRange(range);
      projection.Kind = teravox::BlendKind::Average;
      projection.RangeLow = range[0];
      projection.RangeHigh = range[1];
      break;
    }
    case vtkVolumeMapper::ADDITIVE_BLEND:
      projection.Kind = teravox::BlendKind::Additive;
      break;
    case vtkVolumeMapper::ISOSURFACE_BLEND:
    {
      vtkContourValues* contours = p->GetIsoSurfaceValues();
      projection.Kind = teravox::BlendKind::Isosurface;
      projection.IsoValues.assign(
        contours->GetValues(), contours->GetValues() + contours->GetNumberOfContours());
      break;
    }
    case vtkVolumeMapper::SLICE_BLEND:
      projection.Kind = teravox::BlendKind::Slice;
      break;
    default:
      break;
  }
  return projection;
}

void SetCuts(vtkOutOfCoreVolumeMapper* mapper, teravox::ViewInput& view)
{
  if (vtkPlaneCollection* planes = mapper->GetClippingPlanes())
  {
    vtkCollectionSimpleIterator it = nullptr;
    planes->InitTraversal(it);
    while (vtkPlane* plane = planes->GetNextPlane(it))
    {
      const double* o = plane->GetOrigin();
      const double* n = plane->GetNormal();
      view.ClipPlanes.push_back({ { o[0], o[1], o[2] }, { n[0], n[1], n[2] } });
    }
  }
  view.Crop.On = mapper->GetCropping() != 0;
  view.Crop.Flags = static_cast<std::uint32_t>(mapper->GetCroppingRegionFlags());
  std::copy_n(mapper->GetCroppingRegionPlanes(), 6, view.Crop.Planes.begin());
}

teravox::LightInput ToLight(vtkLight* light)
{
  teravox::LightInput result;
  double position[3];
  double focus[3];
  light->GetTransformedPosition(position);
  light->GetTransformedFocalPoint(focus);
  for (std::size_t a = 0; a < 3; ++a)
  {
    result.Ambient[a] = light->GetAmbientColor()[a] * light->GetIntensity();
    result.Diffuse[a] = light->GetDiffuseColor()[a] * light->GetIntensity();
    result.Specular[a] = light->GetSpecularColor()[a] * light->GetIntensity();
    result.Position[a] = position[a];
    result.Direction[a] = focus[a] - position[a];
    result.Attenuation[a] = light->GetAttenuationValues()[a];
  }
  result.Positional = light->GetPositional() != 0;
  result.ConeAngle = light->GetConeAngle();
  result.Exponent = light->GetExponent();
  return result;
}

// One headlight of full intensity is a case of its own, as in VTK: there the ambient part of the
// material is that of the colour, else of the lights.
void SetMaterial(vtkRenderer* ren, vtkVolumeProperty* property, teravox::FrameRequest& request)
{
  request.Shade = property->GetShade() != 0;
  request.Material = { static_cast<float>(property->GetAmbient()),
    static_cast<float>(property->GetDiffuse()), static_cast<float>(property->GetSpecular()),
    static_cast<float>(property->GetSpecularPower()) };
  request.TwoSided = ren->GetTwoSidedLighting() != 0;
  request.LightDiffuse = { 0, 0, 0 };
  request.LightSpecular = { 0, 0, 0 };
  bool headlight = true;
  vtkCollectionSimpleIterator it = nullptr;
  ren->GetLights()->InitTraversal(it);
  while (vtkLight* light = ren->GetLights()->GetNextLight(it))
  {
    if (light->GetSwitch() == 0)
    {
      continue;
    }
    headlight = headlight && request.Lights.empty() && light->LightTypeIsHeadlight() != 0 &&
      light->GetPositional() == 0 && light->GetIntensity() == 1;
    if (headlight)
    {
      for (std::size_t c = 0; c < 3; ++c)
      {
        request.LightDiffuse[c] =
          static_cast<float>(light->GetDiffuseColor()[c] * light->GetIntensity());
        request.LightSpecular[c] =
          static_cast<float>(light->GetSpecularColor()[c] * light->GetIntensity());
      }
    }
    request.Lights.push_back(ToLight(light));
  }
  if (request.Lights.empty())
  {
    request.Material[0] = 0; // the ambient part is of a light, too
  }
  if (headlight)
  {
    request.Lights.clear();
  }
}

// Whether the depth buffer may hold anything when this volume is drawn. No only where that is
// certain: what else passes, other renderers and an application of its own draw isn't known here.
bool MayMeetGeometry(vtkRenderer* ren, vtkVolume* vol)
{
  vtkRenderWindow* window = ren->GetRenderWindow();
  if (ren->GetPass() != nullptr || ren->GetPreserveDepthBuffer() != 0 || ren->GetErase() == 0 ||
    window->GetErase() == 0 || ren->GetTexturedBackground() || ren->GetGradientBackground())
  {
    return true;
  }
  vtkCollectionSimpleIterator it = nullptr;
  vtkPropCollection* props = ren->GetViewProps();
  props->InitTraversal(it);
  while (vtkProp* prop = props->GetNextProp(it))
  {
    if (prop != vol && prop->GetVisibility() != 0)
    {
      return true;
    }
  }
  return false;
}
} // namespace

void vtkOutOfCoreVolumeMapper::Render(vtkRenderer* ren, vtkVolume* vol)
{
  vtkInternals& in = *this->Internals;
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(ren->GetRenderWindow());
  if (!window)
  {
    vtkErrorMacro("The renderer has no OpenGL render window.");
    return;
  }
  if (ren->GetSelector() != nullptr)
  {
    return; // picking passes draw props they can select; a volume's state stays untouched
  }
  const auto fail = [&](const std::string& message)
  {
    // Once per message: an error that comes with every frame is said once.
    if (in.LastError != message)
    {
      in.LastError = message;
      vtkErrorMacro(<< message);
    }
  };
  const double began = Now();
  this->InvokeEvent(vtkCommand::VolumeMapperRenderStartEvent, nullptr);

  vtkImageData* image = nullptr;
  vtkDataArray* scalars = nullptr;
  int cellFlag = 0;
  if (!in.Explicit)
  {
    this->Update();
    image = vtkImageData::SafeDownCast(this->GetInputDataObject(0, 0));
    scalars = image ? vtkAbstractMapper::GetScalars(image, this->ScalarMode, this->ArrayAccessMode,
                        this->ArrayId, this->ArrayName, cellFlag)
                    : nullptr;
    this->CellFlag = cellFlag;
  }
  const auto ofArray = [&](std::string& error) -> std::shared_ptr<teravox::BrickSource>
  {
    int dims[3];
    image->GetDimensions(dims);
    const int* extent = image->GetExtent();
    Int3 size{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      size[a] = cellFlag != 0 ? std::max(dims[a] - 1, 1) : dims[a];
    }
    const Int3 start{ extent[0], extent[2], extent[4] };
    const vtkMTimeType time = scalars->GetMTime();
    if (in.OfArray && in.Array == scalars && in.ArrayTime == time &&
      in.ArrayBrickSize == this->BrickSize && in.ArrayDimensions == size &&
      in.ArrayIsCellData == (cellFlag != 0))
    {
      return in.OfArray;
    }
    in.OfArray = nullptr;
    const auto type = teravox::FromVTK(scalars->GetDataType());
    if (!type)
    {
      error = std::string("Scalars of type ") + scalars->GetDataTypeAsString() +
        " can't be drawn; signed and unsigned integers of 8, 16 and 32 bits, float and double can.";
      return nullptr;
    }
    if (scalars->GetNumberOfTuples() != size[0] * size[1] * size[2] ||
      !scalars->HasStandardMemoryLayout())
    {
      error = "The scalars don't have one value per voxel in VTK's standard memory layout.";
      return nullptr;
    }
    teravox::ArrayDescription description;
    description.Data = scalars->GetVoidPointer(0);
    vtkSmartPointer<vtkDataArray> keep = scalars;
    description.Owner = std::shared_ptr<const void>(description.Data, [keep](const void*) {});
    description.Type = *type;
    description.Components = scalars->GetNumberOfComponents();
    description.Dimensions = size;
    description.BrickSize = this->BrickSize;
    description.CellData = cellFlag != 0;
    double range[2];
    scalars->GetRange(range, 0); // with infinities: the function is sampled for all values
    description.Range = { range[0], range[1] };
    const double* spacing = image->GetSpacing();
    description.Spacing = { spacing[0], spacing[1], spacing[2] };
    description.ExtentStart = start;
    description.ArrayName = scalars->GetName() ? scalars->GetName() : "scalars";
    auto made = teravox::ArrayBrickSource::Make(description);
    if (!made)
    {
      error = made.GetStatus().Message();
      return nullptr;
    }
    in.OfArray = made.Value();
    in.Array = scalars;
    in.ArrayTime = time;
    in.ArrayBrickSize = this->BrickSize;
    in.ArrayDimensions = size;
    in.ArrayIsCellData = cellFlag != 0;
    return in.OfArray;
  };
  std::string error;
  const Drawn drawn = FindDrawn(in.Explicit, image, scalars, cellFlag, ofArray, error);
  if (!drawn.Source)
  {
    fail(error);
    return;
  }
  vtkVolumeProperty* property = vol->GetProperty();
  for (const std::string& name : FindUnsupported(this, property))
  {
    if (in.Warned.insert(name).second)
    {
      vtkWarningMacro(<< name << " isn't supported by out-of-core rendering yet and is ignored.");
    }
  }

  // Where and how large.
  int viewportSize[2];
  int viewportOrigin[2];
  ren->GetTiledSizeAndOrigin(
    &viewportSize[0], &viewportSize[1], &viewportOrigin[0], &viewportOrigin[1]);
  if (viewportSize[0] <= 0 || viewportSize[1] <= 0)
  {
    return;
  }
  window->MakeCurrent();
  if (in.Window && in.Window != window)
  {
    this->ReleaseGraphicsResources(in.Window);
    window->MakeCurrent();
  }
  in.Window = window;

  teravox::FrameRequest request;
  request.View = ren;
  request.X = viewportOrigin[0];
  request.Y = viewportOrigin[1];
  request.Camera.Width = viewportSize[0];
  request.Camera.Height = viewportSize[1];
  vtkCamera* camera = ren->GetActiveCamera();
  request.Camera.ViewFromWorld = ToMatrix(camera->GetModelViewTransformMatrix());
  request.Camera.ClipFromView =
    ToMatrix(camera->GetProjectionTransformMatrix(ren->GetTiledAspectRatio(), -1, 1));
  request.Camera.DatasetFromVoxel = drawn.DatasetFromVoxel;
  request.Camera.WorldFromDataset = ToMatrix(vol->GetMatrix());
  request.Camera.LevelBias = this->LevelOfDetailBias;
  request.Camera.MinimumLevel = this->MinimumLevel;
  request.Camera.MaximumLevel = this->MaximumLevel;
  request.Camera.CellData = drawn.CellData;
  SetCuts(this, request.Camera);
  request.Nearest = property->GetInterpolationType() == VTK_NEAREST_INTERPOLATION;
  SetMaterial(ren, property, request);
  request.Tolerance = this->ImageErrorTolerance;
  request.SampleDistance = static_cast<double>(this->SampleDistance);
  request.EmptySpaceSkipping = this->EmptySpaceSkipping != 0;
  request.ReusePicture = this->PictureReuse != 0;
  request.UseDepth = MayMeetGeometry(ren, vol);
  request.CountSamples = this->CountSamples != 0;
  request.ShowLevel = this->ShowLevels != 0;
  request.ErrorEstimate = this->ErrorEstimate != 0;
  if (!request.ShowLevel)
  {
    request.Blend = MakeProjection(this, property);
  }
  if (request.Blend.Kind == teravox::BlendKind::Slice)
  {
    vtkImplicitFunction* function = property->GetSliceFunction();
    if (function)
    {
      std::array<double, 6> bounds{};
      vol->GetBounds(bounds.data());
      const auto depths = in.Slice.Find(request.Camera, function, bounds);
      if (!depths)
      {
        fail(depths.GetStatus().Message());
        return;
      }
      request.SliceDepths = depths.Value();
    }
    else if (in.Warned.insert("SliceFunction").second)
    {
      vtkWarningMacro("SliceFunction isn't set, so there is no slice to draw.");
    }
  }
  const bool automatic = this->FrameTimeBudget < 0;
  request.Converge = automatic
    ? window->GetOffScreenRendering() != 0 || window->GetShowWindow() == 0
    : this->FrameTimeBudget == 0;
  request.TimeBudget = automatic ? vol->GetAllocatedRenderTime() : this->FrameTimeBudget;
  request.Timeout = this->ConvergeTimeout;
  request.Abort = [window]() { return window->CheckAbortStatus() != 0; };

  // A wall of a hundredth of the shortest voxel edge is opaque.
  const Matrix4& world = request.Camera.DatasetFromVoxel;
  double shortest = VTK_DOUBLE_MAX;
  for (std::size_t a = 0; a < 3; ++a)
  {
    shortest = std::min(shortest,
      std::sqrt(world[a] * world[a] + world[4 + a] * world[4 + a] + world[8 + a] * world[8 + a]));
  }
  if (!(shortest > 0) || !std::isfinite(shortest))
  {
    fail("The matrix from voxels to the world is singular: check spacing, direction matrix and the "
         "volume's transform.");
    return;
  }
  request.ShortestLength = 0.01 * shortest;

  in.Engine.SetSource(drawn.Source);
  if (in.Timed != drawn.Source)
  {
    in.Timed = drawn.Source;
    in.SourceTime = began;
    in.FirstPicture = 0;
    in.ConvergedAfter = 0;
  }
  teravox::EngineSettings settings;
  settings.GPUMemoryBudget = this->GetEffectiveGPUMemoryBudget();
  settings.HostMemoryBudget = this->GetEffectiveHostMemoryBudget();
  settings.LoaderThreads = this->NumberOfLoaderThreads;
  settings.Marcher = static_cast<teravox::MarcherKind>(this->Marcher);
  if (this->MaximumNumberOfSlots != 0)
  {
    settings.MaximumSlots = std::max<std::uint32_t>(this->MaximumNumberOfSlots, 2);
  }
  if (this->ArrivalShuffleSeed != 0)
  {
    settings.ShuffleSeed = this->ArrivalShuffleSeed;
  }
  in.Engine.SetSettings(settings);
  const vtkMTimeType functionTime =
    std::max({ property->GetMTime(), property->GetScalarOpacity()->GetMTime() });
  // How the function is sampled depends on the values of the source and on the size of its voxels.
  if (in.FunctionOf != property || in.FunctionTime != functionTime || in.FunctionVersion == 0 ||
    in.FunctionFor != drawn.Source || in.FunctionLength != request.ShortestLength)
  {
    in.FunctionOf = property;
    in.FunctionTime = functionTime;
    in.FunctionFor = drawn.Source;
    in.FunctionLength = request.ShortestLength;
    in.Engine.SetTransferFunction(MakeTransferFunction(property), ++in.FunctionVersion);
  }

  window->GetShaderCache()->ReleaseCurrentShader();
  GLint framebuffer = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
  request.Framebuffer = static_cast<GLuint>(framebuffer);
  const teravox::Status status = in.Engine.Render(request);
  in.LastView = ren;
  for (const teravox::LoadResult& failure : in.Engine.TakeFailures())
  {
    const std::string text =
      drawn.Source->Info().Name + ", " + failure.Key.ToString() + ": " + failure.Outcome.Message();
    if (in.ReportedFailures.empty())
    {
      vtkErrorMacro(<< "A brick can't be read and is drawn from a coarser level. " << text);
    }
    in.ReportedFailures.insert(text);
    this->InvokeEvent(BrickFailedEvent, const_cast<char*>(text.c_str()));
  }
  if (!status)
  {
    fail(status.Message());
    return;
  }
  in.LastError.clear();
  const teravox::FrameStatistics& frame = in.Engine.LastFrame();
  if (frame.TimedOut)
  {
    vtkWarningMacro(
      "The picture isn't complete: for " << this->ConvergeTimeout << " s no brick has come.");
  }
  if (in.FirstPicture == 0)
  {
    in.FirstPicture = Now() - in.SourceTime;
  }
  if (frame.Converged)
  {
    if (in.ConvergedAfter == 0)
    {
      in.ConvergedAfter = Now() - in.SourceTime;
    }
    if (!in.WasConverged)
    {
      in.WasConverged = true;
      this->InvokeEvent(ConvergedEvent, nullptr);
    }
  }
  else
  {
    in.WasConverged = false;
  }
  teravox::RefinementBoard::Post(window,
    { frame.Converged, this->GetNumberOfFailedBricks() + this->GetNumberOfFailedPageBlocks() > 0,
      frame.MissingBricks, this->GetNumberOfBricksLoaded() });
  this->TimeToDraw = Now() - began;
  this->InvokeEvent(vtkCommand::VolumeMapperRenderEndEvent, nullptr);
}

bool vtkOutOfCoreVolumeMapper::IsConverged()
{
  return this->Internals->Engine.LastFrame().Converged;
}

vtkIdType vtkOutOfCoreVolumeMapper::GetNumberOfMissingBricks()
{
  return static_cast<vtkIdType>(this->Internals->Engine.LastFrame().MissingBricks);
}

bool vtkOutOfCoreVolumeMapper::Converge(vtkRenderWindow* window, double timeout)
{
  const double until = Now() + timeout;
  do
  {
    window->Render();
  } while (!this->IsConverged() && this->GetNumberOfFailedBricks() == 0 &&
    this->GetNumberOfFailedPageBlocks() == 0 && Now() < until);
  return this->IsConverged();
}

void vtkOutOfCoreVolumeMapper::RetryFailedBricks()
{
  this->Internals->Engine.RetryFailed();
  this->Internals->ReportedFailures.clear();
  this->Modified();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetBytesRead()
{
  return this->Internals->Engine.BytesRead();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetBytesUploaded()
{
  return this->Internals->Engine.BytesUploaded();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPageTableBytesUploaded()
{
  return this->Internals->Engine.PageTableBytesUploaded();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfBricksLoaded()
{
  return this->Internals->Engine.BricksLoaded();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfFailedBricks()
{
  return this->Internals->Engine.FailedBricks();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfFailedPageBlocks()
{
  return this->Internals->Engine.FailedPageBlocks();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfEvictions()
{
  return this->Internals->Engine.Evictions();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfPageBlockEvictions()
{
  return this->Internals->Engine.PageBlockEvictions();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSlots()
{
  return this->Internals->Engine.Plan().Slots;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSlotsInUse()
{
  return this->Internals->Engine.SlotsInUse();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetGPUMemoryUsed()
{
  return this->Internals->Engine.Memory().Used;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPeakGPUMemoryUsed()
{
  return this->Internals->Engine.Memory().Peak;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetHostMemoryUsed()
{
  return this->Internals->Engine.HostMemoryUsed();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPeakHostMemoryUsed()
{
  return this->Internals->Engine.PeakHostMemoryUsed();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetAddressingMemoryUsed()
{
  return this->Internals->Engine.AddressingBytes();
}

bool vtkOutOfCoreVolumeMapper::IsMarcherNative()
{
  return this->Internals->Engine.Plan().Native;
}

int vtkOutOfCoreVolumeMapper::GetMaximumTextureSize()
{
  const teravox::VolumeEngine& engine = this->Internals->Engine;
  return engine.Plan().Slots != 0 ? static_cast<int>(engine.PlannedFor().MaximumTextureSize) : 0;
}

double vtkOutOfCoreVolumeMapper::GetTimeToFirstPicture()
{
  return this->Internals->FirstPicture;
}

double vtkOutOfCoreVolumeMapper::GetTimeToConverged()
{
  return this->Internals->ConvergedAfter;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSamples()
{
  return this->Internals->Engine.LastFrame().Samples;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfEvaluatedSamples()
{
  return this->Internals->Engine.LastFrame().EvaluatedSamples;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfGradients()
{
  return this->Internals->Engine.LastFrame().Gradients;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfVisits()
{
  return this->Internals->Engine.LastFrame().Visits;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfContributingSamples()
{
  return this->Internals->Engine.LastFrame().ContributingSamples;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfPasses()
{
  return this->Internals->Engine.LastFrame().Passes;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfOperations()
{
  return this->Internals->Engine.Operations();
}

namespace
{
bool SetPixels(vtkImageData* image, const std::vector<float>& pixels, int width, int height)
{
  if (pixels.empty())
  {
    return false;
  }
  image->SetDimensions(width, height, 1);
  image->AllocateScalars(VTK_FLOAT, static_cast<int>(pixels.size() / (width * height)));
  std::copy(pixels.begin(), pixels.end(), static_cast<float*>(image->GetScalarPointer()));
  return true;
}
} // namespace

bool vtkOutOfCoreVolumeMapper::GetColorAccumulator(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  if (!image || !in.Window || !in.LastView)
  {
    return false;
  }
  in.Window->MakeCurrent();
  int width = 0;
  int height = 0;
  const std::vector<float> colors = in.Engine.ReadColors(in.LastView, width, height);
  return SetPixels(image, colors, width, height);
}

bool vtkOutOfCoreVolumeMapper::GetErrorEstimateImage(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  if (!image || !in.Window || !in.LastView)
  {
    return false;
  }
  in.Window->MakeCurrent();
  int width = 0;
  int height = 0;
  const std::vector<float> errors = in.Engine.ReadErrors(in.LastView, width, height);
  return SetPixels(image, errors, width, height);
}

std::string vtkOutOfCoreVolumeMapper::CheckInvariants()
{
  return this->Internals->Engine.CheckInvariants();
}
