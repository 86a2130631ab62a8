// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// A scalar field given by a formula, with bounds that are proved, not sampled.
///
/// Places are *doubled level-0 voxel coordinates*: t = 2 x0, so that the centre of voxel x of a
/// level with factor f is the integer t = f (2 x + 1) - 1, exact for any size. `factor` is the edge
/// of the voxel that is asked for, in level-0 voxels: a formula with detail at all scales leaves
/// out what a voxel of that size can't show. Values lie in [0, 1] inside the volume; the centre of
/// a partial last group may lie beyond it. Thread: immutable.
class Formula
{
public:
  /// The places of a grid, per axis.
  using Grid = std::array<std::vector<std::int64_t>, 3>;

  Formula() = default;
  Formula(const Formula&) = delete;
  Formula& operator=(const Formula&) = delete;
  Formula(Formula&&) = delete;
  Formula& operator=(Formula&&) = delete;
  virtual ~Formula() = default;

  virtual double Value(const Int3& place, const Int3& factor) const = 0;
  /// Contains the value at each place of the closed box, for this factor.
  virtual ValueRange Bound(const Int3& low, const Int3& high, const Int3& factor) const = 0;
  /// The values of a grid, x fastest: exactly what Value() gives, faster.
  virtual void Fill(const Grid& places, const Int3& factor, double* values) const;
};

/// The formulas that come with the library.
enum class FormulaKind
{
  Constant, ///< 1/2 everywhere
  Ramp,     ///< (x + 1/2) / dimension along x, linear
  Shells,   ///< four concentric spherical shells of value 1, soft at their faces, 0 between them
  MarschnerLobb, ///< the test signal of Marschner and Lobb 1994, alpha = 1/4, f = 6
  Sponge         ///< Menger's sponge: 1 in the solid, 0 in the holes, soft at the voxel's scale
};

inline constexpr std::array<FormulaKind, 5> AllFormulaKinds = { FormulaKind::Constant,
  FormulaKind::Ramp, FormulaKind::Shells, FormulaKind::MarschnerLobb, FormulaKind::Sponge };

/// "constant", "ramp", "shells", "marschner-lobb", "sponge".
const char* ToString(FormulaKind kind);
/// The kind of that name. Errors: InvalidArgument that lists the names.
Result<FormulaKind> FormulaKindFromName(const std::string& name);

/// A formula stretched over a volume.
std::shared_ptr<const Formula> MakeFormula(FormulaKind kind, const Int3& dimensions);
std::shared_ptr<const Formula> MakeConstant(double value);
/// A ramp along one axis, 0 to 2.
std::shared_ptr<const Formula> MakeRamp(const Int3& dimensions, int axis);
/// `count` shells around the centre; the outermost touches the nearest faces of the volume.
std::shared_ptr<const Formula> MakeShells(const Int3& dimensions, int count);

} // namespace teravox
