// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKScalarType.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkHDF5PyramidWriter.h"
#include "vtkProceduralVolumeSource.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <vtkCallbackCommand.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageAlgorithm.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMath.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

namespace
{

using teravox::test::AnySourceAlgorithm;
using teravox::test::ErrorRecorder;
using teravox::test::FreshFileName;
using teravox::test::IndexBrickSource;
using teravox::test::MakeRandomImage;

/// Passes an image through, piece by piece, and remembers the largest piece that was asked for.
class PieceCounter : public vtkImageAlgorithm
{
public:
  static PieceCounter* New();
  vtkTypeMacro(PieceCounter, vtkImageAlgorithm);

  vtkIdType LargestPiece = 0;
  int Pieces = 0;
  bool FailLater = false;

protected:
  int RequestData(
    vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override
  {
    vtkImageData* input = vtkImageData::GetData(inputs[0]);
    vtkImageData* output = vtkImageData::GetData(outputs);
    int extent[6];
    outputs->GetInformationObject(0)->Get(
      vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent);
    output->ShallowCopy(input);
    output->Crop(extent);
    this->LargestPiece = std::max(this->LargestPiece, output->GetNumberOfPoints());
    if (++this->Pieces > 3 && this->FailLater)
    {
      vtkErrorMacro("The disk burnt.");
      return 0;
    }
    return 1;
  }
};
vtkStandardNewMacro(PieceCounter);

void ExpectSameArray(vtkDataArray* a, vtkDataArray* b)
{
  ASSERT_NE(a, nullptr);
  ASSERT_NE(b, nullptr);
  ASSERT_EQ(a->GetDataType(), b->GetDataType());
  ASSERT_EQ(a->GetNumberOfComponents(), b->GetNumberOfComponents());
  ASSERT_EQ(a->GetNumberOfTuples(), b->GetNumberOfTuples());
  EXPECT_EQ(std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0),
              static_cast<std::size_t>(a->GetNumberOfValues()) *
                static_cast<std::size_t>(a->GetDataTypeSize())),
    0);
}

void ExpectSameImage(vtkImageData* a, vtkImageData* b, bool cells)
{
  for (int i = 0; i < 6; ++i)
  {
    EXPECT_EQ(a->GetExtent()[i], b->GetExtent()[i]);
  }
  for (int corner : { 0, 1 })
  {
    const double index[3] = { a->GetExtent()[corner] + 0.0, a->GetExtent()[2 + corner] + 0.0,
      a->GetExtent()[4 + corner] + 0.0 };
    double pa[3];
    double pb[3];
    a->TransformContinuousIndexToPhysicalPoint(index, pa);
    b->TransformContinuousIndexToPhysicalPoint(index, pb);
    EXPECT_NEAR(vtkMath::Distance2BetweenPoints(pa, pb), 0.0, 1e-20);
  }
  ExpectSameArray(cells ? a->GetCellData()->GetScalars() : a->GetPointData()->GetScalars(),
    cells ? b->GetCellData()->GetScalars() : b->GetPointData()->GetScalars());
}

TEST(VTKPyramidFile, RoundTripOfEveryTypeWithGeometry)
{
  const std::string file = FreshFileName("roundtrip.h5");
  const int extent[6] = { -3, 66, 10, 40, 0, 47 };
  unsigned seed = 1;
  for (const teravox::ScalarType type : teravox::AllScalarTypes)
  {
    for (const bool cells : { false, true })
    {
      const auto image = MakeRandomImage(teravox::ToVTK(type), extent, 1, cells, ++seed);
      image->SetOrigin(1, 2, 3);
      image->SetSpacing(0.5, 0.25, 4);
      image->SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1);
      vtkNew<vtkHDF5PyramidWriter> writer;
      vtkNew<ErrorRecorder> errors;
      errors->Observe(writer);
      writer->SetInputData(image);
      writer->SetFileName(file.c_str());
      writer->SetBrickSize(32);
      ASSERT_EQ(writer->Write(), 1) << (errors->Errors.empty() ? "" : errors->Errors[0]);
      vtkNew<vtkHDF5PyramidReader> reader;
      errors->Observe(reader);
      reader->SetFileName(file.c_str());
      reader->SetLevel(0);
      reader->Update();
      ASSERT_TRUE(errors->Errors.empty()) << errors->Errors[0];
      ExpectSameImage(image, reader->GetOutput(), cells);
      vtkDataArray* array = cells ? reader->GetOutput()->GetCellData()->GetScalars()
                                  : reader->GetOutput()->GetPointData()->GetScalars();
      EXPECT_STREQ(array->GetName(), "density");
      EXPECT_NE(vtkBrickSource::Get(array), nullptr);
      EXPECT_EQ(reader->GetNumberOfLevels(), writer->GetNumberOfLevels());
    }
  }
}

TEST(VTKPyramidFile, EveryCompressionAndSeveralComponents)
{
  const std::string file = FreshFileName("compressed.h5");
  const int extent[6] = { 0, 40, 0, 33, 0, 20 };
  for (const int compression :
    { vtkHDF5PyramidWriter::NONE, vtkHDF5PyramidWriter::DEFLATE, vtkHDF5PyramidWriter::LZ4 })
  {
    const auto image = MakeRandomImage(VTK_UNSIGNED_SHORT, extent, 3, false, 5);
    vtkNew<vtkHDF5PyramidWriter> writer;
    writer->SetInputData(image);
    writer->SetFileName(file.c_str());
    writer->SetBrickSize(16);
    writer->SetCompression(compression);
    writer->SetCompressionLevel(3);
    ASSERT_EQ(writer->Write(), 1);
    EXPECT_EQ(writer->GetBytesDone(), writer->GetBytesTotal());
    EXPECT_EQ(writer->GetBytesTotal(), 41ull * 34 * 21 * 6);
    EXPECT_EQ(writer->GetFileBytes(), std::filesystem::file_size(file));
    vtkNew<vtkHDF5PyramidReader> reader;
    reader->SetFileName(file.c_str());
    reader->SetLevel(0);
    reader->SetBrickSize(24);
    reader->Update();
    ExpectSameImage(image, reader->GetOutput(), false);
  }
}

TEST(VTKPyramidFile, StreamingInputIsNeverHeldAsAWhole)
{
  const std::string whole = FreshFileName("whole.h5");
  const std::string streamed = FreshFileName("streamed.h5");
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunction(vtkProceduralVolumeSource::MARSCHNER_LOBB);
  source->SetDimensions(400, 360, 300);
  source->SetLevel(0);
  vtkNew<PieceCounter> counter;
  counter->SetInputConnection(source->GetOutputPort());
  for (const bool small : { false, true })
  {
    counter->LargestPiece = 0;
    counter->Modified();
    vtkNew<vtkHDF5PyramidWriter> writer;
    vtkNew<ErrorRecorder> errors;
    errors->Observe(writer);
    writer->SetInputConnection(counter->GetOutputPort());
    writer->SetFileName(small ? streamed.c_str() : whole.c_str());
    writer->SetMemoryLimit(small ? 40ull << 20 : 1ull << 30);
    ASSERT_EQ(writer->Write(), 1) << (errors->Errors.empty() ? "" : errors->Errors[0]);
    if (small)
    {
      EXPECT_LE(counter->LargestPiece, vtkIdType{ 5 } << 20);
      EXPECT_GT(counter->Pieces, 2);
    }
    else
    {
      EXPECT_EQ(counter->LargestPiece, vtkIdType{ 400 } * 360 * 300);
    }
  }
  vtkNew<vtkHDF5PyramidReader> a;
  vtkNew<vtkHDF5PyramidReader> b;
  a->SetFileName(whole.c_str());
  b->SetFileName(streamed.c_str());
  ASSERT_EQ(a->GetNumberOfLevels(), b->GetNumberOfLevels());
  for (int level = 0; level < a->GetNumberOfLevels(); ++level)
  {
    a->SetLevel(level);
    b->SetLevel(level);
    a->Update();
    b->Update();
    ExpectSameImage(a->GetOutput(), b->GetOutput(), false);
  }
  source->Update();
  a->SetLevel(0);
  a->Update();
  ExpectSameArray(source->GetOutput()->GetPointData()->GetScalars(),
    a->GetOutput()->GetPointData()->GetScalars());
}

TEST(VTKPyramidFile, DownsamplingByModeKeepsLabels)
{
  const std::string file = FreshFileName("labels.h5");
  const int extent[6] = { 0, 31, 0, 31, 0, 31 };
  const auto image = MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 9);
  vtkDataArray* labels = image->GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < labels->GetNumberOfTuples(); ++i)
  {
    labels->SetComponent(i, 0, labels->GetComponent(i, 0) < 100 ? 10 : 200);
  }
  vtkNew<vtkHDF5PyramidWriter> writer;
  writer->SetInputData(image);
  writer->SetFileName(file.c_str());
  writer->SetBrickSize(16);
  writer->SetDownsamplingToMode();
  ASSERT_EQ(writer->Write(), 1);
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(file.c_str());
  reader->SetLevel(1);
  reader->Update();
  vtkDataArray* coarse = reader->GetOutput()->GetPointData()->GetScalars();
  ASSERT_EQ(coarse->GetNumberOfTuples(), 16 * 16 * 16);
  for (vtkIdType i = 0; i < coarse->GetNumberOfTuples(); ++i)
  {
    const double label = coarse->GetComponent(i, 0);
    ASSERT_TRUE(label == 10 || label == 200) << label;
  }
}

TEST(VTKPyramidFile, ProgressIsReportedAndAbortLeavesNothing)
{
  const std::string file = FreshFileName("aborted.h5");
  const int extent[6] = { 0, 127, 0, 127, 0, 127 };
  const auto image = MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 11);
  vtkNew<vtkHDF5PyramidWriter> writer;
  writer->SetInputData(image);
  writer->SetFileName(file.c_str());
  std::vector<double> fractions;
  vtkNew<vtkCallbackCommand> progress;
  progress->SetClientData(&fractions);
  progress->SetCallback([](vtkObject*, unsigned long, void* client, void* data)
    { static_cast<std::vector<double>*>(client)->push_back(*static_cast<double*>(data)); });
  const unsigned long tag = writer->AddObserver(vtkCommand::ProgressEvent, progress);
  ASSERT_EQ(writer->Write(), 1);
  ASSERT_FALSE(fractions.empty());
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1.0);
  writer->RemoveObserver(tag);
  std::filesystem::remove(file);
  vtkNew<vtkCallbackCommand> abort;
  abort->SetCallback([](vtkObject* caller, unsigned long, void*, void*)
    { static_cast<vtkAlgorithm*>(caller)->SetAbortExecute(1); });
  writer->AddObserver(vtkCommand::ProgressEvent, abort);
  writer->SetBrickSize(16);
  writer->SetMemoryLimit(16ull << 20);
  EXPECT_EQ(writer->Write(), 0);
  for (const auto& entry :
    std::filesystem::directory_iterator(std::filesystem::path(file).parent_path()))
  {
    EXPECT_EQ(entry.path().string().find("aborted"), std::string::npos) << entry.path();
  }
}

TEST(VTKPyramidFile, WriterErrorsAreReported)
{
  const int extent[6] = { 0, 19, 0, 19, 0, 19 };
  const auto good = MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 3);
  const auto expect = [&](const char* text, const auto& setUp)
  {
    vtkNew<vtkHDF5PyramidWriter> writer;
    vtkNew<ErrorRecorder> errors;
    errors->Observe(writer);
    writer->SetInputData(good);
    writer->SetFileName(FreshFileName("bad.h5").c_str());
    setUp(writer.Get());
    EXPECT_EQ(writer->Write(), 0) << text;
    ASSERT_EQ(errors->Errors.size(), 1u) << text;
    EXPECT_NE(errors->Errors[0].find(text), std::string::npos) << errors->Errors[0];
  };
  expect("file name", [](auto* w) { w->SetFileName(nullptr); });
  expect("no input", [](auto* w) { w->SetInputConnection(nullptr); });
  expect("/nowhere/", [](auto* w) { w->SetFileName("/nowhere/x.h5"); });
  expect("brick", [](auto* w) { w->SetBrickSize(7); });
  expect("no array \"absent\"", [](auto* w) { w->SetArrayName("absent"); });
  expect("bytes", [](auto* w) { w->SetMemoryLimit(1000); });
  vtkNew<vtkImageData> empty;
  expect("no voxels", [&](auto* w) { w->SetInputData(empty); });
  const auto wide = MakeRandomImage(VTK_LONG_LONG, extent, 1, false, 3);
  expect("long long", [&](auto* w) { w->SetInputData(wide); });
  const auto five = MakeRandomImage(VTK_FLOAT, extent, 5, false, 3);
  expect("5 components", [&](auto* w) { w->SetInputData(five); });
  const auto singular = MakeRandomImage(VTK_FLOAT, extent, 1, false, 3);
  singular->SetDirectionMatrix(1, 0, 0, 1, 0, 0, 0, 0, 1);
  expect("singular", [&](auto* w) { w->SetInputData(singular); });
  const auto negative = MakeRandomImage(VTK_FLOAT, extent, 1, false, 3);
  negative->SetSpacing(1, -1, 1);
  expect("spacing", [&](auto* w) { w->SetInputData(negative); });
}

TEST(VTKPyramidFile, FailureOfTheInputIsReportedAndLeavesNothing)
{
  const std::string file = FreshFileName("burnt.h5");
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetDimensions(400, 360, 300);
  source->SetLevel(0);
  vtkNew<PieceCounter> counter;
  counter->FailLater = true;
  counter->SetInputConnection(source->GetOutputPort());
  vtkNew<vtkHDF5PyramidWriter> writer;
  vtkNew<ErrorRecorder> errors;
  errors->Observe(writer);
  errors->Observe(counter->GetExecutive());
  writer->SetInputConnection(counter->GetOutputPort());
  writer->SetFileName(file.c_str());
  writer->SetMemoryLimit(40ull << 20);
  EXPECT_EQ(writer->Write(), 0);
  const bool named = std::any_of(errors->Errors.begin(), errors->Errors.end(),
    [](const std::string& e) { return e.find("The disk burnt.") != std::string::npos; });
  EXPECT_TRUE(named) << errors->Errors.size();
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(VTKPyramidFile, ReaderErrorsAreReportedWithoutACrash)
{
  const auto expect = [&](const std::string& file, const char* dataset, const char* text)
  {
    vtkNew<vtkHDF5PyramidReader> reader;
    vtkNew<ErrorRecorder> errors;
    errors->Observe(reader);
    errors->Observe(reader->GetExecutive());
    reader->SetFileName(file.c_str());
    reader->SetDatasetPath(dataset);
    EXPECT_EQ(reader->CanReadFile(file.c_str()), 0);
    EXPECT_TRUE(errors->Errors.empty());
    reader->Update();
    ASSERT_FALSE(errors->Errors.empty()) << text;
    EXPECT_NE(errors->Errors[0].find(text), std::string::npos) << errors->Errors[0];
    EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 0);
  };
  expect("", "", "No file name");
  expect(FreshFileName("absent.h5"), "", "absent.h5");
  const std::string text = FreshFileName("text.h5");
  std::ofstream(text) << "This is no HDF5 file.";
  expect(text, "", "text.h5");
  const std::string file = FreshFileName("good.h5");
  const int extent[6] = { 0, 63, 0, 63, 0, 63 };
  vtkNew<vtkHDF5PyramidWriter> writer;
  writer->SetInputData(MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 3));
  writer->SetFileName(file.c_str());
  ASSERT_EQ(writer->Write(), 1);
  expect(file, "/no/such/dataset", "/no/such/dataset");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  expect(file, "", "good.h5");
}

TEST(VTKPyramidFile, ReplacedFileIsOpenedAgainAfterModified)
{
  const std::string file = FreshFileName("replaced.h5");
  const auto write = [&](int size)
  {
    const int extent[6] = { 0, size - 1, 0, 9, 0, 9 };
    vtkNew<vtkHDF5PyramidWriter> writer;
    writer->SetInputData(MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 3));
    writer->SetFileName(file.c_str());
    ASSERT_EQ(writer->Write(), 1);
  };
  write(20);
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetDimensions()[0], 20);
  const auto before = reader->GetBrickSource()->GetBrickSource();
  reader->Modified();
  reader->Update();
  EXPECT_EQ(reader->GetBrickSource()->GetBrickSource(), before); // the same file
  write(30);
  reader->Modified();
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetDimensions()[0], 30);
}

} // namespace
