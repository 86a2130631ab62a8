// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkOutOfCoreVolumeMapper
 * @brief draws volumes of any size inside fixed memory budgets
 *
 * A drop-in for vtkGPUVolumeRayCastMapper. What it draws comes in bricks: of the source given with
 * SetBrickSource(), or of the one that the pipeline's array carries (vtkBrickSource), or of the
 * array itself. Rays are guided through a page table, stop at missing bricks and resume when those
 * have come, so that any budget gives the same picture, bit for bit.
 *
 * *Converging*, Render() returns a complete picture: the default of off-screen windows.
 * *Interactive*, a frame shows the best that is at hand within its time, and the frames that follow
 * refine it: the default of windows on a screen. See SetFrameTimeBudget().
 *
 * *Blend modes*: all of vtkVolumeMapper, of the field itself, not of samples, with as few bricks
 * loaded as the mode allows. What is shown is what VTK 9.1's GPU mapper shows when its samples come
 * close to each other:
 * - Maximum and minimum intensity: colour and opacity of the transfer function at the exact maximum
 *   or minimum along the ray. Of a pyramid's coarser levels it is that of their voxels, which are
 *   averages: SetMaximumLevel(0) asks for that of the data.
 * - Average intensity: gray, opaque. The mean along the ray of opacity times value, values counted
 *   from 0 to 1 over the range of the data, where the value lies in AverageIPScalarRange; nothing
 *   where it nowhere does.
 * - Additive: gray, opaque. The integral along the ray of opacity times value (counted likewise)
 *   over ScalarOpacityUnitDistance, which VTK's sum of samples tends to; at a sample distance of
 *   the unit distance VTK adds up the samples as they are.
 * - Isosurface: the surfaces of vtkVolumeProperty::GetIsoSurfaceValues() where the field meets the
 *   values, lit by its gradient there, each with the transfer function's colour and opacity at its
 *   value. At most 256 whose opacity isn't 0.
 * - Slice: colour of the transfer function, weighted with its opacity, where a ray first meets the
 *   surface of vtkVolumeProperty::GetSliceFunction(), in the world. (VTK 9.1 knows planes only and
 *   doesn't weight the colour.)
 * As in VTK, only composite blending and isosurfaces are shaded. Voxels that are NaN have no value.
 *
 * *Components*: 1 to 4. Independent ones (vtkVolumeProperty::IndependentComponents on) have
 * functions, weights and materials of their own; they share a ray as in VTK 9.1's shader, whose
 * limit for close samples is the integral of the emission sum w s c with the extinction
 * sum s^2 / sum w s (w: ComponentWeight, s: extinction, c: colour of a component). Of two dependent
 * ones the first has the colour and the second the opacity, of four the first three are red, green
 * and blue (0 to the largest value of an integer type, 0 to 1 of floats) and the fourth has the
 * opacity, each by the functions of component 0; normals are those of the opacity's component, as
 * vtkVolumeProperty documents (VTK 9.1's shader takes the first). Independent ones are also drawn
 * by maximum and minimum intensity, average and additive, each component as if it were alone:
 * extremes with the sum of weight times opacity times colour and the sum of weight times opacity
 * (VTK 9.1 takes maxima for minima there), averages and sums weighted, with values counted over the
 * range of the component where that is known (arrays), else over that of all. Isosurfaces are those
 * of the component with the largest weight, as in VTK. Maximum and minimum intensity of dependent
 * ones are those of the last one, with the colour of the first such place on the ray. The rest is
 * drawn by composite blending, with a warning. There are no interpolated pixels. SetVectorMode()
 * draws one scalar of them, with any blend mode. SetTransfer2DYAxisArray() makes a function of two
 * dimensions one over two arrays, of an image or of two pyramids.
 *
 * Needs OpenGL 4.3. With clipping planes, cropping and lights of all kinds; every
 * property of the base class that isn't supported warns once by name when it is set to something
 * else than its default.
 *
 * Thread: like all VTK mappers, used by the render thread only.
 */
#pragma once

#include "vtkGPUVolumeRayCastMapper.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::unique_ptr

class vtkBlockSplit;
class vtkBrickSource;
class vtkDoubleArray;
class vtkFloatArray;
class vtkImageData;
class vtkRenderWindow;

class VTKRENDERINGOUTOFCORE_EXPORT vtkOutOfCoreVolumeMapper : public vtkGPUVolumeRayCastMapper
{
public:
  static vtkOutOfCoreVolumeMapper* New();
  vtkTypeMacro(vtkOutOfCoreVolumeMapper, vtkGPUVolumeRayCastMapper);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Events
  {
    ConvergedEvent = 72310, ///< the picture has become complete
    BrickFailedEvent        ///< bricks couldn't be read; call data: const char*, one sentence
  };

  ///@{
  /**
   * What is drawn, instead of the input. Null (default): the input decides. Without any input the
   * mapper makes a small image with the bounds of the source, because vtkVolume draws nothing
   * otherwise.
   */
  void SetBrickSource(vtkBrickSource* source);
  vtkBrickSource* GetBrickSource();
  ///@}

  ///@{
  /**
   * Hard limits in bytes. GPU: atlas, page table, ray states and all else that is allocated in the
   * context; 0 (default) means 75 % of what the driver reports, a quarter of the main memory with a
   * software renderer, else 1 GiB; an explicit SetMaxMemoryInBytes() wins over that default. Host:
   * bricks, chunks and reads under way; 0 (default) means a quarter of the main memory. Defaults
   * are for all mappers that draw together: what one can't use for its volume is the others', which
   * have equal shares of it.
   */
  vtkSetMacro(GPUMemoryBudget, vtkTypeUInt64);
  vtkGetMacro(GPUMemoryBudget, vtkTypeUInt64);
  vtkSetMacro(HostMemoryBudget, vtkTypeUInt64);
  vtkGetMacro(HostMemoryBudget, vtkTypeUInt64);
  /** The budgets in force. */
  vtkTypeUInt64 GetEffectiveGPUMemoryBudget();
  vtkTypeUInt64 GetEffectiveHostMemoryBudget();
  ///@}

  ///@{
  /**
   * Seconds per frame. 0: unlimited, Render() returns a converged picture. > 0: interactive, frames
   * of about that time: first the tolerance is loosened, then the native marcher casts fewer rays
   * (see MaximumImageSampleDistance; not with ErrorEstimate). < 0 (default): unlimited in
   * off-screen windows, else VTK's allocated render time.
   */
  vtkSetMacro(FrameTimeBudget, double);
  vtkGetMacro(FrameTimeBudget, double);
  ///@}

  ///@{
  /**
   * Bound on the difference between the converged picture and the exact integral, per pixel and
   * channel, in 0...1. Default 1/255. With 0 no error is controlled and SampleDistance (world
   * units) is taken as given.
   * The native marcher interpolates pixels between rays (composite, linear interpolation, no
   * cropping) where the picture is smooth and, up to the default, no voxel can hide between them; a
   * larger tolerance lets rays pass by at (255 tolerance)^(1/4) voxels, two at most, and with 1,
   * which no picture exceeds, all of them are interpolated (not with ErrorEstimate). VTK's
   * properties rule it: MaximumImageSampleDistance (at least 4, its default being 10: one ray for
   * up to 16 pixels; below the square root of 2: a ray for each) and AutoAdjustSampleDistances
   * (off: a ray for each).
   */
  vtkSetClampMacro(ImageErrorTolerance, double, 0.0, 1.0);
  vtkGetMacro(ImageErrorTolerance, double);
  ///@}

  ///@{
  /**
   * The level of detail is the coarsest whose voxels are at most 2^bias pixels wide. Default 0.
   */
  vtkSetClampMacro(LevelOfDetailBias, double, -16.0, 16.0);
  vtkGetMacro(LevelOfDetailBias, double);
  ///@}

  ///@{
  /**
   * Limits of the level. Defaults 0 and 31. SetMaximumLevel(0) draws level 0 everywhere.
   */
  vtkSetClampMacro(MinimumLevel, int, 0, 31);
  vtkGetMacro(MinimumLevel, int);
  vtkSetClampMacro(MaximumLevel, int, 0, 31);
  vtkGetMacro(MaximumLevel, int);
  ///@}

  ///@{
  /**
   * Skip what the transfer function makes invisible. Changes speed and loading, not one bit of the
   * picture. Default on.
   */
  vtkSetMacro(EmptySpaceSkipping, vtkTypeBool);
  vtkGetMacro(EmptySpaceSkipping, vtkTypeBool);
  vtkBooleanMacro(EmptySpaceSkipping, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Where nothing has changed since the last complete picture, show that again instead of drawing
   * the same. Default on.
   */
  vtkSetMacro(PictureReuse, vtkTypeBool);
  vtkGetMacro(PictureReuse, vtkTypeBool);
  vtkBooleanMacro(PictureReuse, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Number of loader threads, 1...64. Default: the number of processors, at most 8.
   */
  vtkSetClampMacro(NumberOfLoaderThreads, int, 1, 64);
  vtkGetMacro(NumberOfLoaderThreads, int);
  ///@}

  ///@{
  /**
   * Edge of a brick in voxels, without border, for bricks cut from images in memory (2...1024).
   * Default 64.
   */
  vtkSetClampMacro(BrickSize, int, 2, 1024);
  vtkGetMacro(BrickSize, int);
  ///@}

  ///@{
  /**
   * Upper limit on the number of bricks in the atlas, below what the budget allows; 0 (default):
   * none. For tests of small atlases.
   */
  vtkSetMacro(MaximumNumberOfSlots, vtkTypeUInt32);
  vtkGetMacro(MaximumNumberOfSlots, vtkTypeUInt32);
  ///@}

  ///@{
  /**
   * What draws: the GPU by shaders, or native code on this machine's processors with the atlas in
   * the memory of the host (it counts against the GPU's budget). Both keep the tolerance; native
   * code is several times as fast where OpenGL itself is drawn by processors (Mesa's llvmpipe).
   * Default: MARCHER_AUTOMATIC, native with such a driver, else the GPU.
   */
  enum MarcherType
  {
    MARCHER_AUTOMATIC = 0,
    MARCHER_GPU = 1,
    MARCHER_NATIVE = 2
  };
  vtkSetClampMacro(Marcher, int, MARCHER_AUTOMATIC, MARCHER_NATIVE);
  vtkGetMacro(Marcher, int);
  void SetMarcherToAutomatic() { this->SetMarcher(MARCHER_AUTOMATIC); }
  void SetMarcherToGPU() { this->SetMarcher(MARCHER_GPU); }
  void SetMarcherToNative() { this->SetMarcher(MARCHER_NATIVE); }
  ///@}

  ///@{
  /**
   * Randomises the order in which bricks arrive; 0 (default): by visibility. For tests.
   */
  vtkSetMacro(ArrivalShuffleSeed, vtkTypeUInt64);
  vtkGetMacro(ArrivalShuffleSeed, vtkTypeUInt64);
  ///@}

  ///@{
  /**
   * Seconds without any progress after which a converging Render() returns an incomplete picture
   * with a warning; IsConverged() is false then. Default 60; 0 waits forever. Interactive frames
   * never wait for a disk: what hasn't come is drawn from what is there, or left out.
   */
  vtkSetClampMacro(ConvergeTimeout, double, 0.0, 1.0e9);
  vtkGetMacro(ConvergeTimeout, double);
  ///@}

  ///@{
  /**
   * Seconds after the last failure at which the next frame asks again for bricks that couldn't be
   * read, so that pictures become complete when a fault of a disk or network has passed. Default
   * 10; 0: only RetryFailedBricks() does that. What fails again isn't reported again.
   */
  vtkSetClampMacro(FailureRetryInterval, double, 0.0, 1.0e9);
  vtkGetMacro(FailureRetryInterval, double);
  ///@}

  ///@{
  /**
   * Count samples (slower). Default off.
   */
  vtkSetMacro(CountSamples, vtkTypeBool);
  vtkGetMacro(CountSamples, vtkTypeBool);
  vtkBooleanMacro(CountSamples, vtkTypeBool);
  ///@}

  enum DebugViewType
  {
    NO_DEBUG_VIEW = 0,
    LEVELS = 1,
    BRICK_FRAMES = 2,
    SAMPLES_PER_PIXEL = 3
  };
  ///@{
  /**
   * What a picture shows of how it was made. LEVELS: instead of colours, the level of the first
   * contribution of each ray, (level + 1) / 32 in all channels, blended as composite.
   * SAMPLES_PER_PIXEL: how many samples its ray took (see GetNumberOfSamples()), as log2(1 +
   * samples) / 16, linear between powers of two: 0, 1, 3, 7, 15 samples are 0, 1/16, 2/16, 3/16,
   * 4/16; a ray is cast for each pixel. BRICK_FRAMES: over the picture in the window the edges of
   * the bricks that its rays needed; those of one value need none. White, yellow, cyan, magenta,
   * green, red, blue, orange for the levels 0 to 7, and again; opaque geometry hides them, the
   * volume doesn't. Without one of them nothing of it costs anything. Default: NO_DEBUG_VIEW.
   */
  vtkSetClampMacro(DebugView, int, NO_DEBUG_VIEW, SAMPLES_PER_PIXEL);
  vtkGetMacro(DebugView, int);
  void SetDebugViewToNone() { this->SetDebugView(NO_DEBUG_VIEW); }
  void SetDebugViewToLevels() { this->SetDebugView(LEVELS); }
  void SetDebugViewToBrickFrames() { this->SetDebugView(BRICK_FRAMES); }
  void SetDebugViewToSamplesPerPixel() { this->SetDebugView(SAMPLES_PER_PIXEL); }
  ///@}

  /** As vtkSmartVolumeMapper::VectorModeType. */
  enum VectorModeType
  {
    DISABLED = -1,
    MAGNITUDE = 0,
    COMPONENT = 1
  };
  ///@{
  /**
   * What is drawn of voxels with several components: all of them (DISABLED, the default), their
   * magnitude as a vector, or the one that SetVectorComponent() names (0...3, default 0; the last
   * where there are less). The scalar is made when a brick is read, by the functions of component
   * 0. Magnitudes aren't rounded to the type of the data (vtkImageMagnitude does that).
   */
  vtkSetClampMacro(VectorMode, int, DISABLED, COMPONENT);
  vtkGetMacro(VectorMode, int);
  vtkSetClampMacro(VectorComponent, int, 0, 3);
  vtkGetMacro(VectorComponent, int);
  ///@}

  ///@{
  /**
   * Keep for each pixel how far its colour may be from the truth (the exact integral of the levels
   * that the view asks for, see SetImageErrorTolerance); GetErrorEstimateImage() reads it. Costs
   * one float per pixel. Default off.
   */
  vtkSetMacro(ErrorEstimate, vtkTypeBool);
  vtkGetMacro(ErrorEstimate, vtkTypeBool);
  vtkBooleanMacro(ErrorEstimate, vtkTypeBool);
  ///@}
  /**
   * The estimate of the last frame: one float per pixel of the viewport, 0...1 as colours are, the
   * largest error of a channel. Certain for rays that ended early or are still under way, and for
   * missing and unreadable bricks (by the range of what is missing); an estimate for steps: it is
   * meant to be below the true error on at most one pixel in a hundred. 1 where nothing is known,
   * which is everywhere with a tolerance of 0 and in blend modes other than composite. Returns
   * false if that frame had no estimate.
   */
  bool GetErrorEstimateImage(vtkImageData* image);

  ///@{
  /**
   * Sort-last rendering: draw only a block of the volume. BlockExtent: its voxels of level 0, first
   * and last along x, y, z, counted from the volume's first voxel whatever index that has in an
   * image; what is drawn are the cubes around their centres, so that (0,63) and (64,127) touch each
   * other. An extent without voxels draws nothing, and loads nothing. Rays run on the grid of the
   * whole volume, neighbours across faces come from the file: accumulators of blocks made by
   * vtkBlockSplit, blended front to back, are those of the whole volume within the tolerance. So
   * for the blend modes composite, isosurface and slice; pictures of the others (maximum, minimum,
   * average, additive) can't be blended, see GetGatheredImage(). Bounds stay those of the volume.
   * Pixels aren't interpolated between rays. Default off, with the extent (0,-1, 0,-1, 0,-1).
   */
  vtkSetMacro(Block, vtkTypeBool);
  vtkGetMacro(Block, vtkTypeBool);
  vtkBooleanMacro(Block, vtkTypeBool);
  vtkSetVector6Macro(BlockExtent, int);
  vtkGetVector6Macro(BlockExtent, int);
  ///@}

  ///@{
  /**
   * Pictures of blocks in the blend modes maximum, minimum, average and additive: what the rays of
   * the last frame gathered, floats that belong to this mapper's mode and functions
   * (GetGatheredImage: four components, eight for averages of several components; false if there
   * are none), is joined in any order (JoinGatheredImage: adds that of another block to `sum`, a
   * copy of one block's) and becomes the colours of the whole volume, premultiplied RGBA as
   * GetColorAccumulator() has them (ResolveGatheredImage; false, after an error, if `gathered`
   * isn't of the size of the last frame). What the frame buffer shows is the block alone, therefore
   * a warning comes without RenderToImageOn().
   */
  bool GetGatheredImage(vtkImageData* gathered);
  bool JoinGatheredImage(vtkImageData* sum, vtkImageData* more);
  bool ResolveGatheredImage(vtkImageData* gathered, vtkImageData* colors);
  ///@}

  ///@{
  /**
   * What other blocks hide. Opacities of tiles, squares of OpacityTileSize pixels from the lower
   * left corner, rows from the bottom (ceil(width / 8) * ceil(height / 8) values).
   *
   * GetOpacityTiles(): the least opacity that the last frame has in each tile; returns false if
   * there is none. vtkBlockSplit::GetOpacityInFront() makes of those of all blocks what lies in
   * front of one.
   *
   * SuspectHidden(): the frames to come cast no rays in tiles where `inFront` leaves no more than
   * the share of ImageErrorTolerance at which rays end, so that what others are believed to hide,
   * by their last pictures, isn't loaded before all that may be seen. Such a frame isn't converged
   * (IsConverged()). Null: nothing is hidden (the default).
   * ConfirmHidden(): `inFront` is of the present view, of the other blocks' pictures in it, whose
   * opacities can't become less any more (frames without a limit of time, suspicions or not).
   * Where it hides what was suspected, the next frame is converged without it, and what was
   * suspected wrongly is drawn. A confirmation holds for the view and volume of the last frame:
   * once something of that changes nothing is hidden. Returns false, after an error, if nothing was
   * suspected or the number of tiles isn't that of the last frame.
   *
   * For the blend modes composite, isosurface and slice, with BlockOn().
   */
  static constexpr int OpacityTileSize = 8;
  bool GetOpacityTiles(vtkFloatArray* tiles);
  void SuspectHidden(vtkFloatArray* inFront);
  bool ConfirmHidden(vtkFloatArray* inFront);
  ///@}

  ///@{
  /**
   * Remember which bricks the rays of a frame need, for vtkBlockSplit. Default off.
   * AddBrickWeights(): adds what they weigh, in bytes of voxels, to one weight per brick of the
   * split's grid, bricks of coarser levels spread evenly; the array is made as long as the grid
   * first. Of the last frame that was drawn, not shown again. Returns how many bricks there are.
   */
  vtkSetMacro(RecordBricks, vtkTypeBool);
  vtkGetMacro(RecordBricks, vtkTypeBool);
  vtkBooleanMacro(RecordBricks, vtkTypeBool);
  vtkIdType AddBrickWeights(vtkBlockSplit* split, vtkDoubleArray* weights);
  ///@}

  ///@{
  /**
   * Warn where settings of VTK's sampling (sample distances but MaximumImageSampleDistance) differ
   * from their defaults, which ImageErrorTolerance makes pointless. Off where this mapper stands in
   * the place of VTK's: there vtkSmartVolumeMapper sets them, not the user. Default on.
   */
  vtkSetMacro(WarnOfSampling, vtkTypeBool);
  vtkGetMacro(WarnOfSampling, vtkTypeBool);
  vtkBooleanMacro(WarnOfSampling, vtkTypeBool);
  ///@}

  /** True if the last frame was complete: every ray ended, at its level, none waits, none failed.
   */
  bool IsConverged();
  /** Bricks that the last frame missed. */
  vtkIdType GetNumberOfMissingBricks();
  /**
   * Renders the window until this mapper has converged or `timeout` seconds have passed. Returns
   * IsConverged().
   */
  bool Converge(vtkRenderWindow* window, double timeout);
  ///@{
  /**
   * Of a volume with time steps, the bricks that the present view needs of the step before and the
   * one behind are read into main memory once the picture is complete, as far as the host's budget
   * allows beside those of the present step. WaitForReadAhead() waits until that is done; false
   * after `timeout` seconds. How many bricks were read ahead since the mapper was made.
   */
  bool WaitForReadAhead(double timeout);
  vtkTypeUInt64 GetNumberOfBricksReadAhead();
  ///@}
  /** Asks again for all bricks that couldn't be read. */
  void RetryFailedBricks();

  ///@{
  /** Statistics since the mapper was made, or of the last frame where said. */
  vtkTypeUInt64 GetBytesRead();
  vtkTypeUInt64 GetBytesUploaded();
  vtkTypeUInt64 GetPageTableBytesUploaded();
  vtkTypeUInt64 GetNumberOfBricksLoaded();
  vtkTypeUInt64 GetNumberOfFailedBricks();
  vtkTypeUInt64 GetNumberOfFailedPageBlocks();
  vtkTypeUInt64 GetNumberOfEvictions();
  vtkTypeUInt64 GetNumberOfPageBlockEvictions();
  vtkTypeUInt64 GetNumberOfSlots();
  vtkTypeUInt64 GetNumberOfSlotsInUse();
  vtkTypeUInt64 GetGPUMemoryUsed();
  vtkTypeUInt64 GetPeakGPUMemoryUsed();
  vtkTypeUInt64 GetHostMemoryUsed();
  vtkTypeUInt64 GetPeakHostMemoryUsed();
  vtkTypeUInt64 GetAddressingMemoryUsed();
  /**
   * What the atlas is planned with, as `teravox plan` takes it: whether the native marcher draws
   * (see SetMarcher), and the largest edge of a 3-D texture in texels. False and 0 before the first
   * frame.
   */
  bool IsMarcherNative();
  int GetMaximumTextureSize();
  /** Seconds from the first Render() after a new source to the first complete picture. */
  double GetTimeToFirstPicture();
  double GetTimeToConverged();
  /**
   * The tolerance by which the steps of the last frame were taken: ImageErrorTolerance, or a
   * multiple of it while frames are kept to FrameTimeBudget. 0: none was controlled, or there is no
   * frame.
   */
  double GetFrameErrorTolerance();
  /**
   * Of the last frame; they need CountSamplesOn() or SAMPLES_PER_PIXEL. Samples are places or cells
   * of the field that were looked at; of the evaluated ones opacity and colour were computed, the
   * contributing ones added something. Gradients: places where they were computed. Visits: bricks
   * that rays went through, and empty regions that they left at once.
   */
  vtkTypeUInt64 GetNumberOfSamples();
  vtkTypeUInt64 GetNumberOfEvaluatedSamples();
  vtkTypeUInt64 GetNumberOfContributingSamples();
  vtkTypeUInt64 GetNumberOfGradients();
  vtkTypeUInt64 GetNumberOfVisits();
  /** Of the last frame: 0 where the picture was still there. */
  vtkTypeUInt64 GetNumberOfPasses();
  /** Page-table entries written, wishes and uploads handled in the last frame. */
  vtkTypeUInt64 GetNumberOfOperations();
  ///@}

  /**
   * Copies the accumulators of the last frame, before the one blend into the frame buffer:
   * premultiplied RGBA as float. Returns false if there are none. Where depth peeling draws the
   * volume in stretches between translucent geometry, those of the stretch that was drawn last.
   */
  bool GetColorAccumulator(vtkImageData* image);

  /** An empty text, or which invariant of page table and residency is broken. */
  std::string CheckInvariants();

  ///@{
  /**
   * What is seen at a display position (pixels, as events of an interactor give them): the place
   * where the opacity accumulated along the ray of that pixel passes `opacity` (0...1; a ray that
   * the picture ends early counts as opaque), in the picture that the renderer has shown last.
   * Loads what the ray needs, whatever the time; changes no picture. Returns whether there is such
   * a place. False, too, with a warning, if this mapper hasn't drawn in that renderer, or has drawn
   * other data or functions elsewhere since; and in the blend modes maximum, minimum, average and
   * additive, where no opacity is accumulated.
   *
   * Of the last place found: its world position (initially 0), the level that was drawn there, and
   * the value of level 0 of the first component there, interpolated as the picture is, whatever
   * level that shows.
   */
  bool Pick(vtkRenderer* renderer, double displayX, double displayY, double opacity = 0.5);
  vtkGetVector3Macro(PickPosition, double);
  vtkGetMacro(PickLevel, int);
  vtkGetMacro(PickValue, double);
  ///@}

  ///@{
  /**
   * Pictures of the last frame that was drawn with RenderToImageOn(), as vtkGPUVolumeRayCastMapper
   * gives them: of the size of the viewport, one slice; nothing is drawn into the window then, and
   * opaque geometry that was drawn before hides what lies behind it. Without such a frame they warn
   * and leave the image as it is.
   *
   * Colour: 8-bit RGBA, colours premultiplied with opacity, FinalColorWindow and FinalColorLevel
   * applied; white of opacity 0 where rays miss the volume's box.
   *
   * Depth, as the depth buffer counts it, in 0...1, as float or with SetDepthImageScalarType() as
   * unsigned integer whose largest value is 1: where the ray's opacity first is larger than 0 (more
   * than 6e-8, what a float of transmittance resolves), to a ten-thousandth of a brick's length; 1
   * where nothing is seen, or with ClampDepthToBackfaceOn() where the ray leaves the volume's box
   * (VTK 9.1 gives where it enters, unlike its documentation). In blend modes that make one value
   * of the whole ray (maximum, minimum, average, additive) there is no such place, as in VTK.
   *
   * Frames with RenderToImageOn() cast a ray for each pixel, count no samples and estimate no
   * errors.
   */
  void GetColorImage(vtkImageData* image) override;
  void GetDepthImage(vtkImageData* image) override;
  ///@}

  // vtkGPUVolumeRayCastMapper, vtkVolumeMapper, vtkAbstractVolumeMapper
  void Render(vtkRenderer* ren, vtkVolume* vol) override;
  vtkDataSet* GetInput() override { return this->GetInput(0); }
  double* GetBounds() override;
  void GetBounds(double bounds[6]) override { this->Superclass::GetBounds(bounds); }
  int IsRenderSupported(vtkRenderWindow* window, vtkVolumeProperty* property) override;
  void GetReductionRatio(double ratio[3]) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

protected:
  vtkOutOfCoreVolumeMapper();
  ~vtkOutOfCoreVolumeMapper() override;

  /** Updates an input that never was: vtkMultiVolume takes its bounds from here. */
  vtkDataSet* GetInput(int port) override;
  void PreRender(vtkRenderer*, vtkVolume*, double[6], double[2], int, unsigned int) override {}
  void RenderBlock(vtkRenderer*, vtkVolume*, unsigned int) override {}
  void PostRender(vtkRenderer*, int) override {}

  vtkTypeUInt64 GPUMemoryBudget = 0;
  vtkTypeUInt64 HostMemoryBudget = 0;
  double FrameTimeBudget = -1;
  double ImageErrorTolerance = 1.0 / 255;
  double LevelOfDetailBias = 0;
  int MinimumLevel = 0;
  int MaximumLevel = 31;
  vtkTypeBool EmptySpaceSkipping = 1;
  vtkTypeBool PictureReuse = 1;
  int NumberOfLoaderThreads = 2;
  int BrickSize = 64;
  vtkTypeUInt32 MaximumNumberOfSlots = 0;
  int Marcher = MARCHER_AUTOMATIC;
  vtkTypeUInt64 ArrivalShuffleSeed = 0;
  double ConvergeTimeout = 60;
  double FailureRetryInterval = 10;
  vtkTypeBool CountSamples = 0;
  int DebugView = NO_DEBUG_VIEW;
  vtkTypeBool ErrorEstimate = 0;
  int VectorMode = DISABLED;
  int VectorComponent = 0;
  vtkTypeBool Block = 0;
  int BlockExtent[6] = { 0, -1, 0, -1, 0, -1 };
  vtkTypeBool RecordBricks = 0;
  vtkTypeBool WarnOfSampling = 1;
  double PickPosition[3] = { 0, 0, 0 };
  int PickLevel = 0;
  double PickValue = 0;

private:
  vtkOutOfCoreVolumeMapper(const vtkOutOfCoreVolumeMapper&) = delete;
  void operator=(const vtkOutOfCoreVolumeMapper&) = delete;

  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
