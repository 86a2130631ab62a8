// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkRepeatVolume
 * @brief repeats a volume along each axis, without storage
 *
 * The volume is the brick source of the input, where it has one (a pyramid, a formula), else the
 * input image itself, or the source given by SetInputBrickSource(). The voxels of all levels are
 * those that the pyramid of all copies would have. See vtkBrickSourceAlgorithm for what the output
 * is.
 */
#pragma once

#include "vtkBrickSourceAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro
#include "vtkSmartPointer.h"             // for the explicit source

class VTKRENDERINGOUTOFCORE_EXPORT vtkRepeatVolume : public vtkBrickSourceAlgorithm
{
public:
  static vtkRepeatVolume* New();
  vtkTypeMacro(vtkRepeatVolume, vtkBrickSourceAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Repeats this source instead of the input. Default: none. */
  void SetInputBrickSource(vtkBrickSource* source);
  vtkBrickSource* GetInputBrickSource();
  ///@}

  ///@{
  /** Copies along each axis, at least 1. Default: 1 each. */
  void SetRepetitions(long long x, long long y, long long z);
  void SetRepetitions(const long long repetitions[3]);
  void GetRepetitions(long long repetitions[3]) VTK_SIZEHINT(3);
  ///@}

  ///@{
  /**
   * Voxels from one copy to the next; what lies between two copies is background. Default: 0 each,
   * the dimensions of the volume. Multiples of a power of two make coarse levels cheap.
   */
  void SetPitch(long long x, long long y, long long z);
  void SetPitch(const long long pitch[3]);
  void GetPitch(long long pitch[3]) VTK_SIZEHINT(3);
  ///@}

  ///@{
  /** The value between two copies. Default: 0. */
  void SetBackground(double value);
  vtkGetMacro(Background, double);
  ///@}

protected:
  vtkRepeatVolume();
  ~vtkRepeatVolume() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) override;
  bool IsBrickSourceOutdated() override;

private:
  vtkRepeatVolume(const vtkRepeatVolume&) = delete;
  void operator=(const vtkRepeatVolume&) = delete;

  /** The source to repeat, of the input or explicit; an ordinary image becomes one. */
  std::shared_ptr<teravox::BrickSource> FindInner(std::string& reason);

  long long Repetitions[3] = { 1, 1, 1 };
  long long Pitch[3] = { 0, 0, 0 };
  double Background = 0.0;
  vtkSmartPointer<vtkBrickSource> InputBrickSource;
  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
