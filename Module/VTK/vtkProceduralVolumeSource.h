// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkProceduralVolumeSource
 * @brief a volume given by a formula, of any size, without storage
 *
 * Its levels are the formula evaluated at the voxel centres of each level. See
 * vtkBrickSourceAlgorithm for what the output is.
 */
#pragma once

#include "vtkBrickSourceAlgorithm.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <string> // for the name of the formula

class VTKRENDERINGOUTOFCORE_EXPORT vtkProceduralVolumeSource : public vtkBrickSourceAlgorithm
{
public:
  static vtkProceduralVolumeSource* New();
  vtkTypeMacro(vtkProceduralVolumeSource, vtkBrickSourceAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum FunctionType
  {
    CONSTANT = 0,       ///< 1/2 everywhere
    RAMP = 1,           ///< from 0 to 1 along x
    SHELLS = 2,         ///< concentric spherical shells
    MARSCHNER_LOBB = 3, ///< the test signal of Marschner and Lobb 1994
    SPONGE = 4          ///< Menger's sponge, with detail down to the voxel
  };

  ///@{
  /** The formula; its values 0 and 1 become the ends of the output range. Default: SHELLS. */
  void SetFunction(int function);
  vtkGetMacro(Function, int);
  ///@}

  ///@{
  /**
   * The formula by name: constant, ramp, shells, marschner-lobb, sponge. Another name is reported
   * as an error and changes nothing.
   */
  void SetFunctionName(const char* name);
  const char* GetFunctionName();
  ///@}

  ///@{
  /** Voxels along each axis, 1 to 2^31 - 1. Default: 256 each. */
  void SetDimensions(long long x, long long y, long long z);
  void SetDimensions(const long long dimensions[3]);
  void GetDimensions(long long dimensions[3]) VTK_SIZEHINT(3);
  ///@}

  ///@{
  /** VTK_UNSIGNED_CHAR and the other types of 8, 16, 32 bits, VTK_DOUBLE. Default:
   * VTK_UNSIGNED_CHAR. */
  void SetScalarType(int type);
  vtkGetMacro(ScalarType, int);
  ///@}

  ///@{
  /**
   * Voxel values of the formula's 0 and 1. Default: (0,-1), the whole range of an integer type, 0
   * and 1 for floats.
   */
  void SetOutputRange(double minimum, double maximum);
  vtkGetVector2Macro(OutputRange, double);
  ///@}

  ///@{
  /** World position of the centre of voxel (0,0,0). Default: the origin. */
  void SetOrigin(double x, double y, double z);
  vtkGetVector3Macro(Origin, double);
  ///@}

  ///@{
  /** Edge lengths of a voxel, above 0. Default: 1 each. */
  void SetSpacing(double x, double y, double z);
  vtkGetVector3Macro(Spacing, double);
  ///@}

  ///@{
  /** Inner edge of a brick in voxels, 2 to 1024. Default: 64. */
  void SetBrickSize(int size);
  vtkGetMacro(BrickSize, int);
  ///@}

protected:
  vtkProceduralVolumeSource() = default;
  ~vtkProceduralVolumeSource() override = default;

  std::shared_ptr<teravox::BrickSource> MakeBrickSource(std::string& reason) override;

private:
  vtkProceduralVolumeSource(const vtkProceduralVolumeSource&) = delete;
  void operator=(const vtkProceduralVolumeSource&) = delete;

  int Function = SHELLS;
  long long Dimensions[3] = { 256, 256, 256 };
  int ScalarType = VTK_UNSIGNED_CHAR;
  double OutputRange[2] = { 0.0, -1.0 };
  double Origin[3] = { 0.0, 0.0, 0.0 };
  double Spacing[3] = { 1.0, 1.0, 1.0 };
  int BrickSize = 64;
};
