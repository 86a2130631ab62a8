// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Parallel VTK images: the index and the pieces are texts that are written here.
#include "VTKTestSupport.h"
#include "vtkImagePiecesReader.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

namespace
{

using teravox::test::ErrorRecorder;
using teravox::test::FreshFileName;
using Extent = std::array<int, 6>;

constexpr Extent Whole{ -3, 7, 2, 10, 0, 6 };

int ValueAt(int x, int y, int z, bool cells)
{
  return x + 100 * y + 10000 * z + (cells ? 5 : 0);
}

std::string Text(const Extent& extent)
{
  std::string text;
  for (const int n : extent)
  {
    text += std::to_string(n) + " ";
  }
  return text;
}

/// The numbers of points or cells; `wrong` ones where x is below that.
std::string Numbers(const Extent& points, bool cells, int wrong)
{
  std::string text;
  const int less = cells ? 1 : 0;
  for (int z = points[4]; z <= points[5] - less; ++z)
  {
    for (int y = points[2]; y <= points[3] - less; ++y)
    {
      for (int x = points[0]; x <= points[1] - less; ++x)
      {
        text += std::to_string(x < wrong ? -1 : ValueAt(x, y, z, cells)) + " ";
      }
    }
  }
  return text;
}

void WritePiece(const std::string& name, const Extent& extent, int wrong = -1000,
  const std::string& type = "Int32")
{
  std::ofstream(name)
    << "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\">\n"
    << "<ImageData WholeExtent=\"" << Text(extent) << "\" Origin=\"9 9 9\" Spacing=\"9 9 9\">\n"
    << "<Piece Extent=\"" << Text(extent) << "\">\n<PointData>\n<DataArray type=\"" << type
    << "\" Name=\"p\" format=\"ascii\">" << Numbers(extent, false, wrong)
    << "</DataArray>\n</PointData>\n<CellData>\n<DataArray type=\"Int32\" Name=\"c\" "
       "format=\"ascii\">"
    << Numbers(extent, true, wrong)
    << "</DataArray>\n</CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n";
}

struct Pieces
{
  explicit Pieces(const std::string& name)
    : Folder(FreshFileName(name))
  {
    std::filesystem::create_directories(this->Folder);
  }
  std::string File(const std::string& name) const { return this->Folder + "/" + name; }
  void Add(const std::string& name, const Extent& extent)
  {
    this->List += "<Piece Extent=\"" + Text(extent) + "\" Source=\"" + name + "\"/>\n";
  }
  std::string Index(const std::string& attribute = "Scalars=\"p\"") const
  {
    std::ofstream(this->File("index.pvti"))
      << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PImageData\" version=\"0.1\">\n"
      << "<PImageData WholeExtent=\"" << Text(Whole)
      << "\" GhostLevel=\"1\" Origin=\"1 2 3\" Spacing=\"0.5 1 2\">\n<PPointData " << attribute
      << "><PDataArray type=\"Int32\" Name=\"p\"/></PPointData>\n<PCellData>"
      << "<PDataArray type=\"Int32\" Name=\"c\"/></PCellData>\n"
      << this->List << "</PImageData>\n</VTKFile>\n";
    return this->File("index.pvti");
  }

  std::string Folder;
  std::string List;
};

/// Three that overlap, the others wrong where the first one has voxels.
Pieces ThreePieces()
{
  Pieces pieces("pieces");
  const Extent first{ -3, 2, 2, 10, 0, 6 };
  const Extent second{ 1, 7, 2, 6, 0, 6 };
  const Extent third{ 0, 7, 5, 10, 0, 6 };
  WritePiece(pieces.File("first.vti"), first);
  WritePiece(pieces.File("second.vti"), second, 2);
  WritePiece(pieces.File("third.vti"), third, 2);
  pieces.Add("first.vti", first);
  pieces.Add("second.vti", second);
  pieces.Add("third.vti", third);
  return pieces;
}

void ExpectRight(vtkImagePiecesReader* reader, const Extent& extent, bool cells)
{
  vtkImageData* image = reader->GetOutput();
  Extent has{};
  image->GetExtent(has.data());
  ASSERT_EQ(has, extent);
  vtkDataArray* array =
    cells ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars();
  ASSERT_NE(array, nullptr);
  vtkIdType i = 0;
  vtkIdType wrong = 0;
  const int less = cells ? 1 : 0;
  for (int z = extent[4]; z <= extent[5] - less; ++z)
  {
    for (int y = extent[2]; y <= extent[3] - less; ++y)
    {
      for (int x = extent[0]; x <= extent[1] - less; ++x, ++i)
      {
        wrong += array->GetComponent(i, 0) == ValueAt(x, y, z, cells) ? 0 : 1;
      }
    }
  }
  EXPECT_EQ(array->GetNumberOfTuples(), i);
  EXPECT_EQ(wrong, 0);
}

TEST(VTKImagePieces, AnyExtentIsReadAndTheFirstPieceCounts)
{
  const Pieces pieces = ThreePieces();
  const std::string index = pieces.Index();
  EXPECT_EQ(vtkImagePiecesReader::CanReadFile(index.c_str()), 1);
  EXPECT_EQ(vtkImagePiecesReader::CanReadFile(pieces.File("first.vti").c_str()), 0);
  std::mt19937 random(3);
  for (const bool cells : { false, true })
  {
    SCOPED_TRACE(cells);
    const vtkNew<vtkImagePiecesReader> reader;
    reader->SetFileName(index.c_str());
    reader->SetArrayName(cells ? "c" : "");
    reader->Update();
    EXPECT_EQ(reader->GetNumberOfPieces(), 3);
    EXPECT_EQ(reader->GetPieceFileName(2), pieces.File("third.vti"));
    ExpectRight(reader, Whole, cells);
    EXPECT_EQ(reader->GetOutput()->GetSpacing()[2], 2.0);
    EXPECT_EQ(reader->GetOutput()->GetOrigin()[0], 1.0);
    for (int trial = 0; trial < 20; ++trial)
    {
      Extent part{};
      for (std::size_t i = 0; i < 6; i += 2)
      {
        const auto size = static_cast<unsigned>(Whole.at(i + 1) - Whole.at(i));
        part.at(i) = Whole.at(i) + static_cast<int>(random() % size);
        part.at(i + 1) =
          part.at(i) + 1 + static_cast<int>(random() % (Whole.at(i + 1) - part.at(i)));
      }
      reader->Modified(); // or VTK keeps the whole image
      reader->UpdateExtent(part.data());
      ExpectRight(reader, part, cells);
    }
  }
}

void ExpectError(const std::string& index, const std::string& text)
{
  SCOPED_TRACE(text);
  const vtkNew<vtkImagePiecesReader> reader;
  const vtkNew<ErrorRecorder> errors;
  errors->Observe(reader);
  errors->Observe(reader->GetExecutive());
  reader->SetFileName(index.c_str());
  reader->Update();
  ASSERT_FALSE(errors->Errors.empty());
  EXPECT_NE(errors->Errors[0].find(text), std::string::npos) << errors->Errors[0];
}

TEST(VTKImagePieces, WhatIsWrongIsNamed)
{
  Pieces pieces("wrong");
  ExpectError("", "can't be opened");
  std::ofstream(pieces.File("text.pvti")) << "a text";
  ExpectError(pieces.File("text.pvti"), "isn't a parallel VTK image");
  ExpectError(pieces.Index(), "has no pieces");
  pieces.Add("a.vti", Whole);
  ExpectError(pieces.Index(), "has the piece 'a.vti', but there is no such file");
  std::ofstream(pieces.File("a.vti")) << "a text";
  ExpectError(pieces.Index(), "a.vti' isn't a VTK image");
  WritePiece(pieces.File("a.vti"), { -3, 7, 2, 9, 0, 6 });
  ExpectError(pieces.Index(), "a.vti' has the extent -3 7 2 9 0 6, not -3 7 2 10 0 6");
  WritePiece(pieces.File("a.vti"), Whole, -1000, "Float32");
  ExpectError(pieces.Index(), "a.vti' has an array \"p\" of another type");
  ExpectError(pieces.Index(""), "has no active scalars, but \"p\", \"c\"");
  pieces.List.clear();
  WritePiece(pieces.File("a.vti"), { -3, 7, 2, 9, 0, 6 });
  pieces.Add("a.vti", { -3, 7, 2, 9, 0, 6 });
  ExpectError(pieces.Index(), "has no piece with the points of the extent -3 7 10 10 0 6");
}

} // namespace
