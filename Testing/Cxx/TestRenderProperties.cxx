// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contract 9: nothing is ignored in silence. Each inherited property, set to something else than
// its default, changes the picture or is named in exactly one warning.
#include "ComponentScene.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <functional>
#include <gtest/gtest.h>
#include <vtkColorTransferFunction.h>
#include <vtkCommand.h>
#include <vtkContourValues.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkOpenGLShaderProperty.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

class WarningRecorder : public vtkCommand
{
public:
  static WarningRecorder* New() { return new WarningRecorder; }
  void Execute(vtkObject*, unsigned long event, void* data) override
  {
    (event == vtkCommand::WarningEvent ? this->Warnings : this->Errors)
      .emplace_back(static_cast<const char*>(data));
  }
  std::vector<std::string> Warnings;
  std::vector<std::string> Errors;
};

struct Property
{
  const char* Name; ///< as it must appear in the warning
  std::function<void(Stage&)> Set;
  bool Shade = false;
  bool ToImage = false; ///< it matters with RenderToImage only
  int Components = 1;
  bool GradientOpacity = false; ///< there is one from the begin
  bool Labels = false;          ///< there is a label mask from the begin, label 1 has a function
};

// What is seen: the window, and the depth image where one is asked for.
std::vector<float> PictureOf(Stage& stage)
{
  std::vector<float> picture = stage.DrawPicture();
  if (stage.Mapper->GetRenderToImage())
  {
    vtkNew<vtkImageData> depth;
    stage.Mapper->GetDepthImage(depth);
    vtkDataArray* scalars = depth->GetPointData()->GetScalars();
    for (vtkIdType i = 0; i < scalars->GetNumberOfTuples(); ++i)
    {
      picture.push_back(static_cast<float>(scalars->GetComponent(i, 0)));
    }
  }
  return picture;
}

vtkSmartPointer<vtkImageData> Mask()
{
  ImageOptions options;
  options.High = 1;
  return MakeImage(options, [](double x, double, double) { return x > 0.5 ? 1.0 : 0.0; });
}

std::array<double, 4> ByBoth(double value, double second)
{
  return { second, value, 0.5, 0.2 * value * second };
}

std::vector<Property> Properties()
{
  using M = vtkGPUVolumeRayCastMapper;
  return {
    { "BlendMode", [](Stage& s) { s.Mapper->SetBlendModeToMaximumIntensity(); } },
    { "Cropping",
      [](Stage& s)
      {
        s.Mapper->SetCropping(1);
        s.Mapper->SetCroppingRegionPlanes(10, 20, 10, 20, 10, 20);
        s.Mapper->SetCroppingRegionFlagsToSubVolume();
      } },
    { "ClippingPlanes",
      [](Stage& s)
      {
        vtkNew<vtkPlane> plane;
        plane->SetOrigin(20, 18, 22);
        plane->SetNormal(1, 0, 0);
        s.Mapper->AddClippingPlane(plane);
      } },
    { "MaskInput and MaskType",
      [](Stage& s)
      {
        s.Mapper->SetMaskInput(Mask());
        s.Mapper->SetMaskTypeToBinary();
      } },
    { "MaskInput with BlendMode",
      [](Stage& s)
      {
        s.Mapper->SetMaskInput(Mask());
        s.Mapper->SetMaskTypeToBinary();
        s.Mapper->SetBlendModeToMaximumIntensity();
      } },
    { "MaskBlendFactor", [](Stage& s) { s.Mapper->SetMaskBlendFactor(0.5f); }, false, false, 1,
      false, true },
    { "UseJittering", [](Stage& s) { s.Mapper->UseJitteringOn(); } },
    { "UseDepthPass", [](Stage& s) { s.Mapper->UseDepthPassOn(); } },
    { "RenderToImage", [](Stage& s) { s.Mapper->RenderToImageOn(); } },
    { "ClampDepthToBackface", [](Stage& s) { s.Mapper->SetClampDepthToBackface(1); }, false, true },
    { "DepthImageScalarType", [](Stage& s) { s.Mapper->SetDepthImageScalarTypeToUnsignedChar(); },
      false, true },
    { "FinalColorWindow", [](Stage& s) { s.Mapper->SetFinalColorWindow(0.5f); } },
    { "FinalColorLevel", [](Stage& s) { s.Mapper->SetFinalColorLevel(0.2f); } },
    { "FinalColorWindow of 0", [](Stage& s) { s.Mapper->SetFinalColorWindow(0); } },
    { "ImageSampleDistance", [](Stage& s) { s.Mapper->SetImageSampleDistance(2); } },
    { "MinimumImageSampleDistance", [](Stage& s) { s.Mapper->SetMinimumImageSampleDistance(2); } },
    // AutoAdjustSampleDistances and MaximumImageSampleDistance: TestRenderLattice.cxx.
    { "LockSampleDistanceToInputSpacing",
      [](Stage& s) { s.Mapper->SetLockSampleDistanceToInputSpacing(1); } },
    { "SampleDistance", [](Stage& s) { s.Mapper->SetSampleDistance(0.3f); } },
    { "ReportProgress", [](Stage& s) { s.Mapper->SetReportProgress(false); } },
    { "ColorRangeType", [](Stage& s) { s.Mapper->SetColorRangeType(M::NATIVE); } },
    { "ScalarOpacityRangeType", [](Stage& s) { s.Mapper->SetScalarOpacityRangeType(M::NATIVE); } },
    { "Transfer2DYAxisArray",
      [](Stage& s)
      {
        s.SetTransferImage(8, 8, ByBoth);
        s.Mapper->SetTransfer2DYAxisArray("other");
      } },
    { "Transfer2DYAxisArray of the image",
      [](Stage& s)
      {
        s.SetTransferImage(8, 8, ByBoth);
        s.Mapper->SetTransfer2DYAxisArray(
          s.Mapper->GetInput()->GetPointData()->GetScalars()->GetName());
      } },
    { "AverageIPScalarRange",
      [](Stage& s)
      {
        s.Mapper->SetBlendModeToAverageIntensity();
        s.Mapper->SetAverageIPScalarRange(3, 100);
      } },
    { "GradientOpacity",
      [](Stage& s) {
        s.SetGradientOpacity({ { 0, 0 }, { 20, 1 } });
      } },
    { "DisableGradientOpacity", [](Stage& s) { s.Property->DisableGradientOpacityOn(); }, false,
      false, 1, true },
    { "GradientOpacityRangeType",
      [](Stage& s) { s.Mapper->SetGradientOpacityRangeType(M::NATIVE); }, false, false, 1, true },
    { "GradientOpacity",
      [](Stage& s) {
        s.SetGradientOpacity({ { 0, 0 }, { 20, 1 } });
      },
      false, false, 2 },
    { "GradientOpacity in this BlendMode",
      [](Stage& s) { s.Mapper->SetBlendModeToMaximumIntensity(); }, false, false, 1, true },
    { "GradientOpacity with MaskInput",
      [](Stage& s)
      {
        s.Mapper->SetMaskInput(Mask());
        s.Mapper->SetMaskTypeToBinary();
      },
      false, false, 1, true },
    // As in VTK, of one component neither changes anything.
    { "IndependentComponents", [](Stage& s) { s.Property->IndependentComponentsOff(); }, false,
      false, 2 },
    { "IndependentComponents", [](Stage& s) { s.Property->IndependentComponentsOff(); }, false,
      false, 3 },
    { "ComponentWeight", [](Stage& s) { s.Property->SetComponentWeight(1, 0.5); }, false, false,
      2 },
    { "BlendMode", [](Stage& s) { s.Mapper->SetBlendModeToMaximumIntensity(); }, false, false, 2 },
    { "ScalarOpacity", [](Stage& s) { s.Property->GetScalarOpacity(1)->AddPoint(120, 1); }, false,
      false, 2 },
    { "ScalarOpacityUnitDistance",
      [](Stage& s) { s.Property->SetScalarOpacityUnitDistance(1, 0.2); }, false, false, 2 },
    { "Ambient", [](Stage& s) { s.Property->SetAmbient(1, 0.9); }, true, false, 2 },
    { "SpecularPower", [](Stage& s) { s.Property->SetSpecularPower(1, 60); }, true, false, 2 },
    { "VectorMode", [](Stage& s) { s.Mapper->SetVectorMode(vtkOutOfCoreVolumeMapper::MAGNITUDE); },
      false, false, 2 },
    { "VectorComponent",
      [](Stage& s)
      {
        s.Mapper->SetVectorMode(vtkOutOfCoreVolumeMapper::COMPONENT);
        s.Mapper->SetVectorComponent(1);
      },
      false, false, 2 },
    // UseClippedVoxelIntensity and ClippedVoxelIntensity: TestRenderClippedGradient.cxx.
    { "UseClippedVoxelIntensity of more than 16 planes",
      [](Stage& s)
      {
        for (int i = 0; i < 17; ++i)
        {
          vtkNew<vtkPlane> plane;
          plane->SetOrigin(i, 0, 0);
          plane->SetNormal(1, 0, 0);
          s.Mapper->AddClippingPlane(plane);
        }
        s.Property->UseClippedVoxelIntensityOn();
      },
      true },
    { "SliceFunction",
      [](Stage& s)
      {
        vtkNew<vtkPlane> plane;
        plane->SetOrigin(20, 18, 22);
        s.Mapper->SetBlendModeToSlice();
        s.Property->SetSliceFunction(plane);
      } },
    { "IsoSurfaceValues",
      [](Stage& s)
      {
        s.Mapper->SetBlendModeToIsoSurface();
        s.Property->GetIsoSurfaceValues()->SetValue(0, 120);
      } },
    // Without a function there is no slice.
    { "SliceFunction", [](Stage& s) { s.Mapper->SetBlendModeToSlice(); } },
    { "LabelScalarOpacity", [](Stage& s) { s.Property->SetLabelScalarOpacity(1, s.Opacity); },
      false, false, 1, false, true },
    { "LabelColor",
      [](Stage& s)
      {
        vtkNew<vtkColorTransferFunction> red;
        red->AddRGBPoint(0, 1, 0, 0);
        s.Property->SetLabelColor(1, red);
      },
      false, false, 1, false, true },
    { "LabelGradientOpacity",
      [](Stage& s)
      {
        vtkNew<vtkPiecewiseFunction> half;
        half->AddPoint(0, 0.5);
        s.Property->SetLabelGradientOpacity(1, half);
      },
      false, false, 1, false, true },
    { "ShaderProperty",
      [](Stage& s)
      {
        vtkNew<vtkOpenGLShaderProperty> shader;
        shader->AddFragmentShaderReplacement("//VTK::Base::Dec", true, "//VTK::Base::Dec\n", false);
        s.Volume->SetShaderProperty(shader);
      } },
    { "Lights",
      [](Stage& s)
      {
        vtkNew<vtkLight> light;
        light->SetLightTypeToSceneLight();
        light->SetPosition(100, 0, 0);
        s.Renderer->AddLight(light);
      },
      true },
    // These must change the picture.
    { "Shade", [](Stage& s) { s.Property->ShadeOn(); } },
    { "Ambient", [](Stage& s) { s.Property->SetAmbient(0.9); }, true },
    { "Diffuse", [](Stage& s) { s.Property->SetDiffuse(0.1); }, true },
    { "Specular", [](Stage& s) { s.Property->SetSpecular(0.9); }, true },
    { "SpecularPower", [](Stage& s) { s.Property->SetSpecularPower(60); }, true },
    { "InterpolationType", [](Stage& s) { s.Property->SetInterpolationTypeToNearest(); } },
    { "ScalarOpacityUnitDistance",
      [](Stage& s) { s.Property->SetScalarOpacityUnitDistance(0.2); } },
    { "ScalarOpacity", [](Stage& s) { s.Opacity->AddPoint(120, 1); } },
    { "Color",
      [](Stage& s)
      {
        vtkNew<vtkPiecewiseFunction> gray;
        gray->AddPoint(0, 1);
        gray->AddPoint(255, 0);
        s.Property->SetColor(gray);
      } },
    { "Visibility", [](Stage& s) { s.Volume->SetVisibility(0); } },
    { "LevelOfDetailBias", [](Stage& s) { s.Mapper->SetLevelOfDetailBias(3); } },
    { "MinimumLevel", [](Stage& s) { s.Mapper->SetMinimumLevel(1); } },
    { "ImageErrorTolerance", [](Stage& s) { s.Mapper->SetImageErrorTolerance(0.2); } },
  };
}

} // namespace

// All in one process, because each takes a moment only.
TEST(Contract9, EachPropertyChangesThePictureOrWarnsOnce)
{
  for (const Property& property : Properties())
  {
    Stage stage(48, 48);
    stage.Mapper->SetBrickSize(16);
    if (property.Components == 1)
    {
      stage.SetImage(MakeImage({}));
      stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    }
    else
    {
      stage.SetImage(MakeComponentImage({}, property.Components));
      const auto components = static_cast<std::size_t>(property.Components);
      SetComponentTransfer(
        stage, std::vector<OpacityShape>(components, OpacityShape::Ramp), 0, 255, 1);
    }
    stage.SetShade(property.Shade);
    if (property.GradientOpacity)
    {
      stage.SetGradientOpacity({ { 2, 0 }, { 14, 1 } });
    }
    if (property.Labels)
    {
      vtkNew<vtkPiecewiseFunction> faint;
      faint->AddPoint(0, 0.01);
      stage.Property->SetLabelScalarOpacity(1, faint);
      stage.Mapper->SetMaskInput(Mask());
      stage.Mapper->SetMaskTypeToLabelMap();
    }
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    vtkNew<WarningRecorder> recorder;
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, recorder);
    stage.Mapper->AddObserver(vtkCommand::ErrorEvent, recorder);
    stage.Mapper->SetRenderToImage(property.ToImage ? 1 : 0);
    const std::vector<float> before = PictureOf(stage);
    EXPECT_TRUE(recorder->Warnings.empty()) << property.Name << ": " << recorder->Warnings[0];
    property.Set(stage);
    const std::vector<float> after = PictureOf(stage);
    stage.DrawPicture();
    const bool changed = !AreImagesIdentical(before, after);
    int naming = 0;
    for (const std::string& warning : recorder->Warnings)
    {
      naming += warning.find(property.Name) != std::string::npos ? 1 : 0;
    }
    EXPECT_TRUE((changed && recorder->Warnings.empty()) || naming == 1)
      << property.Name << (changed ? ": changed" : ": same picture") << ", " << naming
      << " warnings by name of " << recorder->Warnings.size();
    EXPECT_TRUE(recorder->Errors.empty()) << property.Name << ": " << recorder->Errors[0];
  }
}
