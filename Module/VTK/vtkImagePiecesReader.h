// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkImagePiecesReader
 * @brief reads parallel VTK images (.pvti) in pieces, holding no more than is asked for
 *
 * A .pvti file names .vti files and the part of the image that each has. Of an update extent those
 * files are opened that have some of it, one after another, and of them that part is read
 * (vtkXMLImageDataReader); vtkXMLPImageDataReader keeps what it has read of each file, which in
 * the end is the whole image. Parts may overlap: the first file counts. A file that is missing is
 * an error at once, a part that no file has when it is asked for; both are named.
 *
 * The output has one array. What the pieces say of origin and spacing isn't looked at, as in VTK.
 * Thread: one.
 */
#pragma once

#include "vtkImageAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for what is read
#include <string> // for names

class VTKRENDERINGOUTOFCORE_EXPORT vtkImagePiecesReader : public vtkImageAlgorithm
{
public:
  static vtkImagePiecesReader* New();
  vtkTypeMacro(vtkImagePiecesReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The .pvti file. Default: empty, an error. */
  void SetFileName(const char* name);
  const char* GetFileName() const { return this->FileName.c_str(); }
  ///@}

  ///@{
  /**
   * The array to read. Default: empty, the active scalars of the points, else of the cells, else
   * the only array.
   */
  void SetArrayName(const char* name);
  const char* GetArrayName() const { return this->ArrayName.c_str(); }
  ///@}

  /** Whether a file is the index of an image's pieces, all of which are there. Prints nothing. */
  static int CanReadFile(const char* name);

  ///@{
  /** The files of the pieces, in their order; none before UpdateInformation(). */
  int GetNumberOfPieces() const;
  const char* GetPieceFileName(int piece) const;
  ///@}

  vtkImagePiecesReader(const vtkImagePiecesReader&) = delete;
  vtkImagePiecesReader& operator=(const vtkImagePiecesReader&) = delete;

protected:
  vtkImagePiecesReader();
  ~vtkImagePiecesReader() override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  struct Content;
  std::string FileName;
  std::string ArrayName;
  std::unique_ptr<Content> Read;
};
