// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkOutOfCoreVolumeRepresentation
 * @brief ParaView's "Volume (out of core)": an image, or the pyramid behind it, by
 * vtkOutOfCoreVolumeMapper
 *
 * Each process that has the data takes the image of its own pipeline. Where the array to be drawn
 * carries a vtkBrickSource, that is what the mapper gets (SetBrickSource), and all levels are drawn
 * of the few bricks that the view needs; where a filter has moved the image, or has computed
 * another array, the mapper gets the image. What is delivered to other processes is an outline.
 *
 * Still renders, screenshots and frames of saved animations are complete pictures: the render waits
 * until no ray waits, or until nothing has come for SetConvergeTimeout() seconds, which is said by
 * a warning. Interactive renders show the best that is at hand within SetInteractiveFrameTime().
 * With ParaView's streaming on, still renders in a window do that too, and refine in the passes
 * that follow.
 *
 * With several processes each draws a block of a pyramid (vtkBlockSplit), and ParaView blends them
 * in the order of their bounds. The first process draws all of it where that can't be: in blend
 * modes other than composite, isosurface and slice, with several volumes in the view, and where a
 * direction matrix or a turned prop isn't along the world's axes. Ordinary images are drawn by each
 * process its piece.
 *
 * Transfer functions, shading, blend mode and cropping are those of vtkImageVolumeRepresentation.
 * What the mapper doesn't support (docs/vtk-options.md) it says in a warning.
 */
#pragma once

#include "vtkImageVolumeRepresentation.h"
#include "vtkTeravoxParaViewModule.h" // for the export macro

#include <memory> // for std::unique_ptr

class vtkBrickSource;
class vtkDataArray;
class vtkDoubleArray;
class vtkOutOfCoreVolumeMapper;
struct ProcessFacts;

class VTKTERAVOXPARAVIEW_EXPORT vtkOutOfCoreVolumeRepresentation
  : public vtkImageVolumeRepresentation
{
public:
  static vtkOutOfCoreVolumeRepresentation* New();
  vtkTypeMacro(vtkOutOfCoreVolumeRepresentation, vtkImageVolumeRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(
    vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo) override;

  ///@{
  /**
   * Budgets in MiB, 0 (default) as vtkOutOfCoreVolumeMapper chooses them.
   */
  void SetGPUMemoryBudget(double mebibytes);
  void SetHostMemoryBudget(double mebibytes);
  ///@}

  ///@{
  /** Of vtkOutOfCoreVolumeMapper, with its ranges and defaults. */
  void SetImageErrorTolerance(double tolerance);
  void SetLevelOfDetailBias(double bias);
  void SetMinimumLevel(int level);
  void SetMaximumLevel(int level);
  void SetMarcher(int marcher);
  void SetConvergeTimeout(double seconds);
  void SetDebugView(int view);
  ///@}

  ///@{
  /**
   * Seconds that an interactive frame may take, at least 0.01. Default 0.1. With streaming it is
   * the first still frame, too; each pass of refinement after it takes twice as long, until no
   * brick is missing, and the last one what it needs.
   */
  vtkSetClampMacro(InteractiveFrameTime, double, 0.01, 3600.0);
  vtkGetMacro(InteractiveFrameTime, double);
  ///@}

  ///@{
  /**
   * Whether processes that draw blocks tell each other, before a picture that is to be complete,
   * the opacities of their pictures, and load nothing that those in front hide in this view. It
   * takes a frame more. Default on.
   */
  vtkSetMacro(ExchangeOpacities, bool);
  vtkGetMacro(ExchangeOpacities, bool);
  ///@}

  ///@{
  /**
   * Settings that ParaView has for its own mapper. The mapper to be used isn't a choice here. The
   * others go to vtkOutOfCoreVolumeMapper, which warns that it doesn't support them.
   */
  void SetRequestedRenderMode(int) {}
  void SetGlobalIlluminationReach(float reach);
  void SetVolumetricScatteringBlending(float blending);
  ///@}

  ///@{
  /**
   * Of the last frame: whether it was complete, and how many bricks it missed or couldn't read.
   * Since the representation was made: MiB read from the source, bricks loaded. Now: MiB of budgets
   * in use. With several processes or a server of all of them together, of budgets the most, as of
   * the last update of the view, also on the client.
   */
  int GetConverged();
  int GetMissingBricks();
  int GetFailedBricks();
  double GetMebibytesRead();
  int GetBricksLoaded();
  double GetGPUMebibytesUsed();
  double GetHostMebibytesUsed();
  ///@}

  /**
   * Voxels of the image that this representation got from its input with the last update: of the
   * level that the reader presents, whatever is drawn.
   */
  vtkIdType GetNumberOfInputVoxels();
  /** Whether all levels are drawn, and not just the image of the input. */
  int GetDrawsPyramid();
  /** Whether each of several processes draws a block of a pyramid. */
  int GetDrawsBlock();
  ///@{
  /**
   * Of each process, as of the last update of the view: MiB read from the source since the
   * representation was made; MiB of bricks that the rays of the last frame needed, 0 where no
   * blocks are drawn. Owned by this object.
   */
  vtkDoubleArray* GetMebibytesReadOfProcesses();
  vtkDoubleArray* GetMebibytesNeededOfProcesses();
  ///@}

protected:
  vtkOutOfCoreVolumeRepresentation();
  ~vtkOutOfCoreVolumeRepresentation() override;

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  void UpdateMapperParameters() override;

private:
  vtkOutOfCoreVolumeRepresentation(const vtkOutOfCoreVolumeRepresentation&) = delete;
  void operator=(const vtkOutOfCoreVolumeRepresentation&) = delete;

  vtkOutOfCoreVolumeMapper* GetMapper();
  /**
   * The array of `image` that is drawn: the one to colour by, or, where none is chosen, the first
   * one that has a source. Null where there is none.
   */
  vtkDataArray* FindArray(vtkImageData* image);
  /** The source on that array; null where it has none. */
  vtkBrickSource* FindSource(vtkImageData* image);
  void HandOver(vtkImageData* image);
  void ColorAsChosen();
  /** Draws an array that nobody chose by functions that suit it. */
  void ColorAutomatically(vtkImageData* image);
  bool ChooseShare();
  ProcessFacts FactsHere();
  ProcessFacts Facts();
  void ChooseFrameTime(vtkInformation* inInfo);
  void LearnOfOthers(vtkInformation* inInfo);

  double InteractiveFrameTime = 0.1;
  bool ExchangeOpacities = true;
  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
