// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkBrickSourceAlgorithm
 * @brief presents one level of a pyramid as a lazy image, with the brick source on its array
 *
 * The information pass gives extent, geometry and scalar type of the presented level and reads no
 * voxel. The data pass really reads the update extent of that level, so that pickers, outlines,
 * histograms and filters work on true data; the array carries a vtkBrickSource, through which
 * vtkOutOfCoreVolumeMapper draws all levels.
 *
 * Level l is coarser than level 0 by a factor f per axis; its voxel centres lie at
 * x0 = f x_l + (f-1)/2. Level 0 has the extent of the data, coarser levels begin at 0.
 *
 * A brick that can't be read is replaced by its finest readable ancestor and reported as an error.
 *
 * A volume that changes with time has TIME_STEPS, and each step is a brick source of its own. The
 * pipeline's UPDATE_TIME_STEP chooses the last step that isn't later, or the first one; without it
 * that is the first one, too.
 */
#pragma once

#include "vtkImageAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::shared_ptr, std::unique_ptr
#include <string> // for the reason of a failure
#include <vector> // for the times of steps

class vtkBrickSource;

namespace teravox
{
class BrickSeries;
class BrickSource;
}

class VTKRENDERINGOUTOFCORE_EXPORT vtkBrickSourceAlgorithm : public vtkImageAlgorithm
{
public:
  vtkTypeMacro(vtkBrickSourceAlgorithm, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The presented level, 0 is the finest. Default: -1, the finest with at most 2 Mi voxels, or the
   * coarsest if all have more. A level beyond the coarsest is an error when the pipeline updates.
   */
  virtual void SetLevel(int level);
  vtkGetMacro(Level, int);
  ///@}

  ///@{
  /**
   * What the volume has; opens it if need be. Without a readable volume: an error, and -1 or 0.
   */
  int GetPresentedLevel();
  int GetNumberOfLevels();
  void GetLevelDimensions(int level, long long dimensions[3]) VTK_SIZEHINT(3);
  ///@}

  /**
   * The whole volume, for vtkOutOfCoreVolumeMapper::SetBrickSource(); nullptr, after an error, if
   * it can't be opened. Belongs to this object.
   */
  vtkBrickSource* GetBrickSource();

  /**
   * Steps in time, at least 1 where there is a volume, and which of them is presented: that of the
   * last update.
   */
  int GetNumberOfTimeSteps();
  int GetPresentedTimeStep() const;

protected:
  vtkBrickSourceAlgorithm();
  ~vtkBrickSourceAlgorithm() override;

  /**
   * Makes or opens the source. On failure returns null and says why in one sentence; an empty
   * reason means that the error was reported already.
   */
  virtual std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) = 0;

  /**
   * The times of the steps, ascending. Default: none, the volume doesn't change with time. Else
   * MakeBrickSeries() is called instead of MakeBrickSource().
   */
  virtual std::vector<double> FindTimes() { return {}; }

  /** Makes the steps, as many as there are times; failures as of MakeBrickSource(). */
  virtual std::shared_ptr<teravox::BrickSeries> MakeBrickSeries(std::string& reason);

  /** Must the source be made again? Called each time it is needed, so it should be quick. */
  virtual bool IsBrickSourceOutdated() { return false; }

  /** To be called by setters: drops the source and marks this object as modified. */
  void BrickSourceModified();

  /** The same, of another volume: its first step is presented until the pipeline asks for one. */
  void VolumeModified();

  int RequestInformation(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;

private:
  vtkBrickSourceAlgorithm(const vtkBrickSourceAlgorithm&) = delete;
  void operator=(const vtkBrickSourceAlgorithm&) = delete;

  /** The source, made if need be; reports an error and returns null if it can't be. */
  std::shared_ptr<teravox::BrickSource> EnsureBrickSource();
  /** The step of a time, and the source of the present step. */
  std::shared_ptr<teravox::BrickSource> MakeSourceOfStep(std::string& reason);
  void ChooseStep(vtkInformation* outInfo);
  /** Resolves Level; reports an error and returns -1 if there is no such level. */
  int ResolveLevel(const teravox::BrickSource& source);

  int Level = -1;
  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
