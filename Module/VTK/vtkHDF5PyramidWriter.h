// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkHDF5PyramidWriter
 * @brief streams any image into an HDF5 pyramid, in bounded memory
 *
 * The input is asked for one box after the other by UPDATE_EXTENT, so that a source that can
 * produce sub-extents is never held as a whole. An input that fits into half of MemoryLimit is
 * asked for at once, because many readers decode the whole file for any part of it.
 * Instead of an input, ImageFileName names files that are read piece by piece without VTK's
 * readers.
 *
 * Writes the active scalars of the points, else of the cells; or the array named by ArrayName.
 * The file appears under its name only when it is complete. Progress events tell the fraction;
 * AbortExecute cancels, and leaves nothing.
 */
#pragma once

#include "vtkAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <string> // for the names

class vtkDataObject;

namespace teravox
{
class VoxelReader;
}

class VTKRENDERINGOUTOFCORE_EXPORT vtkHDF5PyramidWriter : public vtkAlgorithm
{
public:
  static vtkHDF5PyramidWriter* New();
  vtkTypeMacro(vtkHDF5PyramidWriter, vtkAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum CompressionType
  {
    NONE = 0,
    DEFLATE = 1, ///< shuffle and deflate: smallest, readable everywhere
    LZ4 = 2      ///< registered filter 32004: fastest to read
  };

  enum DownsamplingType
  {
    AVERAGE = 0, ///< mean of each group of voxels, NaN left out
    MODE = 1     ///< most frequent value: for labels
  };

  /** The image to write; SetInputConnection() for a pipeline. */
  void SetInputData(vtkDataObject* data);

  ///@{
  /**
   * An image to write instead of an input: MetaImage, NRRD, NIfTI, MRC, TIFF, PNG, JPEG, PNM, BMP,
   * TGA, DICOM; one file, a folder of slices, or a pattern of their names, with * or %03d.
   * ArrayName has no effect. Default: empty, the input.
   */
  void SetImageFileName(VTK_FILEPATH const char* name);
  const char* GetImageFileName() const { return this->ImageFileName.c_str(); }
  ///@}

  ///@{
  /** Distance of the image file's voxels along x, y, z. Default: NaN, what the file says. */
  vtkSetVector3Macro(ImageSpacing, double);
  vtkGetVector3Macro(ImageSpacing, double);
  ///@}
  ///@{
  /** Place of the image file's first voxel. Default: NaN, what the file says. */
  vtkSetVector3Macro(ImageOrigin, double);
  vtkGetVector3Macro(ImageOrigin, double);
  ///@}
  ///@{
  /** UID of a DICOM series. Default: empty, there is only one. */
  void SetImageSeries(const char* uid);
  const char* GetImageSeries() const { return this->ImageSeries.c_str(); }
  ///@}

  /**
   * Whether ImageFileName may be this: 0 if it is another kind of file, or one of those that are
   * left to VTK's readers, for example with voxels as text. Reads headers.
   */
  static int CanReadImageFile(VTK_FILEPATH const char* name);

  ///@{
  /** The file to write. Default: none, an error. */
  void SetFileName(VTK_FILEPATH const char* name);
  const char* GetFileName() const { return this->FileName.c_str(); }
  ///@}

  ///@{
  /** Array to write. Default: empty, the active scalars. */
  void SetArrayName(const char* name);
  const char* GetArrayName() const { return this->ArrayName.c_str(); }
  ///@}

  ///@{
  /** Edge of a storage chunk in voxels, a multiple of 8 from 8 to 512. Default: 64. */
  vtkSetMacro(BrickSize, int);
  vtkGetMacro(BrickSize, int);
  ///@}

  ///@{
  /** Default: LZ4. */
  vtkSetClampMacro(Compression, int, NONE, LZ4);
  vtkGetMacro(Compression, int);
  void SetCompressionToNone() { this->SetCompression(NONE); }
  void SetCompressionToDeflate() { this->SetCompression(DEFLATE); }
  void SetCompressionToLZ4() { this->SetCompression(LZ4); }
  ///@}

  ///@{
  /** 1 (fast) to 12 (small); 0, the default, takes 1. */
  vtkSetMacro(CompressionLevel, int);
  vtkGetMacro(CompressionLevel, int);
  ///@}

  ///@{
  /** How coarser levels are made. Default: AVERAGE. */
  vtkSetClampMacro(Downsampling, int, AVERAGE, MODE);
  vtkGetMacro(Downsampling, int);
  void SetDownsamplingToAverage() { this->SetDownsampling(AVERAGE); }
  void SetDownsamplingToMode() { this->SetDownsampling(MODE); }
  ///@}

  ///@{
  /**
   * Bytes that writing may take, the input's box included; what filters upstream hold beside their
   * output doesn't count. Default: 1 GiB. A limit too small is an error that says how much would
   * do.
   */
  vtkSetMacro(MemoryLimit, unsigned long long);
  vtkGetMacro(MemoryLimit, unsigned long long);
  ///@}

  ///@{
  /** The value of voxels that needn't be stored. Default: 0. */
  vtkSetMacro(FillValue, double);
  vtkGetMacro(FillValue, double);
  ///@}

  ///@{
  /**
   * Whether Write() goes on from what an unfinished one to the same file with the same settings
   * left, also if its process was killed, and leaves such things itself when it fails or is
   * aborted: "FILE. <process>.part" and ".log". Otherwise they are removed. Default: off.
   */
  vtkSetMacro(Resume, bool);
  vtkGetMacro(Resume, bool);
  vtkBooleanMacro(Resume, bool);
  ///@}

  ///@{
  /**
   * What the input is made of, for example the name, size and time of a file: Write() goes on only
   * where that is the same. Default: empty; for ImageFileName its files, their sizes and times.
   */
  void SetSourceName(const char* name);
  const char* GetSourceName() const { return this->SourceName.c_str(); }
  ///@}

  /** Writes the file. Returns 1, or 0 after an error or an abort. */
  int Write();

  ///@{
  /** What the last Write() did; of level 0, bytes without compression, while it runs as well. */
  vtkGetMacro(BytesDone, unsigned long long);
  vtkGetMacro(BytesTotal, unsigned long long);
  vtkGetMacro(FileBytes, unsigned long long);
  vtkGetMacro(NumberOfLevels, int);
  ///@}
  /** Chunks that the last Write() took from an unfinished one. */
  vtkGetMacro(NumberOfChunksSaved, vtkIdType);

protected:
  vtkHDF5PyramidWriter();
  ~vtkHDF5PyramidWriter() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;

private:
  vtkHDF5PyramidWriter(const vtkHDF5PyramidWriter&) = delete;
  void operator=(const vtkHDF5PyramidWriter&) = delete;

  /// Error messages were given; false.
  bool WriteImage();
  bool WriteInput();
  bool WriteVolume(
    teravox::VoxelReader& reader, const std::string& source, unsigned long long forInput);

  std::string ImageFileName;
  std::string ImageSeries;
  double ImageSpacing[3]; // set by the constructor
  double ImageOrigin[3];
  std::string FileName;
  std::string ArrayName;
  int BrickSize = 64;
  int Compression = LZ4;
  int CompressionLevel = 0;
  int Downsampling = AVERAGE;
  unsigned long long MemoryLimit = 1ull << 30;
  double FillValue = 0.0;
  bool Resume = false;
  std::string SourceName;
  unsigned long long BytesDone = 0;
  unsigned long long BytesTotal = 0;
  unsigned long long FileBytes = 0;
  int NumberOfLevels = 0;
  vtkIdType NumberOfChunksSaved = 0;
};
