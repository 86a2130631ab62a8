// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkHDF5PyramidReader
 * @brief presents an HDF5 pyramid, or one HDF5 dataset, as a lazy image
 *
 * Reads pyramids written by vtkHDF5PyramidWriter or `teravox convert`, images of VTKHDF files, and
 * any 3-D dataset (z,y,x[,component]) named by DatasetPath. Opening reads names, shapes and
 * attributes only. See vtkBrickSourceAlgorithm for what the output is.
 */
#pragma once

#include "vtkBrickSourceAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <string> // for the names

class VTKRENDERINGOUTOFCORE_EXPORT vtkHDF5PyramidReader : public vtkBrickSourceAlgorithm
{
public:
  static vtkHDF5PyramidReader* New();
  vtkTypeMacro(vtkHDF5PyramidReader, vtkBrickSourceAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The file. Default: none, an error when the pipeline updates. A file that is replaced while the
   * reader holds it is opened again after Modified().
   */
  void SetFileName(VTK_FILEPATH const char* name);
  const char* GetFileName() const { return this->FileName.c_str(); }
  ///@}

  ///@{
  /**
   * A dataset in the file. Default: empty, the file's pyramid, else the image of a VTKHDF file.
   */
  void SetDatasetPath(const char* path);
  const char* GetDatasetPath() const { return this->DatasetPath.c_str(); }
  ///@}

  ///@{
  /**
   * Inner edge of the bricks that are handed to the mapper, in voxels, 2 to 1024; independent of
   * the chunks in the file. Default: 64.
   */
  void SetBrickSize(int size);
  vtkGetMacro(BrickSize, int);
  ///@}

  /** 1 if the file can be opened with the present DatasetPath, else 0; reports no error. */
  int CanReadFile(VTK_FILEPATH const char* name);

  ///@{
  /** For lists of readers. */
  static const char* GetFileExtensions() { return ".h5 .hdf5 .vtkhdf .hdf"; }
  static const char* GetDescriptiveName() { return "HDF5 pyramid"; }
  ///@}

protected:
  vtkHDF5PyramidReader() = default;
  ~vtkHDF5PyramidReader() override = default;

  std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) override;
  bool IsBrickSourceOutdated() override;

private:
  vtkHDF5PyramidReader(const vtkHDF5PyramidReader&) = delete;
  void operator=(const vtkHDF5PyramidReader&) = delete;

  std::string FileName;
  std::string DatasetPath;
  int BrickSize = 64;
  vtkMTimeType CheckedTime = 0;
  std::string OpenedVersion; // size and time of the file when it was opened
};
