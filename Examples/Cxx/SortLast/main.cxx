// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sort-last rendering of one pyramid by the ranks of an MPI program:
//
//   mpirun -np 4 SortLast FILE.h5 PICTURE.png [--size WIDTH HEIGHT] [--frames N]
//     [--turn DEGREES] [--preview LEVELS] [--direction X Y Z] [--shade] [--marcher native|gpu]
//     [--brick EDGE] [--floats FILE]
//
// Each rank draws one block of the volume and reads only what that needs. With several frames,
// between which the camera may turn, the blocks are divided anew where the rays of the one before
// needed bricks, if that is worth it. What a rank suspects to be hidden by the others, by the frame
// before or by a preview that is so many levels coarser, it draws only if their pictures in this
// frame don't hide it. "%r" in FILE is replaced by the rank, for copies on local disks. A rank
// whose file can't be opened leaves its block out and says so; the program's exit code is 3 then,
// and where bricks can't be read.
#include "Blend.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mpi.h>
#include <string>
#include <vector>
#include <vtkBlockSplit.h>
#include <vtkBrickSource.h>
#include <vtkCamera.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkHDF5PyramidReader.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkOutOfCoreTransferFunction.h>
#include <vtkOutOfCoreVolumeMapper.h>
#include <vtkPNGWriter.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

namespace
{

struct Options
{
  std::string File;
  std::string Picture;
  std::string Floats;
  int Width = 512;
  int Height = 512;
  int Frames = 1;
  int BrickSize = 64;
  int Preview = 0;
  double Turn = 0;
  std::array<double, 3> Direction{ 0.5, 1, 0.4 };
  bool Shade = false;
  int Marcher = vtkOutOfCoreVolumeMapper::MARCHER_AUTOMATIC;
};

bool Parse(int argc, char** argv, Options& options)
{
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i)
  {
    const std::string word = argv[i];
    const auto next = [&] { return i + 1 < argc ? std::string(argv[++i]) : std::string(); };
    if (word == "--size")
    {
      options.Width = std::atoi(next().c_str());
      options.Height = std::atoi(next().c_str());
    }
    else if (word == "--frames")
    {
      options.Frames = std::atoi(next().c_str());
    }
    else if (word == "--turn")
    {
      options.Turn = std::atof(next().c_str());
    }
    else if (word == "--preview")
    {
      options.Preview = std::atoi(next().c_str());
    }
    else if (word == "--brick")
    {
      options.BrickSize = std::atoi(next().c_str());
    }
    else if (word == "--direction")
    {
      for (double& d : options.Direction)
      {
        d = std::atof(next().c_str());
      }
    }
    else if (word == "--shade")
    {
      options.Shade = true;
    }
    else if (word == "--marcher")
    {
      options.Marcher = next() == "gpu" ? vtkOutOfCoreVolumeMapper::MARCHER_GPU
                                        : vtkOutOfCoreVolumeMapper::MARCHER_NATIVE;
    }
    else if (word == "--floats")
    {
      options.Floats = next();
    }
    else
    {
      names.push_back(word);
    }
  }
  if (names.size() == 2 && options.Width > 0 && options.Height > 0 && options.Frames > 0)
  {
    options.File = names[0];
    options.Picture = names[1];
    return true;
  }
  return false;
}

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// What one rank needs to draw.
class Painter
{
public:
  Painter(const Options& options, const std::string& file)
  {
    this->Reader->SetFileName(file.c_str());
    this->Reader->SetBrickSize(options.BrickSize);
    this->Readable = this->Reader->CanReadFile(file.c_str()) != 0 && this->Reader->GetBrickSource();
    if (!this->Readable)
    {
      return;
    }
    this->Mapper->SetBrickSource(this->Reader->GetBrickSource());
    this->Mapper->SetMarcher(options.Marcher);
    this->Mapper->SetFrameTimeBudget(0); // Render() returns a complete picture
    this->Mapper->BlockOn();
    this->Mapper->RecordBricksOn();
    this->Volume->SetMapper(this->Mapper);
    vtkOutOfCoreTransferFunction::MakeAutomatic(
      this->Reader->GetBrickSource(), this->Volume->GetProperty());
    this->Volume->GetProperty()->SetShade(options.Shade ? 1 : 0);
    this->Renderer->AddVolume(this->Volume);
    this->Window->SetOffScreenRendering(1);
    this->Window->SetMultiSamples(0);
    this->Window->SetSize(options.Width, options.Height);
    this->Window->AddRenderer(this->Renderer);
    vtkCamera* camera = this->Renderer->GetActiveCamera();
    const auto& d = options.Direction;
    camera->SetFocalPoint(0, 0, 0);
    camera->SetPosition(-d[0], -d[1], -d[2]);
    camera->SetViewUp(0, 0, 1);
    this->Renderer->ResetCamera();
    this->Split->SetBrickSource(this->Reader->GetBrickSource());
  }

  ~Painter() { this->Renderer->RemoveVolume(this->Volume); }
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;
  Painter(Painter&&) = delete;
  Painter& operator=(Painter&&) = delete;

  /// Premultiplied RGBA, rows from the bottom; empty without a file or a block.
  std::vector<float> Draw(const int extent[6])
  {
    if (!this->Draws(extent))
    {
      return {};
    }
    this->Mapper->SetBlockExtent(extent);
    this->Window->Render();
    vtkNew<vtkImageData> image;
    if (!this->Mapper->GetColorAccumulator(image))
    {
      return {};
    }
    const auto* first = static_cast<const float*>(image->GetScalarPointer());
    return { first, first + 4 * image->GetNumberOfPoints() };
  }

  bool Draws(const int extent[6]) const { return this->Readable && extent[0] <= extent[1]; }

  /// A picture of coarser levels, of which only opacities are of use.
  void DrawPreview(const int extent[6], int levels)
  {
    this->Mapper->SetLevelOfDetailBias(levels);
    this->Draw(extent);
    this->Mapper->SetLevelOfDetailBias(0);
  }

  void Turn(double degrees)
  {
    this->Renderer->GetActiveCamera()->Azimuth(degrees);
    this->Renderer->ResetCameraClippingRange();
  }

  bool Readable = false;
  vtkNew<vtkHDF5PyramidReader> Reader;
  vtkNew<vtkOutOfCoreVolumeMapper> Mapper;
  vtkNew<vtkBlockSplit> Split;
  vtkNew<vtkVolume> Volume;
  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkRenderWindow> Window;
};

/// The blocks of all ranks and their order, as the first rank with a file sees them.
struct Division
{
  std::vector<int> Extents; ///< six per rank
  std::vector<int> Order;   ///< front to back
};

Division Divide(Painter& painter, int rank, int ranks, int lead)
{
  Division division;
  division.Extents.assign(6 * static_cast<std::size_t>(ranks), 0);
  int blocks = 0;
  if (rank == lead)
  {
    for (int r = 0; r < ranks; ++r)
    {
      painter.Split->GetBlockExtent(r, &division.Extents[6 * static_cast<std::size_t>(r)]);
    }
    vtkNew<vtkIdList> order;
    painter.Split->GetFrontToBack(painter.Renderer, painter.Volume, order);
    division.Order.assign(order->begin(), order->end());
    blocks = static_cast<int>(division.Order.size());
  }
  MPI_Bcast(division.Extents.data(), 6 * ranks, MPI_INT, lead, MPI_COMM_WORLD);
  MPI_Bcast(&blocks, 1, MPI_INT, lead, MPI_COMM_WORLD);
  division.Order.resize(static_cast<std::size_t>(blocks));
  MPI_Bcast(division.Order.data(), blocks, MPI_INT, lead, MPI_COMM_WORLD);
  return division;
}

/// What lies in front of this rank's block, by the pictures that all have just drawn.
class Occlusion
{
public:
  /// Collective.
  void Exchange(Painter& painter, const Division& division, int rank, int ranks)
  {
    vtkNew<vtkFloatArray> mine;
    const bool draws = painter.Draws(&division.Extents[6 * static_cast<std::size_t>(rank)]);
    int tiles = draws && painter.Mapper->GetOpacityTiles(mine)
      ? static_cast<int>(mine->GetNumberOfValues())
      : 0;
    const int own = tiles;
    MPI_Allreduce(&own, &tiles, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (own != tiles)
    {
      mine->SetNumberOfValues(tiles);
      mine->FillValue(0);
    }
    this->OfAll->SetNumberOfValues(vtkIdType{ tiles } * ranks);
    MPI_Allgather(mine->GetPointer(0), tiles, MPI_FLOAT, this->OfAll->GetPointer(0), tiles,
      MPI_FLOAT, MPI_COMM_WORLD);
    this->Known = tiles > 0;
  }

  /// By the last pictures, perhaps of another view.
  void Suspect(Painter& painter, const Division& division, int rank)
  {
    if (this->Find(painter, division, rank))
    {
      painter.Mapper->SuspectHidden(this->InFront);
    }
  }

  /// By those of this view. Returns whether something is to be drawn that wasn't.
  bool Confirm(Painter& painter, const Division& division, int rank)
  {
    return this->Find(painter, division, rank) && !painter.Mapper->IsConverged() &&
      painter.Mapper->ConfirmHidden(this->InFront);
  }

  bool Known = false;

private:
  bool Find(Painter& painter, const Division& division, int rank)
  {
    if (!this->Known || !painter.Draws(&division.Extents[6 * static_cast<std::size_t>(rank)]))
    {
      return false;
    }
    vtkNew<vtkIdList> order;
    for (const int block : division.Order)
    {
      order->InsertNextId(block);
    }
    return painter.Split->GetOpacityInFront(this->OfAll, order, rank, this->InFront);
  }

  vtkNew<vtkFloatArray> OfAll;
  vtkNew<vtkFloatArray> InFront;
};

/// What the rays of all ranks needed in the last frame becomes the weights of the next division.
void WeighAnew(Painter& painter, int rank, int lead)
{
  vtkNew<vtkDoubleArray> mine;
  if (painter.Readable)
  {
    painter.Mapper->AddBrickWeights(painter.Split, mine);
  }
  long long count = mine->GetNumberOfValues();
  MPI_Bcast(&count, 1, MPI_LONG_LONG, lead, MPI_COMM_WORLD);
  if (mine->GetNumberOfValues() != count)
  {
    mine->SetNumberOfValues(count);
    mine->FillValue(0);
  }
  vtkNew<vtkDoubleArray> all;
  all->SetNumberOfValues(count);
  MPI_Reduce(mine->GetPointer(0), all->GetPointer(0), static_cast<int>(count), MPI_DOUBLE, MPI_SUM,
    lead, MPI_COMM_WORLD);
  if (rank == lead)
  {
    painter.Split->Rebalance(all);
  }
}

/// What a rank tells of a frame, in the order of the columns that are printed.
struct Report
{
  double Bytes = 0; ///< of the file, in this frame
  double Bricks = 0;
  double Draw = 0; ///< seconds
  double Blend = 0;
  double Sent = 0;    ///< bytes of pixels
  double Missing = 0; ///< bricks that couldn't be read, or 1 without a file
};

void Print(const Report& mine, const Division& division, int frame, int rank, int ranks)
{
  constexpr int columns = sizeof(Report) / sizeof(double);
  std::vector<Report> all(rank == 0 ? static_cast<std::size_t>(ranks) : 0);
  MPI_Gather(&mine, columns, MPI_DOUBLE, all.data(), columns, MPI_DOUBLE, 0, MPI_COMM_WORLD);
  double bytes = 0;
  double most = 0;
  for (std::size_t r = 0; r < all.size(); ++r)
  {
    const int* e = &division.Extents[6 * r];
    const Report& report = all[r];
    std::printf("frame %d rank %d block %d-%d %d-%d %d-%d read %.0f bytes, %.0f bricks; "
                "drawn in %.3f s, blended in %.3f s, %.0f bytes sent, %.0f failures\n",
      frame, static_cast<int>(r), e[0], e[1], e[2], e[3], e[4], e[5], report.Bytes, report.Bricks,
      report.Draw, report.Blend, report.Sent, report.Missing);
    bytes += report.Bytes;
    most = std::max(most, report.Bytes);
  }
  if (rank == 0)
  {
    std::printf("frame %d all ranks read %.0f bytes, the most %.2f x the mean\n", frame, bytes,
      bytes > 0 ? most * ranks / bytes : 1.0);
    std::fflush(stdout);
  }
}

void Write(const std::vector<float>& picture, const Options& options)
{
  if (!options.Floats.empty())
  {
    std::ofstream file(options.Floats, std::ios::binary);
    file.write(reinterpret_cast<const char*>(picture.data()),
      static_cast<std::streamsize>(picture.size() * sizeof(float)));
  }
  vtkNew<vtkImageData> image;
  image->SetDimensions(options.Width, options.Height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  auto* out = static_cast<unsigned char*>(image->GetScalarPointer());
  for (std::size_t i = 0; i < picture.size(); i += 4)
  {
    for (std::size_t c = 0; c < 3; ++c)
    {
      *out++ = static_cast<unsigned char>(std::clamp(picture[i + c], 0.0f, 1.0f) * 255 + 0.5f);
    }
  }
  vtkNew<vtkPNGWriter> writer;
  writer->SetFileName(options.Picture.c_str());
  writer->SetInputData(image);
  writer->Write();
}

int Run(const Options& options, int rank, int ranks)
{
  std::string file = options.File;
  if (const auto at = file.find("%r"); at != std::string::npos)
  {
    file.replace(at, 2, std::to_string(rank));
  }
  Painter painter(options, file);
  const int candidate = painter.Readable ? rank : ranks;
  int lead = 0;
  MPI_Allreduce(&candidate, &lead, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  if (!painter.Readable)
  {
    std::fprintf(stderr, "rank %d: %s can't be read; its block is left out.\n", rank, file.c_str());
  }
  if (lead == ranks)
  {
    return 1;
  }
  painter.Split->SetNumberOfBlocks(ranks);

  std::vector<float> picture;
  double failures = 0;
  Occlusion occlusion;
  for (int frame = 0; frame < options.Frames; ++frame)
  {
    const Division division = Divide(painter, rank, ranks, lead);
    const int* extent = &division.Extents[6 * static_cast<std::size_t>(rank)];
    Report report;
    const std::uint64_t bytesBefore = painter.Mapper->GetBytesRead();
    const std::uint64_t bricksBefore = painter.Mapper->GetNumberOfBricksLoaded();
    const double begin = Now();
    if (frame == 0 && options.Preview > 0)
    {
      painter.DrawPreview(extent, options.Preview);
      occlusion.Exchange(painter, division, rank, ranks);
    }
    const bool suspects = occlusion.Known;
    occlusion.Suspect(painter, division, rank);
    std::vector<float> mine = painter.Draw(extent);
    occlusion.Exchange(painter, division, rank, ranks);
    if (suspects && occlusion.Confirm(painter, division, rank))
    {
      mine = painter.Draw(extent);
    }
    report.Draw = Now() - begin;
    report.Bytes = static_cast<double>(painter.Mapper->GetBytesRead() - bytesBefore);
    report.Bricks = static_cast<double>(painter.Mapper->GetNumberOfBricksLoaded() - bricksBefore);
    report.Missing = painter.Readable
      ? static_cast<double>(
          painter.Mapper->GetNumberOfFailedBricks() + painter.Mapper->GetNumberOfFailedPageBlocks())
      : 1;
    failures = report.Missing;
    MPI_Barrier(MPI_COMM_WORLD); // what follows is blending, not waiting for those that draw longer
    const double drawn = Now();
    std::uint64_t sent = 0;
    picture = BlendOnRankZero(mine, options.Width, options.Height, division.Order, sent);
    report.Blend = Now() - drawn;
    report.Sent = static_cast<double>(sent);
    Print(report, division, frame, rank, ranks);
    if (frame + 1 < options.Frames)
    {
      WeighAnew(painter, rank, lead);
      painter.Turn(options.Turn);
    }
  }
  if (rank == 0)
  {
    Write(picture, options);
  }
  double all = 0;
  MPI_Allreduce(&failures, &all, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return all > 0 ? 3 : 0;
}

} // namespace

int main(int argc, char** argv)
{
  MPI_Init(&argc, &argv);
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  Options options;
  int code = 2;
  if (Parse(argc, argv, options))
  {
    code = Run(options, rank, ranks);
  }
  else if (rank == 0)
  {
    std::fprintf(stderr,
      "usage: SortLast FILE.h5 PICTURE.png [--size WIDTH HEIGHT] [--frames N] [--turn DEGREES]\n"
      "         [--preview LEVELS] [--direction X Y Z] [--shade] [--marcher native|gpu]\n"
      "         [--brick EDGE] [--floats FILE]\n");
  }
  MPI_Finalize();
  return code;
}
