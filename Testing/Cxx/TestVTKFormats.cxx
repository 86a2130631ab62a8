// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkOutOfCoreTransferFunction.h"

#include <cstring>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkVolumeProperty.h>

namespace teravox::testing
{
namespace
{

/// The output's voxels are those of an array.
void ExpectOutputIs(vtkHDF5PyramidReader* reader, const std::vector<std::byte>& array)
{
  vtkDataArray* scalars = reader->GetOutput()->GetPointData()->GetScalars();
  ASSERT_TRUE(scalars);
  ASSERT_EQ(static_cast<std::size_t>(scalars->GetNumberOfValues() * scalars->GetDataTypeSize()),
    array.size());
  EXPECT_EQ(std::memcmp(scalars->GetVoidPointer(0), array.data(), array.size()), 0);
}

TEST(VTKFormats, ThePipelinesTimeChoosesTheTimePoint)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const std::string name = files->File("small.ims");
  vtkNew<vtkHDF5PyramidReader> reader;
  EXPECT_EQ(reader->CanReadFile(name.c_str()), 1);
  reader->SetFileName(name.c_str());
  reader->SetChannel(1);
  reader->SetLevel(0);
  reader->UpdateInformation();
  vtkInformation* info = reader->GetOutputInformation(0);
  ASSERT_EQ(info->Length(vtkStreamingDemandDrivenPipeline::TIME_STEPS()), 3);
  const double* range = info->Get(vtkStreamingDemandDrivenPipeline::TIME_RANGE());
  EXPECT_EQ(range[0], 0.0);
  EXPECT_EQ(range[1], 2.0);
  // Each time its own voxels, also back and forth; between two steps the earlier one.
  for (const double time : { 0.0, 2.0, 1.0, 1.9, 0.0, 7.0, -3.0 })
  {
    SCOPED_TRACE(time);
    ASSERT_TRUE(reader->UpdateTimeStep(time));
    const int step = time < 1 ? 0 : time < 2 ? 1 : 2;
    ExpectOutputIs(reader, files->Array("small." + std::to_string(step) + ".1.0"));
    EXPECT_EQ(reader->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), step);
    const auto source =
      vtkBrickSource::Get(reader->GetOutput()->GetPointData()->GetScalars())->GetBrickSource();
    EXPECT_NE(source->Info().Name.find("TimePoint " + std::to_string(step)), std::string::npos);
  }
  // A time point that was set stays.
  reader->SetTimePoint(2);
  ASSERT_TRUE(reader->UpdateTimeStep(0.0));
  ExpectOutputIs(reader, files->Array("small.2.1.0"));
  reader->SetChannel(0);
  reader->Update();
  ExpectOutputIs(reader, files->Array("small.2.0.0"));
  EXPECT_EQ(reader->GetNumberOfChannels(), 2);
  EXPECT_EQ(reader->GetNumberOfTimePoints(), 3);
  EXPECT_EQ(reader->GetChannelName(1), "Membrane");
  EXPECT_EQ(reader->GetChannelName(2), "");
  EXPECT_NE(reader->GetDescriptionText().find("Taken as Imaris"), std::string::npos);
}

// 294 million voxels and one level: a coarse image is there without reading the fine one.
TEST(VTKFormats, LargeVolumesWithOneLevelHavePreviews)
{
  TERAVOX_FORMAT_FILES(files, "previews");
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(files->File("sparse.h5").c_str());
  EXPECT_TRUE(reader->GetPreviews());
  reader->SetLevel(3); // 75 x 88 x 88 voxels; stored are x 62...68, y 12...18, z 37...43
  reader->Update();
  int dimensions[3];
  reader->GetOutput()->GetDimensions(dimensions);
  EXPECT_EQ(dimensions[0], 75);
  EXPECT_EQ(dimensions[1], 88);
  EXPECT_EQ(dimensions[2], 88);
  EXPECT_EQ(reader->GetOutput()->GetScalarComponentAsDouble(64, 15, 40, 0), 200.0);
  EXPECT_EQ(reader->GetOutput()->GetScalarComponentAsDouble(64, 30, 40, 0), 9.0);
  reader->PreviewsOff();
  reader->UpdateInformation();
  EXPECT_EQ(reader->GetDescriptionText().find("preview"), std::string::npos);
  reader->PreviewsOn();
  reader->UpdateInformation();
  EXPECT_NE(reader->GetDescriptionText().find("preview"), std::string::npos);
}

TEST(VTKFormats, AChannelThatIsNotThereIsAnError)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  vtkNew<vtkHDF5PyramidReader> reader;
  vtkNew<test::ErrorRecorder> errors;
  errors->Observe(reader);
  reader->SetFileName(files->File("small.ims").c_str());
  reader->SetChannel(5);
  reader->Update();
  ASSERT_FALSE(errors->Errors.empty());
  EXPECT_NE(errors->Errors.front().find("no channel 5"), std::string::npos)
    << errors->Errors.front();
}

TEST(VTKFormats, DefaultTransferFunctions)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  // The file's window and colour.
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(files->File("small.ims").c_str());
  vtkNew<vtkVolumeProperty> property;
  vtkOutOfCoreTransferFunction::MakeAutomatic(reader->GetBrickSource(), property);
  vtkPiecewiseFunction* opacity = property->GetScalarOpacity();
  EXPECT_EQ(opacity->GetRange()[0], 1000.0);
  EXPECT_EQ(opacity->GetRange()[1], 40000.0);
  double color[3];
  property->GetRGBTransferFunction()->GetColor(40000.0, color);
  EXPECT_EQ(color[0], 1.0);
  EXPECT_EQ(color[1], 0.0);
  EXPECT_EQ(color[2], 0.5);
  // All channels at once: each has its own.
  reader->SetChannel(-1);
  vtkOutOfCoreTransferFunction::MakeAutomatic(reader->GetBrickSource(), property);
  EXPECT_EQ(property->GetIndependentComponents(), 1);
  for (int c = 0; c < 2; ++c)
  {
    EXPECT_EQ(property->GetScalarOpacity(c)->GetRange()[0], 1000.0 + c);
    EXPECT_EQ(property->GetScalarOpacity(c)->GetRange()[1], 40000.0 + c);
    property->GetRGBTransferFunction(c)->GetColor(40001.0, color);
    EXPECT_EQ(color[0], c == 0 ? 1.0 : 0.0);
    EXPECT_EQ(color[1], c == 0 ? 0.0 : 1.0);
    EXPECT_EQ(color[2], c == 0 ? 0.5 : 0.0);
    EXPECT_EQ(property->GetShade(c), 1);
  }
  reader->SetChannel(0);
  // Nothing is said: the voxels of the coarsest level decide, and no range is made up.
  reader->SetFileName(files->File("minimal.ims").c_str());
  vtkOutOfCoreTransferFunction::MakeAutomatic(reader->GetBrickSource(), property);
  opacity = property->GetScalarOpacity();
  EXPECT_GT(opacity->GetRange()[0], 10.0);
  EXPECT_LT(opacity->GetRange()[0], opacity->GetRange()[1]);
  EXPECT_LE(opacity->GetRange()[1], 256.0);
  EXPECT_FALSE(reader->GetBrickSource()->GetBrickSource()->Info().Range.IsKnown());
}

} // namespace
} // namespace teravox::testing
