// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Scene.h"

#include "ArrayBrickSource.h"
#include "BrickVoxels.h"
#include "TruthLights.h"
#include "VTKScalarType.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <vtkCamera.h>
#include <vtkCellData.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkExtractVOI.h>
#include <vtkImageCast.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkNIFTIImageReader.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkPointData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

namespace teravox::test
{

namespace
{
Matrix4 ToMatrix(vtkMatrix4x4* m)
{
  Matrix4 result{};
  std::copy_n(m->GetData(), 16, result.begin());
  return result;
}

// A level as one dense array, from its bricks.
std::vector<double> ReadLevel(BrickSource& source, int level)
{
  const PyramidLayout& layout = source.Info().Layout;
  const Int3& dims = layout.Dimensions(level);
  const Int3& bricks = layout.Bricks(level);
  const std::int64_t inner = layout.BrickSize();
  const std::int64_t stored = layout.StoredSize();
  std::vector<double> voxels(static_cast<std::size_t>(dims[0] * dims[1] * dims[2]));
  for (std::int64_t b = 0; b < bricks[0] * bricks[1] * bricks[2]; ++b)
  {
    const Int3 at{ b % bricks[0], b / bricks[0] % bricks[1], b / bricks[0] / bricks[1] };
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = static_cast<std::uint32_t>(at[0]);
    key.Y = static_cast<std::uint32_t>(at[1]);
    key.Z = static_cast<std::uint32_t>(at[2]);
    const Result<BrickPointer> brick = source.ReadBrick(key);
    if (!brick)
    {
      continue; // the test that makes bricks fail gives the truth another source
    }
    DispatchScalarType(brick.Value()->Type,
      [&](auto zero)
      {
        using T = decltype(zero);
        const T* data = reinterpret_cast<const T*>(brick.Value()->Voxels.data());
        for (std::int64_t z = at[2] * inner; z < std::min((at[2] + 1) * inner, dims[2]); ++z)
        {
          for (std::int64_t y = at[1] * inner; y < std::min((at[1] + 1) * inner, dims[1]); ++y)
          {
            for (std::int64_t x = at[0] * inner; x < std::min((at[0] + 1) * inner, dims[0]); ++x)
            {
              const std::int64_t from =
                ((z - at[2] * inner + BrickBorder) * stored + y - at[1] * inner + BrickBorder) *
                  stored +
                x - at[0] * inner + BrickBorder;
              voxels[static_cast<std::size_t>((z * dims[1] + y) * dims[0] + x)] =
                static_cast<double>(data[from]);
            }
          }
        }
      });
  }
  return voxels;
}

// Nodes of an opacity function (4 numbers a node) or a colour function (6), and the midpoints
// between them: with a sharpness of 1 the function jumps there. Midpoint and sharpness come last.
template <std::size_t Numbers, typename Function>
std::vector<double> KnotsOf(Function* function)
{
  std::vector<double> knots;
  double midpoint = 0;
  for (int i = 0; i < function->GetSize(); ++i)
  {
    double node[Numbers];
    function->GetNodeValue(i, node);
    if (i > 0)
    {
      knots.push_back(knots.back() + midpoint * (node[0] - knots.back()));
    }
    knots.push_back(node[0]);
    midpoint = node[Numbers - 2];
  }
  return knots;
}
} // namespace

const char* ToString(OpacityShape shape)
{
  switch (shape)
  {
    case OpacityShape::Ramp:
      return "ramp";
    case OpacityShape::Peak:
      return "peak";
    case OpacityShape::Box:
      return "box";
    case OpacityShape::Wall:
      return "wall";
    case OpacityShape::Fog:
    default:
      return "fog";
  }
}

TransferNodes MakeTransfer(OpacityShape shape, double low, double high, double unitDistance)
{
  TransferNodes nodes;
  nodes.UnitDistance = unitDistance;
  const auto at = [&](double t) { return low + t * (high - low); };
  nodes.Color = { { at(0), 0.1, 0.2, 0.9 }, { at(0.3), 0.9, 0.3, 0.2 }, { at(0.6), 0.9, 0.9, 0.3 },
    { at(1), 0.4, 1.0, 1.0 } };
  switch (shape)
  {
    case OpacityShape::Ramp:
      nodes.Opacity = { { at(0), 0 }, { at(0.25), 0 }, { at(0.6), 0.08 }, { at(1), 0.3 } };
      break;
    case OpacityShape::Peak:
      nodes.Opacity = { { at(0), 0 }, { at(0.43), 0 }, { at(0.45), 0.5 }, { at(0.47), 0 },
        { at(1), 0 } };
      break;
    case OpacityShape::Box:
      nodes.Opacity = { { at(0), 0 }, { at(0.35), 0 }, { at(0.352), 0.4 }, { at(0.55), 0.4 },
        { at(0.552), 0 }, { at(1), 0 } };
      break;
    case OpacityShape::Wall:
      nodes.Opacity = { { at(0), 0 }, { at(0.2), 0 }, { at(0.5), 0.02 }, { at(0.55), 1 },
        { at(1), 1 } };
      break;
    case OpacityShape::Fog:
      nodes.Opacity = { { at(0), 0.001 }, { at(1), 0.004 } };
      break;
  }
  return nodes;
}

int TestedMarcher()
{
  const char* name = std::getenv("TERAVOX_TEST_MARCHER");
  return name != nullptr && std::string(name) == "gpu" ? vtkOutOfCoreVolumeMapper::MARCHER_GPU
                                                       : vtkOutOfCoreVolumeMapper::MARCHER_NATIVE;
}

bool TakesAll()
{
  return TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_NATIVE ||
    std::getenv("TERAVOX_TEST_ALL_SCENES") != nullptr;
}

Stage::Stage(int width, int height)
  : Width_(width)
  , Height_(height)
{
  this->Window->SetOffScreenRendering(1);
  this->Window->SetMultiSamples(0);
  this->Window->SetSize(width, height);
  this->Window->AddRenderer(this->Renderer);
  this->Renderer->SetBackground(0, 0, 0);
  this->Mapper = vtkSmartPointer<vtkOutOfCoreVolumeMapper>::New();
  this->Mapper->SetMarcher(TestedMarcher());
  this->Mapper->SetNumberOfLoaderThreads(2);
  this->Mapper->SetGPUMemoryBudget(std::uint64_t{ 256 } << 20);
  this->Mapper->SetHostMemoryBudget(std::uint64_t{ 512 } << 20);
  this->Property->SetScalarOpacity(this->Opacity);
  this->Property->SetColor(this->Color);
  this->Property->SetInterpolationTypeToLinear();
  this->Volume->SetProperty(this->Property);
  this->Volume->SetMapper(this->Mapper);
  this->Renderer->AddVolume(this->Volume);
}

Stage::~Stage()
{
  this->Renderer->RemoveVolume(this->Volume);
  this->Volume->SetMapper(nullptr);
  this->Mapper = nullptr; // frees its objects while the window lives
}

void Stage::SetImage(vtkImageData* image)
{
  this->Mapper->SetBrickSource(nullptr);
  this->Mapper->SetInputData(image);
  if (!image->GetPointData()->GetScalars() && image->GetCellData()->GetScalars())
  {
    this->Mapper->SetScalarModeToUseCellData();
  }
}

void Stage::SetSource(const std::shared_ptr<BrickSource>& source)
{
  vtkNew<vtkBrickSource> holder;
  holder->SetBrickSource(source);
  this->Mapper->SetBrickSource(holder);
}

void Stage::SetTransfer(const TransferNodes& nodes)
{
  this->Opacity->RemoveAllPoints();
  for (const auto& node : nodes.Opacity)
  {
    this->Opacity->AddPoint(node[0], node[1]);
  }
  this->Color->RemoveAllPoints();
  for (const auto& node : nodes.Color)
  {
    this->Color->AddRGBPoint(node[0], node[1], node[2], node[3]);
  }
  this->Property->SetScalarOpacityUnitDistance(nodes.UnitDistance);
}

void Stage::SetShade(bool shade)
{
  this->Property->SetShade(shade ? 1 : 0);
  this->Property->SetAmbient(0.2);
  this->Property->SetDiffuse(0.6);
  this->Property->SetSpecular(0.3);
  this->Property->SetSpecularPower(12);
}

void Stage::SetGradientOpacity(const std::vector<std::array<double, 2>>& nodes)
{
  vtkNew<vtkPiecewiseFunction> function;
  for (const auto& node : nodes)
  {
    function->AddPoint(node[0], node[1]);
  }
  this->Property->SetGradientOpacity(nodes.empty() ? nullptr : function.Get());
}

void Stage::SetTransferImage(
  int columns, int rows, const std::function<std::array<double, 4>(double, double)>& node)
{
  if (columns == 0)
  {
    this->Property->SetTransferFunctionMode(vtkVolumeProperty::TF_1D);
    return;
  }
  vtkNew<vtkImageData> image;
  image->SetDimensions(columns, rows, 1);
  image->AllocateScalars(VTK_FLOAT, 4);
  for (int y = 0; y < rows; ++y)
  {
    for (int x = 0; x < columns; ++x)
    {
      const std::array<double, 4> rgba = node(static_cast<double>(x) / std::max(columns - 1, 1),
        static_cast<double>(y) / std::max(rows - 1, 1));
      for (int c = 0; c < 4; ++c)
      {
        image->SetScalarComponentFromDouble(x, y, 0, c, rgba[static_cast<std::size_t>(c)]);
      }
    }
  }
  this->Property->SetTransferFunction2D(image);
  this->Property->SetTransferFunctionMode(vtkVolumeProperty::TF_2D);
}

void Stage::Look(const std::array<double, 3>& direction, double distance, bool parallel)
{
  double b[6];
  this->Volume->GetBounds(b);
  const double center[3] = { 0.5 * (b[0] + b[1]), 0.5 * (b[2] + b[3]), 0.5 * (b[4] + b[5]) };
  const double radius = 0.5 * std::hypot(b[1] - b[0], b[3] - b[2], b[5] - b[4]);
  const double length = std::hypot(direction[0], direction[1], direction[2]);
  vtkCamera* camera = this->Renderer->GetActiveCamera();
  camera->SetParallelProjection(parallel ? 1 : 0);
  camera->SetViewAngle(30);
  const double away = distance * radius / std::sin(15.0 * M_PI / 180.0);
  camera->SetFocalPoint(center);
  camera->SetPosition(center[0] - away * direction[0] / length,
    center[1] - away * direction[1] / length, center[2] - away * direction[2] / length);
  camera->SetViewUp(0, 0.2, 1);
  camera->SetParallelScale(distance * radius);
  camera->SetClippingRange(std::max(away - 1.1 * radius, 0.001 * radius), away + 1.1 * radius);
}

void Stage::LookFrom(const std::array<double, 3>& eye, const std::array<double, 3>& at, double near,
  double far, double viewAngle)
{
  vtkCamera* camera = this->Renderer->GetActiveCamera();
  camera->SetParallelProjection(0);
  camera->SetViewAngle(viewAngle);
  camera->SetPosition(eye.data());
  camera->SetFocalPoint(at.data());
  camera->SetViewUp(0, 0.2, 1);
  camera->SetClippingRange(near, far);
}

void Clip(Stage& stage, const Double3& origin, const Double3& normal)
{
  vtkNew<vtkPlane> plane;
  plane->SetOrigin(origin[0], origin[1], origin[2]);
  plane->SetNormal(normal[0], normal[1], normal[2]);
  stage.Mapper->AddClippingPlane(plane);
}

std::vector<float> Stage::Draw()
{
  this->Window->Render();
  return this->Accumulator();
}

std::vector<float> Stage::Accumulator()
{
  vtkNew<vtkImageData> image;
  if (!this->Mapper->GetColorAccumulator(image))
  {
    return {};
  }
  const float* data = static_cast<const float*>(image->GetScalarPointer());
  return { data, data + 4 * image->GetNumberOfPoints() };
}

std::vector<float> Stage::DrawPicture()
{
  this->Window->Render();
  vtkNew<vtkUnsignedCharArray> pixels;
  this->Window->GetRGBACharPixelData(0, 0, this->Width_ - 1, this->Height_ - 1, 0, pixels);
  std::vector<float> picture(static_cast<std::size_t>(pixels->GetNumberOfValues()));
  for (std::size_t i = 0; i < picture.size(); ++i)
  {
    picture[i] = static_cast<float>(pixels->GetValue(static_cast<vtkIdType>(i))) / 255.0f;
  }
  return picture;
}

std::vector<float> Stage::DrawPictureWith(vtkVolumeMapper* other)
{
  this->Volume->SetMapper(other);
  std::vector<float> picture = this->DrawPicture();
  this->Volume->SetMapper(this->Mapper);
  return picture;
}

namespace
{
// The lights that are on; none where there is just one headlight.
std::vector<TruthLights::Light> LightsOf(vtkRenderer* renderer)
{
  std::vector<TruthLights::Light> lights;
  bool headlight = true;
  for (int i = 0; i < renderer->GetLights()->GetNumberOfItems(); ++i)
  {
    auto* light = vtkLight::SafeDownCast(renderer->GetLights()->GetItemAsObject(i));
    if (light->GetSwitch() == 0)
    {
      continue;
    }
    headlight = headlight && light->LightTypeIsHeadlight() != 0 && light->GetPositional() == 0 &&
      light->GetIntensity() == 1;
    const auto color = [&](const double* c) {
      return light->GetIntensity() * Double3{ c[0], c[1], c[2] };
    };
    TruthLights::Light l;
    l.Ambient = color(light->GetAmbientColor());
    l.Diffuse = color(light->GetDiffuseColor());
    l.Specular = color(light->GetSpecularColor());
    Double3 focus{};
    light->GetTransformedPosition(l.Position.data());
    light->GetTransformedFocalPoint(focus.data());
    l.Direction = focus - l.Position;
    l.Positional = light->GetPositional() != 0;
    std::copy_n(light->GetAttenuationValues(), 3, l.Attenuation.begin());
    l.ConeAngle = light->GetConeAngle();
    l.Exponent = light->GetExponent();
    lights.push_back(l);
  }
  if (headlight && lights.size() <= 1)
  {
    lights.clear();
  }
  return lights;
}

// Copies of functions as they are now.
TruthTransfer TransferOf(
  vtkPiecewiseFunction* ofOpacity, vtkColorTransferFunction* ofColor, double unitDistance)
{
  auto opacity = vtkSmartPointer<vtkPiecewiseFunction>::New();
  opacity->DeepCopy(ofOpacity);
  auto color = vtkSmartPointer<vtkColorTransferFunction>::New();
  color->DeepCopy(ofColor);
  std::vector<double> knots = KnotsOf<4>(opacity.Get());
  const std::vector<double> colorKnots = KnotsOf<6>(color.Get());
  knots.insert(knots.end(), colorKnots.begin(), colorKnots.end());
  return TruthTransfer([opacity](double v) { return opacity->GetValue(v); },
    [color](double v)
    {
      Double3 rgb{};
      color->GetColor(v, rgb.data());
      return rgb;
    },
    std::move(knots), unitDistance);
}

std::unique_ptr<TruthGradientOpacity> GradientOpacityOf(
  vtkPiecewiseFunction* of, const VolumeInfo& info)
{
  auto function = vtkSmartPointer<vtkPiecewiseFunction>::New();
  function->DeepCopy(of);
  // VTK looks it up on a quarter of the range of the data.
  const double last = 0.25 * (info.Range.Max - info.Range.Min);
  std::vector<double> bends = KnotsOf<4>(function.Get());
  bends.push_back(last);
  return std::make_unique<TruthGradientOpacity>([function, last](double m)
    { return function->GetValue(std::min(m, last)); },
    std::move(bends), info.Spacing);
}

} // namespace

std::unique_ptr<TruthImage> ImageOf(
  vtkVolumeProperty* property, const VolumeInfo& info, double last)
{
  vtkImageData* image = property->GetTransferFunction2D();
  std::vector<TruthImage::Node> nodes;
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
  {
    image->GetPointData()->GetScalars()->GetTuple(i, nodes.emplace_back().data());
  }
  return std::make_unique<TruthImage>(image->GetDimensions()[0], std::move(nodes), info.Range.Min,
    info.Range.Max, last, property->GetScalarOpacityUnitDistance(), info.Spacing);
}

StageTruth::StageTruth(
  Stage& stage, BrickSource& source, double scaleOfLengths, VoxelAccess access, int component)
  : Width(stage.Width())
{
  const VolumeInfo& info = source.Info();
  std::vector<TruthLevel> levels;
  this->Voxels.reserve(static_cast<std::size_t>(info.Layout.NumberOfLevels()));
  for (int l = 0; l < info.Layout.NumberOfLevels(); ++l)
  {
    if (access == VoxelAccess::ByBrick)
    {
      levels.push_back(TruthLevel::FromFunction([voxels = std::make_shared<BrickVoxels>(source, l)](
                                                  std::int64_t i, std::int64_t j, std::int64_t k)
        { return voxels->Voxel(i, j, k); },
        info.Layout.Dimensions(l), info.Layout.Factor(l)));
      continue;
    }
    this->Voxels.push_back(ReadLevel(source, l));
    levels.push_back(TruthLevel::FromArray(ScalarType::Float64, this->Voxels.back().data(),
      info.Layout.Dimensions(l), info.Layout.Factor(l)));
  }
  this->Build(stage, info, std::move(levels), scaleOfLengths, component);
}

StageTruth::StageTruth(
  Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels, double scaleOfLengths)
  : Width(stage.Width())
{
  this->Build(stage, info, std::move(levels), scaleOfLengths);
}

void StageTruth::Build(Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels,
  double scaleOfLengths, int component)
{
  const Matrix4 prop = ToMatrix(stage.Volume->GetMatrix());
  const bool nearest = stage.Property->GetInterpolationType() == VTK_NEAREST_INTERPOLATION;
  this->Volume = std::make_unique<TruthVolume>(std::move(levels),
    TruthVolume::WorldFromVoxel(info.Origin, info.Spacing, info.Direction, prop),
    nearest ? TruthInterpolation::Nearest : TruthInterpolation::Linear, info.CellData);

  this->Transfer = std::make_unique<TruthTransfer>(TransferOf(
    stage.Property->GetScalarOpacity(component), stage.Property->GetRGBTransferFunction(component),
    stage.Property->GetScalarOpacityUnitDistance(component) * scaleOfLengths));

  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  this->Camera = std::make_unique<TruthCamera>(ToMatrix(camera->GetModelViewTransformMatrix()),
    ToMatrix(camera->GetProjectionTransformMatrix(
      static_cast<double>(this->Width) / static_cast<double>(stage.Height()), -1, 1)),
    this->Width, stage.Height());
  if (stage.Property->GetShade() != 0)
  {
    TruthHeadlight::Material material;
    material.Ambient = stage.Property->GetAmbient(component);
    material.Diffuse = stage.Property->GetDiffuse(component);
    material.Specular = stage.Property->GetSpecular(component);
    material.SpecularPower = stage.Property->GetSpecularPower(component);
    material.TwoSided = stage.Renderer->GetTwoSidedLighting() != 0;
    TruthHeadlight::Geometry geometry;
    geometry.Spacing = info.Spacing;
    geometry.Direction = info.Direction;
    geometry.WorldFromDataset = prop;
    const std::vector<TruthLights::Light> lights = LightsOf(stage.Renderer);
    if (lights.empty())
    {
      this->Shading = std::make_unique<TruthHeadlight>(material, geometry);
    }
    else
    {
      this->Shading = std::make_unique<TruthLights>(material, geometry, lights);
    }
  }
  this->Scene_ =
    std::make_unique<TruthScene>(TruthScene{ *this->Volume, *this->Transfer, *this->Camera,
      TruthLevelOfDetail(*this->Volume, *this->Camera, stage.Mapper->GetLevelOfDetailBias(),
        stage.Mapper->GetMinimumLevel(), stage.Mapper->GetMaximumLevel()),
      this->Shading.get(), 1e-5, Invert(prop), {}, {} });
  if (stage.Property->HasGradientOpacity(component) &&
    stage.Property->GetDisableGradientOpacity(component) == 0)
  {
    this->GradientOpacity = GradientOpacityOf(stage.Property->GetGradientOpacity(component), info);
    this->Scene_->GradientOpacity = this->GradientOpacity.get();
  }
  if (stage.Property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D)
  {
    this->Image = ImageOf(stage.Property, info, 0.25 * (info.Range.Max - info.Range.Min));
    this->Scene_->Image = this->Image.get();
  }
  if (stage.Property->GetUseClippedVoxelIntensity())
  {
    this->Scene_->ClippedIntensity = stage.Property->GetClippedVoxelIntensity();
  }
  if (vtkPlaneCollection* planes = stage.Mapper->GetClippingPlanes())
  {
    for (int i = 0; i < planes->GetNumberOfItems(); ++i)
    {
      const double* o = planes->GetItem(i)->GetOrigin();
      const double* n = planes->GetItem(i)->GetNormal();
      this->Scene_->Planes.push_back({ { o[0], o[1], o[2] }, { n[0], n[1], n[2] } });
    }
  }
  if (stage.Mapper->GetCropping() != 0)
  {
    TruthCrop crop;
    crop.FromWorld = Invert(prop);
    crop.Flags = static_cast<unsigned>(stage.Mapper->GetCroppingRegionFlags());
    std::copy_n(stage.Mapper->GetCroppingRegionPlanes(), 6, crop.Planes.begin());
    this->Scene_->Crop = crop;
  }
}

std::vector<float> TakePixels(
  const std::vector<float>& picture, int width, const std::vector<TruthPixel>& pixels)
{
  std::vector<float> taken;
  taken.reserve(4 * pixels.size());
  for (const TruthPixel& pixel : pixels)
  {
    const auto at =
      4 * (static_cast<std::ptrdiff_t>(pixel.Y) * width + static_cast<std::ptrdiff_t>(pixel.X));
    taken.insert(taken.end(), picture.begin() + at, picture.begin() + at + 4);
  }
  return taken;
}

void StageTruth::SetMask(std::vector<TruthLevel> levels)
{
  this->Mask = std::make_unique<TruthVolume>(
    std::move(levels), this->Volume->WorldFromVoxel(), TruthInterpolation::Nearest, false);
  this->Scene_->Mask = this->Mask.get();
}

void StageTruth::SetLabels(Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels)
{
  this->SetMask(std::move(levels));
  vtkVolumeProperty* p = stage.Property;
  for (const int label : p->GetLabelMapLabels())
  {
    vtkPiecewiseFunction* opacity = p->GetLabelScalarOpacity(label);
    vtkColorTransferFunction* color = p->GetLabelColor(label);
    vtkPiecewiseFunction* gradient = p->GetLabelGradientOpacity(label);
    TruthLabel truth{ TransferOf(opacity ? opacity : p->GetScalarOpacity(),
                        color ? color : p->GetRGBTransferFunction(),
                        p->GetScalarOpacityUnitDistance()),
      gradient ? GradientOpacityOf(gradient, info) : nullptr };
    this->Labels.emplace(label, std::move(truth));
  }
  this->Scene_->Labels = &this->Labels;
}

TruthBounds StageTruth::Bounds(const std::vector<TruthPixel>& pixels,
  const std::vector<std::vector<float>>& taken, double small) const
{
  TruthBounds bounds;
  bounds.Center = ToFloat(RenderTruth(*this->Scene_, pixels));
  bounds.Low = bounds.Center;
  bounds.High = bounds.Center;
  std::vector<TruthPixel> doubtful;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < pixels.size(); ++i)
  {
    const auto isFar = [&](const std::vector<float>& picture)
    {
      for (std::size_t c = 4 * i; c < 4 * i + 4; ++c)
      {
        if (!(std::abs(picture[c] - bounds.Center[c]) <= small))
        {
          return true;
        }
      }
      return false;
    };
    if (std::any_of(taken.begin(), taken.end(), isFar))
    {
      doubtful.push_back(pixels[i]);
      places.push_back(4 * i);
    }
  }
  const TruthEnvelope envelope = RenderEnvelope(*this->Scene_, doubtful);
  const std::vector<float> min = ToFloat(envelope.Min);
  const std::vector<float> max = ToFloat(envelope.Max);
  for (std::size_t i = 0; i < places.size(); ++i)
  {
    for (std::size_t c = 0; c < 4; ++c)
    {
      bounds.Low[places[i] + c] = min[4 * i + c];
      bounds.High[places[i] + c] = max[4 * i + c];
    }
  }
  return bounds;
}

ImageDifference StageTruth::Excess(
  const std::vector<float>& picture, double small, ImageDifference* plain) const
{
  const TruthBounds bounds = this->Bounds(AllPixels(*this->Camera), { picture }, small);
  if (plain)
  {
    *plain = CompareImages(picture, bounds.Center);
  }
  return ExcessOverEnvelope(picture, bounds.Low, bounds.High);
}

ImageOptions OptionsOfType(ScalarType type)
{
  ImageOptions options;
  options.Type = type;
  switch (type)
  {
    case ScalarType::Int8:
      options.Low = -128;
      options.High = 127;
      break;
    case ScalarType::UInt16:
      options.Low = 3000;
      options.High = 65000;
      break;
    case ScalarType::Int16:
      options.Low = -1000;
      options.High = 3000;
      break;
    case ScalarType::UInt32: // far beyond the 24 bits of a float
      options.Low = 4.0e9;
      options.High = 4.0e9 + 4000;
      break;
    case ScalarType::Int32:
      options.Low = -2.0e9;
      options.High = -2.0e9 + 900;
      break;
    case ScalarType::Float32:
      options.Low = -3.5;
      options.High = 2.25;
      break;
    case ScalarType::Float64:
      options.Low = 1.0e12;
      options.High = 1.0e12 + 1;
      break;
    default:
      break;
  }
  return options;
}

double BlobField(double x, double y, double z)
{
  const auto blob = [&](double cx, double cy, double cz, double r)
  {
    const double d2 = (x - cx) * (x - cx) + (y - cy) * (y - cy) + (z - cz) * (z - cz);
    return std::exp(-d2 / (r * r));
  };
  const double shell = std::hypot(x - 0.52, y - 0.47, z - 0.5);
  const double value = 0.9 * blob(0.35, 0.4, 0.6, 0.16) + 0.7 * blob(0.7, 0.62, 0.35, 0.13) +
    0.5 * std::exp(-std::pow((shell - 0.38) / 0.05, 2)) - 0.25 * blob(0.5, 0.5, 0.9, 0.2);
  return std::clamp(value - 0.02, 0.0, 1.0);
}

vtkSmartPointer<vtkImageData> MakeImage(const ImageOptions& options, const UnitField& field)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  const auto& n = options.Dimensions;
  const auto& start = options.ExtentStart;
  const int more = options.CellData ? 0 : -1;
  image->SetExtent(start[0], start[0] + n[0] + more, start[1], start[1] + n[1] + more, start[2],
    start[2] + n[2] + more);
  image->SetOrigin(options.Origin.data());
  image->SetSpacing(options.Spacing.data());
  image->SetDirectionMatrix(options.Direction.data());
  vtkSmartPointer<vtkDataArray> scalars =
    vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(ToVTK(options.Type)));
  scalars->SetName("scalars");
  scalars->SetNumberOfTuples(vtkIdType{ n[0] } * n[1] * n[2]);
  const bool whole = !IsFloat(options.Type);
  vtkIdType i = 0;
  for (int z = 0; z < n[2]; ++z)
  {
    for (int y = 0; y < n[1]; ++y)
    {
      for (int x = 0; x < n[0]; ++x, ++i)
      {
        const double unit = field((x + 0.5) / n[0], (y + 0.5) / n[1], (z + 0.5) / n[2]);
        double value = options.Low + unit * (options.High - options.Low);
        value = whole ? std::round(value) : value;
        const unsigned clump =
          static_cast<unsigned>(x / 3 * 73 + y / 3 * 179 + z / 3 * 283) * 2654435761u;
        if (!whole && (clump >> 16) % 1000 < 1000 * options.ShareOfNaN)
        {
          value = std::nan("");
        }
        scalars->SetComponent(i, 0, value);
      }
    }
  }
  if (options.CellData)
  {
    image->GetCellData()->SetScalars(scalars);
  }
  else
  {
    image->GetPointData()->SetScalars(scalars);
  }
  return image;
}

double NoiseField(double x, double y, double z)
{
  std::uint64_t hash = 0;
  for (const double place : { x, y, z })
  {
    hash = (hash ^ static_cast<std::uint64_t>(place * 1e6)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 29;
  }
  return std::ldexp(static_cast<double>(hash >> 11), -53);
}

vtkSmartPointer<vtkImageData> WithWideScalars(vtkImageData* image)
{
  auto wide = vtkSmartPointer<vtkImageData>::New();
  wide->ShallowCopy(image);
  const auto convert = [](vtkDataSetAttributes* data)
  {
    vtkDataArray* from = data->GetScalars();
    if (!from || from->GetDataTypeSize() != 1)
    {
      return;
    }
    vtkSmartPointer<vtkDataArray> to =
      vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(
        from->GetDataType() == VTK_UNSIGNED_CHAR ? VTK_UNSIGNED_SHORT : VTK_SHORT));
    to->DeepCopy(from);
    data->SetScalars(to);
  };
  convert(wide->GetPointData());
  convert(wide->GetCellData());
  return wide;
}

std::shared_ptr<BrickSource> SourceOfImage(vtkImageData* image, int brickSize, bool cellData)
{
  vtkSmartPointer<vtkDataArray> scalars =
    cellData ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars();
  const int* extent = image->GetExtent();
  int dims[3];
  image->GetDimensions(dims);
  ArrayDescription array;
  array.Data = scalars->GetVoidPointer(0);
  array.Owner = std::shared_ptr<const void>(array.Data, [scalars](const void*) {});
  array.Type = FromVTK(scalars->GetDataType()).value_or(ScalarType::UInt8);
  array.Components = scalars->GetNumberOfComponents();
  array.BrickSize = brickSize;
  array.CellData = cellData;
  std::copy_n(image->GetDirectionMatrix()->GetData(), 9, array.Direction.begin());
  for (std::size_t a = 0; a < 3; ++a)
  {
    array.Dimensions[a] = cellData ? dims[a] - 1 : dims[a];
    array.Spacing[a] = image->GetSpacing()[a];
    array.ExtentStart[a] = extent[2 * a];
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    array.Origin[a] = image->GetOrigin()[a];
    for (std::size_t b = 0; b < 3; ++b)
    {
      array.Origin[a] +=
        array.Direction[3 * a + b] * array.Spacing[b] * (extent[2 * b] + (cellData ? 0.5 : 0.0));
    }
  }
  array.Range = ValueRange::Void();
  for (int c = 0; c < array.Components; ++c)
  {
    double range[2];
    scalars->GetRange(range, c);
    array.ComponentRanges.push_back({ range[0], range[1] });
    array.Range.Include(array.ComponentRanges.back());
  }
  auto source = ArrayBrickSource::Make(array);
  return source ? std::shared_ptr<BrickSource>(source.Value()) : nullptr;
}

vtkSmartPointer<vtkImageData> LoadBrain(int step, const std::array<int, 3>& dimensions)
{
  const char* file = "/usr/share/mricron/templates/ch2better.nii.gz";
  if (!std::filesystem::exists(file))
  {
    return nullptr;
  }
  vtkNew<vtkNIFTIImageReader> reader;
  reader->SetFileName(file);
  reader->Update();
  int extent[6];
  reader->GetOutput()->GetExtent(extent);
  int part[6];
  for (std::size_t a = 0; a < 3; ++a)
  {
    const int size = extent[2 * a + 1] - extent[2 * a] + 1;
    const int wanted = std::min(size, dimensions[a] * step);
    part[2 * a] = extent[2 * a] + (size - wanted) / 2;
    part[2 * a + 1] = part[2 * a] + wanted - 1;
  }
  vtkNew<vtkExtractVOI> extract;
  extract->SetInputConnection(reader->GetOutputPort());
  extract->SetVOI(part);
  extract->SetSampleRate(step, step, step);
  extract->Update();
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->DeepCopy(extract->GetOutput());
  image->SetExtent(0, image->GetDimensions()[0] - 1, 0, image->GetDimensions()[1] - 1, 0,
    image->GetDimensions()[2] - 1);
  image->SetOrigin(0, 0, 0);
  image->SetSpacing(1, 1, 1);
  return image;
}

TransferNodes BrainTransfer()
{
  TransferNodes nodes;
  nodes.Opacity = { { 0, 0 }, { 60, 0 }, { 90, 0.05 }, { 130, 0.25 }, { 255, 0.8 } };
  nodes.Color = { { 0, 0, 0, 0 }, { 60, 0.5, 0.2, 0.1 }, { 120, 0.9, 0.7, 0.6 },
    { 255, 1, 1, 0.95 } };
  return nodes;
}

} // namespace teravox::test
