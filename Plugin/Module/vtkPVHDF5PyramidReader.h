// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkPVHDF5PyramidReader
 * @brief vtkHDF5PyramidReader as ParaView's panels want it
 *
 * Takes the files of its Open dialogue one by one, puts what the volume has into field data of the
 * output, which the Information tab lists, and refuses to present a level that the main memory
 * can't hold.
 */
#pragma once

#include "vtkHDF5PyramidReader.h"
#include "vtkSmartPointer.h"          // for the texts
#include "vtkTeravoxParaViewModule.h" // for the export macro

#include <string> // for texts
#include <vector> // for the names of files

class vtkStringArray;

class VTKTERAVOXPARAVIEW_EXPORT vtkPVHDF5PyramidReader : public vtkHDF5PyramidReader
{
public:
  static vtkPVHDF5PyramidReader* New();
  vtkTypeMacro(vtkPVHDF5PyramidReader, vtkHDF5PyramidReader);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The files of the Open dialogue: one is a volume, with the time points that it has itself;
   * several are the steps of a series. Default: none.
   */
  void AddFile(VTK_FILEPATH const char* name);
  void RemoveAllFiles();
  ///@}

  ///@{
  /**
   * What the volume has, a text for each level and each channel, such as "512 x 512 x 256, 256
   * bricks, 128 MiB"; empty without a readable volume. Owned by this object until the next
   * call.
   */
  vtkStringArray* GetLevelTexts();
  vtkStringArray* GetChannelNames();
  ///@}

  ///@{
  /**
   * Of all levels together: how many bricks of the present BrickSize, and bytes of voxels as they
   * are in memory, or the largest number where there are more. 0 without a readable volume.
   */
  vtkIdType GetNumberOfBricks();
  vtkIdType GetNumberOfVoxelBytes();
  ///@}

  /** Time points of the file, or files of the series. */
  int GetNumberOfSteps();

protected:
  vtkPVHDF5PyramidReader();
  ~vtkPVHDF5PyramidReader() override;

  int RequestInformation(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkPVHDF5PyramidReader(const vtkPVHDF5PyramidReader&) = delete;
  void operator=(const vtkPVHDF5PyramidReader&) = delete;

  struct LevelSize
  {
    long long Dimensions[3] = { 0, 0, 0 };
    double Bricks = 0; // more than 64 bits hold
    double Bytes = 0;
  };
  LevelSize SizeOf(int level);
  bool FitsMemory();

  std::vector<std::string> Files;
  vtkSmartPointer<vtkStringArray> LevelTexts;
  vtkSmartPointer<vtkStringArray> ChannelNames;
};
