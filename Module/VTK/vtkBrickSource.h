// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkBrickSource
 * @brief a reference-counted holder of a brick source, with the key under which it travels
 *
 * The holder lies in the information of the *array* that presents one level of the volume
 * (vtkAbstractArray::GetInformation()). Filters that pass an array through keep it, filters that
 * compute make another array. Some of those copy the information as well; therefore the holder
 * remembers the very array that it was made for, and Get() returns it for no other.
 *
 * Thread: used by one thread at a time; the teravox::BrickSource inside is internally synchronized.
 */
#pragma once

#include "vtkObject.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::shared_ptr, std::unique_ptr
#include <string> // for the name

class vtkAbstractArray;
class vtkDataArray;
class vtkImageData;
class vtkInformationObjectBaseKey;

namespace teravox
{
class BrickSeries;
class BrickSource;
}

class VTKRENDERINGOUTOFCORE_EXPORT vtkBrickSource : public vtkObject
{
public:
  static vtkBrickSource* New();
  vtkTypeMacro(vtkBrickSource, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

#ifndef __VTK_WRAP__
  ///@{
  /**
   * The source itself. Default: none.
   */
  void SetBrickSource(std::shared_ptr<teravox::BrickSource> source);
  const std::shared_ptr<teravox::BrickSource>& GetBrickSource() const;
  ///@}

  ///@{
  /**
   * The series that the source is a step of, and which one, counted from 0. Default: none, 0. With
   * it the mapper reads the steps beside it ahead.
   */
  void SetBrickSeries(std::shared_ptr<teravox::BrickSeries> series, int step);
  const std::shared_ptr<teravox::BrickSeries>& GetBrickSeries() const;
  int GetStep() const;
  ///@}
#endif

  /**
   * Which level of the pyramid the array presents, and which part of it: the first tuple of the
   * array is the voxel `firstVoxel` (counted from 0 in that level), and the array has `dimensions`
   * voxels along each axis. The mapper places level 0 relative to the image by these numbers.
   * Default: level 0, (0,0,0), (0,0,0).
   */
  void SetPresentation(int level, const long long firstVoxel[3], const long long dimensions[3]);
  int GetPresentedLevel() const;
  void GetPresentedFirstVoxel(long long firstVoxel[3]) const;
  void GetPresentedDimensions(long long dimensions[3]) const;

  /**
   * Whether `image` lies where the source puts the presented part: false after a filter has moved
   * the image and kept its array. False without a source.
   */
  bool IsInPlace(vtkImageData* image) const;

  ///@{
  /**
   * What the source says about itself: 0 levels and empty values without a source. A level outside
   * 0...GetNumberOfLevels()-1 has the dimensions (0,0,0).
   */
  int GetNumberOfLevels() const;
  void GetLevelDimensions(int level, long long dimensions[3]) const;
  int GetNumberOfComponents() const;
  /** VTK_UNSIGNED_CHAR and so on; VTK_VOID without a source. */
  int GetScalarType() const;
  /** (0,-1) where the range isn't known. */
  void GetScalarRange(double range[2]) const;
  ///@}

  ///@{
  /**
   * Geometry and kind of level 0: world position of the centre of its voxel (0,0,0), edge lengths
   * of a voxel; whether its values are labels. (0,0,0), (1,1,1), false without a source.
   */
  void GetOrigin(double origin[3]) const;
  void GetSpacing(double spacing[3]) const;
  bool HasLabels() const;
  /** How messages call the volume; empty without a source. */
  std::string GetName() const;
  ///@}

  /**
   * Reads the voxels [first, first + size) of one level, with several threads: one tuple per voxel,
   * x fastest. Null, after an error, if the box isn't inside the level or if any of it can't be
   * read. The caller owns the array.
   */
  VTK_NEWINSTANCE
  vtkDataArray* ReadVoxels(int level, const long long first[3], const long long size[3]);

  /**
   * Puts this holder into the information of `array` and remembers the array (weakly). A holder
   * belongs to one array: attaching it to a second one takes it from the first.
   */
  void Attach(vtkAbstractArray* array);

  /**
   * The holder that was attached to this very array, or nullptr: also for a copy of the array that
   * copied its information.
   */
  static vtkBrickSource* Get(vtkAbstractArray* array);

  /** The key in the array's information. Use Attach() and Get(): the bare key survives copies. */
  static vtkInformationObjectBaseKey* BRICK_SOURCE();

protected:
  vtkBrickSource();
  ~vtkBrickSource() override;

private:
  vtkBrickSource(const vtkBrickSource&) = delete;
  void operator=(const vtkBrickSource&) = delete;

  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
