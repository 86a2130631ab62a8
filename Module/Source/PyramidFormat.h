// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

/// Names and numbers of the pyramid file, layout version 1. Dataset shapes are (z,y,x[,component]).
///
///     /VTKHDF            attributes Version (1,0), Type "ImageData", WholeExtent, Origin, Spacing,
///                        Direction, as VTK defines them: stock ParaView and h5py open level 0
///       /PointData/<array> or /CellData/<array>
///                        (WholeExtent starts at 0: vtkHDFReader needs it)
///     /Pyramid           attributes Version; Downsampling ("average" or "mode"); ExtentStart, the
///                        index that the image gave to the first voxel; multiscales (JSON,
///                        OME-NGFF 0.4: axes, paths, scale and translation per level)
///       /0               hard link to the level-0 dataset;   /1 ... /n  the other levels
///       /Statistics      attributes Range (2 x f64) and Histogram (256 x u64, equal bins over
///                        Range), of all components of level 0; NaN is left out of both
///         /<level>/<edge>/Range     per cell of edge^3 voxels (edge 8, 64, 512, ... until one cell
///                        holds the level): (z,y,x,2*components) minimum and maximum of each
///                        component, in the type of the voxels. No value at all (all NaN): minimum
///                        +inf, maximum -inf.
///         /<level>/<edge>/Gradient  (z,y,x,component) f32: an upper bound, rounded up, of the
///                        central-difference gradient magnitude of the cell's voxels, in value per
///                        world unit. Exact but for cells at the seams of the boxes in which the
///                        writer worked, where it follows from the ranges of neighbouring cells.
///
/// A chunk that isn't written means the dataset's fill value; that of Range is the voxels' own, so
/// that an unwritten region has the range of its single value. Version is written last: an
/// unfinished file isn't a pyramid.
namespace teravox::PyramidFormat
{

inline constexpr std::int64_t Version = 1;
inline constexpr const char* ImageGroup = "/VTKHDF";
inline constexpr const char* PyramidGroup = "/Pyramid";
inline constexpr const char* StatisticsGroup = "/Pyramid/Statistics";
inline constexpr const char* MultiscalesName = "multiscales";
/// Voxels along the edge of the finest statistics cell; each next is this factor coarser.
inline constexpr std::int64_t CellEdge = 8;
/// Cells along the edge of a chunk of statistics; a multiple of CellEdge.
inline constexpr std::int64_t CellsPerChunk = 32;
inline constexpr int HistogramBins = 256;

} // namespace teravox::PyramidFormat
