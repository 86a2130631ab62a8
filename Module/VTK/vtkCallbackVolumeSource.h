// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkCallbackVolumeSource
 * @brief a volume whose levels are read box by box by a function of the user's
 *
 * For data that no reader knows: archives, services, arrays of other libraries. Python's arrays
 * come in by this way (teravox.volume()). Describe the volume, add its levels, the finest first,
 * and set the function. Levels that are missing down to a single brick are made by averaging (by
 * the most frequent value for labels) and kept in main memory: about a seventh of the coarsest
 * level that was added.
 *
 * A failed read is an error of that brick: the mapper draws a coarser level there and fires
 * BrickFailedEvent. See vtkBrickSourceAlgorithm for what the output is.
 */
#pragma once

#include "vtkBrickSourceAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <functional> // for the function
#include <string>     // for names and reasons
#include <vector>     // for the levels

class VTKRENDERINGOUTOFCORE_EXPORT vtkCallbackVolumeSource : public vtkBrickSourceAlgorithm
{
public:
  static vtkCallbackVolumeSource* New();
  vtkTypeMacro(vtkCallbackVolumeSource, vtkBrickSourceAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

#ifndef __VTK_WRAP__
  /**
   * Writes the voxels [first, first + size) of a level to `voxels`: dense, x fastest, components
   * interleaved. Returns an empty string, or one sentence that says why it can't. Called from
   * several threads at once.
   */
  using ReadFunction = std::function<std::string(
    int level, const long long first[3], const long long size[3], void* voxels)>;
  /** Default: none, an error when the pipeline updates. Marks this object as modified. */
  void SetReadFunction(ReadFunction function);

  /**
   * What a thread does before and after it waits for others: it may hold something that the read
   * function needs, as Python's interpreter lock. `begin` returns what `end` gets; both are called
   * on the waiting thread. For the whole process; null: nothing.
   */
  static void SetWaitFunctions(void* (*begin)(), void (*end)(void*));
#endif

  ///@{
  /**
   * The levels, the finest first. A factor is the number of level-0 voxels along each axis that
   * make one of the level's, a multiple of the level's before; 1 for the first. The dimensions must
   * be the first level's divided by the factor, rounded up or down. Default: none, an error.
   */
  void ClearLevels();
  void AddLevel(const long long dimensions[3], const long long factor[3]);
  int GetNumberOfGivenLevels() const
  {
    return static_cast<int>(this->Levels.size());
  }
  ///@}

  ///@{
  /** VTK_UNSIGNED_CHAR and the other types of 8, 16, 32 bits, VTK_DOUBLE. Default:
   * VTK_UNSIGNED_CHAR. */
  void SetScalarType(int type);
  vtkGetMacro(ScalarType, int);
  ///@}

  ///@{
  /** 1 to 4. Default: 1. */
  void SetNumberOfComponents(int components);
  vtkGetMacro(NumberOfComponents, int);
  ///@}

  ///@{
  /** Labels: nearest interpolation, levels by the most frequent value. Default: off. */
  void SetLabels(bool labels);
  vtkGetMacro(Labels, bool);
  vtkBooleanMacro(Labels, bool);
  ///@}

  ///@{
  /**
   * Smallest and largest value of level 0, where they are known for certain. Default: (0,-1), they
   * aren't.
   */
  void SetScalarRange(double minimum, double maximum);
  vtkGetVector2Macro(ScalarRange, double);
  ///@}

  ///@{
  /** World position of the centre of voxel (0,0,0). Default: the origin. */
  void SetOrigin(double x, double y, double z);
  vtkGetVector3Macro(Origin, double);
  ///@}

  ///@{
  /** Edge lengths of a level-0 voxel, above 0. Default: 1 each. */
  void SetSpacing(double x, double y, double z);
  vtkGetVector3Macro(Spacing, double);
  ///@}

  ///@{
  /** Inner edge of a brick in voxels, 2 to 1024; even, if levels are to be made. Default: 64. */
  void SetBrickSize(int size);
  vtkGetMacro(BrickSize, int);
  ///@}

  ///@{
  /** Of the output's array. Default: "scalars". */
  void SetArrayName(const char* name);
  const char* GetArrayName() const
  {
    return this->ArrayName.c_str();
  }
  ///@}

  ///@{
  /** What messages call the volume. Default: "levels read by a function". */
  void SetName(const char* name);
  const char* GetName() const
  {
    return this->Name.c_str();
  }
  ///@}

protected:
  vtkCallbackVolumeSource() = default;
  ~vtkCallbackVolumeSource() override = default;

  std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) override;

private:
  vtkCallbackVolumeSource(const vtkCallbackVolumeSource&) = delete;
  void operator=(const vtkCallbackVolumeSource&) = delete;

  struct GivenLevel
  {
    long long Dimensions[3];
    long long Factor[3];
  };
  template <typename T>
  void Set(T& member, const T& value);

  ReadFunction Function;
  std::vector<GivenLevel> Levels;
  int ScalarType = VTK_UNSIGNED_CHAR;
  int NumberOfComponents = 1;
  bool Labels = false;
  double ScalarRange[2] = { 0.0, -1.0 };
  double Origin[3] = { 0.0, 0.0, 0.0 };
  double Spacing[3] = { 1.0, 1.0, 1.0 };
  int BrickSize = 64;
  std::string ArrayName = "scalars";
  std::string Name = "levels read by a function";
};
