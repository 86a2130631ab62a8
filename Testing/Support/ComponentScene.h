// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ExpectTruth.h"
#include "Scene.h"
#include "TruthComponents.h"

#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

class vtkColorTransferFunction;
class vtkPiecewiseFunction;

namespace teravox::test
{

/// The image of MakeImage() with several components, each from another view of the field. Of
/// `range` low and high are those of the options, the same for all.
vtkSmartPointer<vtkImageData> MakeComponentImage(const ImageOptions& options, int components);
/// The same from the component's number and the place.
vtkSmartPointer<vtkImageData> MakeComponentImage(const ImageOptions& options, int components,
  const std::function<double(int, double, double, double)>& field);

/// Numbers of a seed, drawn one after the other.
class RandomNumbers
{
public:
  explicit RandomNumbers(unsigned seed)
    : Generator(seed)
  {
  }
  double Uniform(double low, double high)
  {
    return std::uniform_real_distribution<double>(low, high)(this->Generator);
  }
  template <typename... Values>
  auto Chosen(Values... values)
  {
    const std::array all{ values... };
    return all[std::uniform_int_distribution<std::size_t>(0, all.size() - 1)(this->Generator)];
  }

private:
  std::mt19937 Generator;
};

/// A small volume of any type, shape and number of components, with a share of voxels without a
/// value where there may be such.
struct RandomComponents
{
  RandomComponents(RandomNumbers& random, double shareOfNaN);

  int Count;
  bool Dependent;
  ImageOptions Options;
};

/// Functions for the components of a stage: `shapes` one after the other, with colours of their
/// own.
void SetComponentTransfer(Stage& stage, const std::vector<OpacityShape>& shapes, double low,
  double high, double unitDistance);

/// The truth of what a stage shows of a source with several components; both have to outlive it.
/// Of two components with a function of two dimensions: by that, over both.
class ComponentTruth
{
public:
  ComponentTruth(Stage& stage, const std::shared_ptr<BrickSource>& source);
  const TruthComponents& Scene() const { return this->Scene_; }
  /// See StageTruth::SetMask().
  void SetMask(const std::vector<TruthLevel>& levels);
  /// See StageTruth::Excess().
  ImageDifference Excess(
    const std::vector<float>& picture, double small, ImageDifference* plain = nullptr) const;

private:
  std::vector<std::shared_ptr<BrickSource>> Scalars;
  std::vector<std::unique_ptr<StageTruth>> Parts;
  std::unique_ptr<TruthImage> Image;
  TruthComponents Scene_;
  int Width;
};

/// See ExpectTruth(); `mask`: levels of one, or none.
void ExpectComponentTruth(Stage& stage, const std::shared_ptr<BrickSource>& source,
  const std::string& name, const Bounds& bounds = {}, const std::vector<TruthLevel>& mask = {});

} // namespace teravox::test
