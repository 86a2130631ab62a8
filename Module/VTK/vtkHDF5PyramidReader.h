// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkHDF5PyramidReader
 * @brief presents a volume in an HDF5 file, mostly a pyramid, as a lazy image
 *
 * Reads pyramids written by vtkHDF5PyramidWriter or `teravox convert`, those of Imaris,
 * BigDataViewer (also by its XML file), N5 and Paintera, images of VTKHDF files, and datasets of
 * two to five axes; docs/formats.md has the list. Opening reads names, shapes and attributes only.
 * See vtkBrickSourceAlgorithm for what the output is.
 *
 * With several time points the output's information has TIME_STEPS and TIME_RANGE (the numbers of
 * the points, where the file's times don't ascend), the time that is asked for decides, and the
 * mapper reads the points beside it ahead. If TimePoint is set, the volume doesn't change with
 * time.
 */
#pragma once

#include "vtkBrickSourceAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::shared_ptr
#include <string> // for the names
#include <vector> // for the names of a series

namespace teravox
{
class HDF5BrickSource;
struct VolumeDescription;
}

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
   * The files of a series, one for each step in time, in their order, instead of FileName. Their
   * volumes may differ in all but should have the same dimensions and type: others are drawn, but
   * not read ahead. Default: none.
   */
  void AddFileName(VTK_FILEPATH const char* name);
  void RemoveAllFileNames();
  int GetNumberOfFileNames() const { return static_cast<int>(this->FileNames.size()); }
  ///@}
  /**
   * The time of a step, 0 ... GetNumberOfFileNames() - 1, after its file was added. Default: its
   * number. They must ascend with the steps.
   */
  void SetTimeValue(int step, double time);

  ///@{
  /**
   * A dataset or group in the file. Default: empty, what the file itself says.
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

  ///@{
  /**
   * Whether a volume of 2^28 voxels and more with one level gets coarser ones that are made of a
   * few voxels of each group while they are read (docs/formats.md); else it is drawn at full
   * resolution from any distance. Default: on.
   */
  void SetPreviews(bool previews);
  vtkGetMacro(Previews, bool);
  vtkBooleanMacro(Previews, bool);
  ///@}

  ///@{
  /**
   * The channel, counted from 0; -1: all of them, at most 4, as components of one array. What a
   * channel is depends on the layout: a set-up of BigDataViewer, an array of VTKHDF. Default: 0.
   */
  void SetChannel(int channel);
  vtkGetMacro(Channel, int);
  ///@}

  ///@{
  /**
   * The time point, counted from 0, whatever time is asked for. Default: -1, the last time step at
   * or before the time that the pipeline asks for, the first one without such a wish.
   */
  void SetTimePoint(int timePoint);
  vtkGetMacro(TimePoint, int);
  ///@}

  ///@{
  /**
   * What the file has; opens it if need be. Without a readable volume: an error, and 0 or empty.
   */
  int GetNumberOfChannels();
  int GetNumberOfTimePoints();
  std::string GetChannelName(int channel);
  /** What was seen in the file and why it was taken so, a line each. */
  std::string GetDescriptionText();
  ///@}

  /** 1 if the file can be opened with the present DatasetPath, else 0; reports no error. */
  int CanReadFile(VTK_FILEPATH const char* name);

  ///@{
  /** For lists of readers. */
  static const char* GetFileExtensions()
  {
    return ".h5 .hdf5 .vtkhdf .hdf .ims .xml .emd .nxs .n5h5";
  }
  static const char* GetDescriptiveName() { return "HDF5 volume"; }
  ///@}

protected:
  vtkHDF5PyramidReader();
  ~vtkHDF5PyramidReader() override;

  std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) override;
  std::vector<double> FindTimes() override;
  std::shared_ptr<teravox::BrickSeries> MakeBrickSeries(std::string& reason) override;
  bool IsBrickSourceOutdated() override;

private:
  vtkHDF5PyramidReader(const vtkHDF5PyramidReader&) = delete;
  void operator=(const vtkHDF5PyramidReader&) = delete;

  std::string VersionOfFiles() const;
  std::shared_ptr<teravox::HDF5BrickSource> OpenTimePoint(int time, std::string& reason);

  std::string FileName;
  std::vector<std::string> FileNames;
  std::vector<double> TimeValues;
  std::string DatasetPath;
  const teravox::VolumeDescription* EnsureDescription();
  int BrickSize = 64;
  bool Previews = true;
  int Channel = 0;
  int TimePoint = -1;
  std::unique_ptr<teravox::VolumeDescription> Description; // of FileName, when it was opened last
  std::shared_ptr<teravox::HDF5BrickSource> JustOpened;    // to learn the times, and not used yet
  vtkMTimeType CheckedTime = 0;
  std::string OpenedVersion; // size and time of the file when it was opened
};
