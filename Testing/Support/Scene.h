// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "ImageMetrics.h"
#include "TruthIntegrator.h"

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

class vtkColorTransferFunction;
class vtkImageData;
class vtkOutOfCoreVolumeMapper;
class vtkPiecewiseFunction;
class vtkRenderWindow;
class vtkRenderer;
class vtkVolume;
class vtkVolumeMapper;
class vtkVolumeProperty;

namespace teravox::test
{

/// Opacity and colour as nodes, linear between them. Two nodes may not share a value.
struct TransferNodes
{
  std::vector<std::array<double, 2>> Opacity; ///< value, opacity
  std::vector<std::array<double, 4>> Color;   ///< value, red, green, blue
  double UnitDistance = 1;
};

/// The opacity functions that the tests go through, for values in low...high.
enum class OpacityShape
{
  Ramp, ///< rises smoothly over the upper three quarters
  Peak, ///< a triangle, 4 % of the range wide
  Box,  ///< two steep flanks, opacity 0.4 between them
  Wall, ///< opacity 1 above 55 %
  Fog   ///< thin everywhere, 0 nowhere
};
const char* ToString(OpacityShape shape);
TransferNodes MakeTransfer(
  OpacityShape shape, double low = 0, double high = 255, double unitDistance = 1);

/// The marcher that this run tests: native, or that of the GPU if TERAVOX_TEST_MARCHER=gpu is set.
/// CTest runs the tests of contracts and truth with both.
int TestedMarcher();

/// Does this run take all that a test could take (scenes, frames, types)? Shaders without a GPU are
/// several times slower than the native marcher: with them only if TERAVOX_TEST_ALL_SCENES is set.
bool TakesAll();

/// A window with one volume, drawn off-screen by a vtkOutOfCoreVolumeMapper or by any other mapper.
/// The members are VTK's own objects: tests change what they like.
/// Thread: the test's own.
class Stage
{
public:
  Stage(int width, int height);
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  Stage(Stage&&) = delete;
  Stage& operator=(Stage&&) = delete;
  ~Stage();

  /// Draws an image, or what a brick source gives.
  void SetImage(vtkImageData* image);
  void SetSource(const std::shared_ptr<BrickSource>& source);
  void SetTransfer(const TransferNodes& nodes);
  void SetShade(bool shade);
  /// Opacity over the magnitude of gradients: magnitude, opacity; empty: none.
  void SetGradientOpacity(const std::vector<std::array<double, 2>>& nodes);
  /// Opacity and colour over value and gradient: nodes as red, green, blue, opacity, by a function
  /// of places in 0...1 per axis. No columns: no such function.
  void SetTransferImage(int columns, int rows,
    const std::function<std::array<double, 4>(double, double)>& node = nullptr);
  /// From outside along a direction; the bounds fill about 1/distance of the picture. Sets the
  /// clipping range so that nothing is cut away.
  void Look(const std::array<double, 3>& direction, double distance = 1.0, bool parallel = false);
  /// From a place to another, with everything from `near` on visible.
  void LookFrom(const std::array<double, 3>& eye, const std::array<double, 3>& at, double near,
    double far, double viewAngle = 40);

  /// Renders with the out-of-core mapper; its accumulators: premultiplied RGBA, rows from the
  /// bottom.
  std::vector<float> Draw();
  /// The accumulators of the last frame.
  std::vector<float> Accumulator();
  /// Renders; the window's picture as RGBA in 0...1.
  std::vector<float> DrawPicture();
  /// Renders with another mapper, whose input is an image; the window's picture.
  std::vector<float> DrawPictureWith(vtkVolumeMapper* other);

  int Width() const { return this->Width_; }
  int Height() const { return this->Height_; }

  vtkNew<vtkRenderWindow> Window;
  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkVolume> Volume;
  vtkNew<vtkVolumeProperty> Property;
  vtkNew<vtkPiecewiseFunction> Opacity;
  vtkNew<vtkColorTransferFunction> Color;
  vtkSmartPointer<vtkOutOfCoreVolumeMapper> Mapper;

private:
  int Width_;
  int Height_;
};

/// Adds a clipping plane: what lies before it, where its normal points, is kept.
void Clip(Stage& stage, const Double3& origin, const Double3& normal);

/// What is read of a volume for its truth.
enum class VoxelAccess
{
  Whole,  ///< all levels, at once, as double: fast
  ByBrick ///< the bricks that rays meet, with few of them kept: volumes of any size
};

/// The truth at some pixels: of the ray through the pixel's centre, and the smallest and largest of
/// 9 rays. RGBA, in the order of the pixels.
struct TruthBounds
{
  std::vector<float> Center;
  std::vector<float> Low;
  std::vector<float> High;
};

/// The colours of some pixels of a picture that is `width` pixels wide, in their order.
std::vector<float> TakePixels(
  const std::vector<float>& picture, int width, const std::vector<TruthPixel>& pixels);

/// The truth of a property's 2-D function over the range of `info`; its last row is at `last`.
std::unique_ptr<TruthImage> ImageOf(
  vtkVolumeProperty* property, const VolumeInfo& info, double last);

/// The truth of what a stage shows, from the levels that a brick source delivers. Holds everything
/// that a TruthScene refers to.
class StageTruth
{
public:
  /// `source`: what the stage draws; it has to outlive the truth. Place, prop matrix, camera,
  /// property and level limits are taken from the stage's VTK objects. `component`: whose functions
  /// and material.
  StageTruth(Stage& stage, BrickSource& source, double scaleOfLengths = 1,
    VoxelAccess access = VoxelAccess::Whole, int component = 0);

  /// The same from levels that are given, of a volume too large to be read whole. What they refer
  /// to has to outlive this.
  StageTruth(Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels,
    double scaleOfLengths = 1);

  const TruthScene& Scene() const { return *this->Scene_; }
  /// Nothing is drawn where these levels, as many as the volume's, aren't above 0. What they refer
  /// to has to outlive this.
  void SetMask(std::vector<TruthLevel> levels);
  /// The same as a label mask: what is drawn of a voxel follows from the property's functions of
  /// its label. `info`: of what is drawn.
  void SetLabels(Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels);
  /// Instead of the stage's functions, where evaluating those takes too long.
  void SetTransfer(TruthTransfer transfer) { *this->Transfer = std::move(transfer); }
  /// The truth at these pixels. `taken`: the colours that several pictures have there. Where all of
  /// them differ from the truth by at most `small`, the 8 rays around the centre aren't computed,
  /// and Low and High are the centre's: what is measured against them is an upper bound.
  TruthBounds Bounds(const std::vector<TruthPixel>& pixels,
    const std::vector<std::vector<float>>& taken, double small) const;
  /// The picture's excess over the envelope of 9 rays; the tolerance isn't taken off. Where the
  /// plain difference is at most `small` the envelope isn't computed and the excess is the plain
  /// difference, an upper bound. `plain`: differences from the truth itself.
  ImageDifference Excess(
    const std::vector<float>& picture, double small, ImageDifference* plain = nullptr) const;

private:
  void Build(Stage& stage, const VolumeInfo& info, std::vector<TruthLevel> levels,
    double scaleOfLengths, int component = 0);

  std::vector<std::vector<double>> Voxels;
  std::unique_ptr<TruthVolume> Volume;
  std::unique_ptr<TruthVolume> Mask;
  std::unique_ptr<TruthTransfer> Transfer;
  std::unique_ptr<TruthCamera> Camera;
  std::unique_ptr<TruthShading> Shading;
  std::unique_ptr<TruthGradientOpacity> GradientOpacity;
  std::unique_ptr<TruthImage> Image;
  std::map<std::int64_t, TruthLabel> Labels;
  std::unique_ptr<TruthScene> Scene_;
  int Width;
};

/// What an image is made of, and where it lies.
struct ImageOptions
{
  ScalarType Type = ScalarType::UInt8;
  std::array<int, 3> Dimensions{ 40, 36, 44 }; ///< voxels, also for cell data
  std::array<int, 3> ExtentStart{ 0, 0, 0 };
  std::array<double, 3> Origin{ 0, 0, 0 };
  std::array<double, 3> Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  bool CellData = false;
  double Low = 0; ///< values of the field's 0 and 1
  double High = 255;
  double ShareOfNaN = 0; ///< for floats: this share of the voxels, in clumps
};
/// Of a type, with values that are a challenge to it: integers and doubles that floats can't tell
/// apart, negative ones.
ImageOptions OptionsOfType(ScalarType type);
/// A smooth field in 0...1 at a place in 0...1 per axis.
using UnitField = std::function<double(double, double, double)>;
/// Blobs, a shell and a hollow, no symmetry; some corners exactly 0.
double BlobField(double x, double y, double z);
vtkSmartPointer<vtkImageData> MakeImage(
  const ImageOptions& options, const UnitField& field = BlobField);
/// The same image with its scalars as 16-bit integers: u8 as u16, i8 as i16; others as they are.
vtkSmartPointer<vtkImageData> WithWideScalars(vtkImageData* image);
/// A brick source of an image, as the mapper makes it.
std::shared_ptr<BrickSource> SourceOfImage(vtkImageData* image, int brickSize, bool cellData);

/// Without any order: a number in 0...1 for each place.
double NoiseField(double x, double y, double z);

/// Debian's brain scan (mricron-data), every `step`-th voxel, cropped to at most these dimensions
/// around its centre; null where it isn't installed.
vtkSmartPointer<vtkImageData> LoadBrain(int step, const std::array<int, 3>& dimensions);
/// Skin and brain of that scan.
TransferNodes BrainTransfer();

} // namespace teravox::test
