// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchTruth.h"

#include "BrickSource.h"
#include "TruthIntegrator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <numeric>
#include <vtkCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>

namespace teravox::program
{
namespace
{

/// To be raised whenever the reference integrator's results change.
constexpr int TruthVersion = 1;

/// Absolute, per pixel and channel.
constexpr double TruthTolerance = 1e-5;

/// Where the plain error is at most this, the envelope isn't asked: the plain error is an upper
/// bound.
constexpr double SmallError = 0.1 / 255;

using Color = std::array<float, 3>;

struct Sample
{
  Color Center{};
  Color Min{};
  Color Max{};
  std::uint32_t HasEnvelope = 0;
};

Matrix4 ToMatrix(vtkMatrix4x4* matrix)
{
  Matrix4 result{};
  std::copy_n(matrix->GetData(), 16, result.begin());
  return result;
}

Color ToColor(const TruthColor& color)
{
  return { static_cast<float>(color[0]), static_cast<float>(color[1]),
    static_cast<float>(color[2]) };
}

/// Of anything that lies flat in memory.
class Fingerprint
{
public:
  void Add(const void* data, std::size_t bytes)
  {
    const auto* at = static_cast<const unsigned char*>(data);
    for (; bytes >= sizeof(std::uint64_t); bytes -= sizeof(std::uint64_t))
    {
      std::uint64_t word = 0;
      std::memcpy(&word, at, sizeof(word));
      this->Mix(word);
      at += sizeof(word);
    }
    std::uint64_t rest = bytes;
    std::memcpy(&rest, at, bytes);
    this->Mix(rest);
  }
  template <typename T>
  void Add(const T& value)
  {
    static_assert(std::is_arithmetic_v<T>, "no padding");
    this->Add(&value, sizeof(value));
  }
  template <typename T>
  void AddAll(const T& values)
  {
    this->Add(values.size());
    this->Add(values.data(), values.size() * sizeof(*values.data()));
  }
  std::uint64_t Value() const { return this->Hash; }

private:
  void Mix(std::uint64_t word)
  {
    this->Hash = (this->Hash ^ word) * 0x9E3779B97F4A7C15ULL;
    this->Hash ^= this->Hash >> 32;
  }
  std::uint64_t Hash = 0xCBF29CE484222325ULL;
};

TruthTransfer MakeTransfer(const BenchScene& scene, const BenchVolume& volume)
{
  std::vector<TruthTransfer::AlphaNode> alpha;
  alpha.reserve(scene.Opacity.size());
  for (const auto& node : scene.Opacity)
  {
    alpha.push_back({ node[0], node[1] });
  }
  std::vector<TruthTransfer::ColorNode> color;
  color.reserve(scene.Color.size());
  for (const auto& node : scene.Color)
  {
    color.push_back({ node[0], { node[1], node[2], node[3] } });
  }
  return TruthTransfer::PiecewiseLinear(
    alpha, color, scene.UnitDistance * volume.SmallestSpacing());
}

TruthHeadlight MakeHeadlight(const BenchVolume& volume)
{
  const BenchMaterial light;
  TruthHeadlight::Material material;
  material.Ambient = light.Ambient;
  material.Diffuse = light.Diffuse;
  material.Specular = light.Specular;
  material.SpecularPower = light.SpecularPower;
  TruthHeadlight::Geometry geometry;
  geometry.Spacing = volume.Spacing;
  return { material, geometry };
}

} // namespace

namespace
{

/// The voxels of the levels above 0. The source is read as our mapper reads it.
using UpperLevels = std::vector<std::vector<std::byte>>;

std::vector<TruthLevel> MakeLevels(
  const BenchVolume& volume, const PyramidLayout* layout, const UpperLevels& upper)
{
  std::vector<TruthLevel> levels{ TruthLevel::FromArray(
    volume.Type, volume.Voxels.data(), volume.Dimensions) };
  for (std::size_t i = 0; i < upper.size(); ++i)
  {
    const int level = static_cast<int>(i) + 1;
    levels.push_back(TruthLevel::FromArray(
      volume.Type, upper[i].data(), layout->Dimensions(level), layout->Factor(level)));
  }
  return levels;
}

} // namespace

class BenchTruth::Implementation
{
public:
  Implementation(const BenchScene& scene, const BenchVolume& volume, const PyramidLayout* layout,
    UpperLevels upper, vtkCamera* camera, const std::array<int, 2>& size, int every)
    : View(ToMatrix(camera->GetModelViewTransformMatrix()))
    , Projection(ToMatrix(camera->GetProjectionTransformMatrix(
        static_cast<double>(size[0]) / static_cast<double>(size[1]), -1, 1)))
    , Upper(std::move(upper))
    , Volume(MakeLevels(volume, layout, Upper),
        TruthVolume::WorldFromVoxel({ 0, 0, 0 }, volume.Spacing), TruthInterpolation::Linear, false)
    , Transfer(MakeTransfer(scene, volume))
    , Camera(View, Projection, size[0], size[1])
    , Headlight(MakeHeadlight(volume))
    , Scene{ Volume, Transfer, Camera,
      Upper.empty() ? TruthLevelOfDetail(0) : TruthLevelOfDetail(Volume, Camera),
      scene.Shade ? &Headlight : nullptr, TruthTolerance, IdentityMatrix() }
  {
    // Pixels may be interpolated between those at multiples of 2 and 4: all kinds are taken.
    const int kinds = every % 2 == 0 ? std::min(every, 4) : 1;
    for (int row = 0; row * every < size[1]; ++row)
    {
      for (int column = 0; column * every < size[0]; ++column)
      {
        const int x = column * every + (every / 2 + row % kinds) % every;
        const int y = row * every + (every / 2 + column % kinds) % every;
        if (x < size[0] && y < size[1])
        {
          this->Pixels.push_back({ x, y });
        }
      }
    }
    Fingerprint print;
    print.Add(TruthVersion);
    print.Add(TruthTolerance);
    print.AddAll(this->View);
    print.AddAll(this->Projection);
    print.AddAll(size);
    print.Add(kinds == 1 ? every : -every);
    print.AddAll(scene.Opacity);
    print.AddAll(scene.Color);
    print.Add(scene.UnitDistance);
    print.Add(scene.Shade ? 1 : 0);
    if (scene.Shade)
    {
      const BenchMaterial light;
      print.AddAll(
        std::array<double, 4>{ light.Ambient, light.Diffuse, light.Specular, light.SpecularPower });
    }
    print.Add(static_cast<int>(volume.Type));
    print.AddAll(volume.Dimensions);
    print.AddAll(volume.Spacing);
    print.AddAll(volume.Voxels);
    for (const std::vector<std::byte>& level : this->Upper)
    {
      print.AddAll(level);
    }
    this->Key = print.Value();
  }

  std::vector<std::size_t> ByError(const std::vector<double>& errors, std::size_t count) const
  {
    std::vector<std::size_t> order(errors.size());
    std::iota(order.begin(), order.end(), std::size_t{ 0 });
    const std::size_t first = std::min(count, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(first),
      order.end(), [&](std::size_t a, std::size_t b) { return errors[a] > errors[b]; });
    order.resize(first);
    return order;
  }

  void AddEnvelopes(const std::vector<std::size_t>& indices)
  {
    std::vector<TruthPixel> pixels;
    pixels.reserve(indices.size());
    for (const std::size_t i : indices)
    {
      pixels.push_back(this->Pixels[i]);
    }
    const TruthEnvelope envelope = RenderEnvelope(this->Scene, pixels);
    for (std::size_t i = 0; i < indices.size(); ++i)
    {
      Sample& sample = this->Samples[indices[i]];
      sample.Min = ToColor(envelope.Min[i]);
      sample.Max = ToColor(envelope.Max[i]);
      sample.HasEnvelope = 1;
    }
    this->Changed = this->Changed || !indices.empty();
  }

  /// The largest errors outside of the envelope. Only pixels that could be among the worst get one:
  /// elsewhere the plain error bounds it.
  void CompareWithEnvelope(
    const std::vector<Color>& picture, std::vector<double> errors, BenchErrors& result)
  {
    const std::size_t rank = errors.size() / 1000;
    std::vector<bool> settled(errors.size(), false);
    constexpr std::size_t batch = 32;
    while (true)
    {
      const std::vector<std::size_t> worst = this->ByError(errors, rank + 1 + batch);
      std::vector<std::size_t> open;
      bool done = true;
      for (std::size_t i = 0; i < worst.size(); ++i)
      {
        if (!settled[worst[i]] && errors[worst[i]] > SmallError)
        {
          open.push_back(worst[i]);
          done = done && i > rank;
        }
      }
      if (done)
      {
        result.EnvelopeMax = errors[worst.front()];
        result.EnvelopePercentile999 = errors[worst[std::min(rank, worst.size() - 1)]];
        return;
      }
      std::vector<std::size_t> unknown;
      std::copy_if(open.begin(), open.end(), std::back_inserter(unknown),
        [&](std::size_t i) { return this->Samples[i].HasEnvelope == 0; });
      this->AddEnvelopes(unknown);
      for (const std::size_t i : open)
      {
        const Sample& sample = this->Samples[i];
        errors[i] = 0;
        for (std::size_t c = 0; c < 3; ++c)
        {
          const double below = sample.Min[c] - picture[i][c];
          const double above = picture[i][c] - sample.Max[c];
          errors[i] = std::max({ errors[i], below, above });
        }
        settled[i] = true;
      }
    }
  }

  const Matrix4 View;
  const Matrix4 Projection;
  const UpperLevels Upper;
  const TruthVolume Volume;
  const TruthTransfer Transfer;
  const TruthCamera Camera;
  const TruthHeadlight Headlight;
  const TruthScene Scene;
  std::vector<TruthPixel> Pixels;
  std::vector<Sample> Samples;
  std::uint64_t Key = 0;
  std::string File;
  bool Changed = false;
  double Seconds = 0;
};

BenchTruth::BenchTruth() = default;
BenchTruth::~BenchTruth() = default;

Result<std::unique_ptr<BenchTruth>> BenchTruth::Make(const BenchScene& scene,
  const BenchVolume& volume, const std::array<int, 2>& size, int every, BenchLevels levels,
  const std::string& cache)
{
  vtkNew<vtkCamera> camera;
  Status status = SetUp(scene, volume, static_cast<double>(size[0]) / size[1], camera);
  if (!status.Ok())
  {
    return status;
  }
  const auto source = MakeSource(volume);
  if (!source.Ok())
  {
    return source.GetStatus();
  }
  const PyramidLayout& layout = source.Value()->Info().Layout;
  UpperLevels upper;
  for (int i = 1; levels == BenchLevels::ByPixel && i < layout.NumberOfLevels(); ++i)
  {
    auto level = ReadLevel(*source.Value(), i);
    if (!level.Ok())
    {
      return level.GetStatus();
    }
    upper.push_back(std::move(level.Value()));
  }
  std::unique_ptr<BenchTruth> truth(new BenchTruth);
  truth->Self =
    std::make_unique<Implementation>(scene, volume, &layout, std::move(upper), camera, size, every);
  Implementation& self = *truth->Self;
  self.File = fmt::format("{}/{}-{:016x}.truth", cache, scene.Name, self.Key);
  self.Samples.resize(self.Pixels.size());
  const auto bytes = static_cast<std::streamsize>(self.Samples.size() * sizeof(Sample));
  std::error_code error;
  if (std::filesystem::file_size(self.File, error) == static_cast<std::uintmax_t>(bytes) && !error)
  {
    std::ifstream stream(self.File, std::ios::binary);
    if (stream.read(reinterpret_cast<char*>(self.Samples.data()), bytes))
    {
      return truth;
    }
  }
  const auto start = std::chrono::steady_clock::now();
  const std::vector<TruthColor> colors = RenderTruth(self.Scene, self.Pixels);
  for (std::size_t i = 0; i < colors.size(); ++i)
  {
    self.Samples[i] = Sample();
    self.Samples[i].Center = ToColor(colors[i]);
  }
  self.Seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  self.Changed = true;
  return truth;
}

BenchErrors BenchTruth::Compare(const std::vector<float>& picture)
{
  Implementation& self = *this->Self;
  std::vector<Color> colors(self.Pixels.size());
  std::vector<double> errors(self.Pixels.size(), 0.0);
  BenchErrors result;
  for (std::size_t i = 0; i < self.Pixels.size(); ++i)
  {
    const TruthPixel pixel = self.Pixels[i];
    const std::size_t at = 3 *
      (static_cast<std::size_t>(pixel.Y) * static_cast<std::size_t>(self.Camera.Width()) +
        static_cast<std::size_t>(pixel.X));
    for (std::size_t c = 0; c < 3; ++c)
    {
      colors[i][c] = picture.at(at + c);
      double difference = std::abs(double{ colors[i][c] } - self.Samples[i].Center[c]);
      difference = std::isfinite(difference) ? difference : 1e9; // a NaN isn't sortable
      errors[i] = std::max(errors[i], difference);
      result.Rms += difference * difference;
    }
  }
  result.Rms = std::sqrt(result.Rms / (3.0 * static_cast<double>(errors.size())));
  const std::size_t rank99 = errors.size() / 100;
  const std::size_t rank999 = errors.size() / 1000;
  const std::vector<std::size_t> worst = self.ByError(errors, rank99 + 1);
  result.Max = errors[worst.front()];
  result.Percentile999 = errors[worst[rank999]];
  result.Percentile99 = errors[worst[rank99]];
  self.CompareWithEnvelope(colors, errors, result);
  return result;
}

std::size_t BenchTruth::NumberOfPixels() const
{
  return this->Self->Pixels.size();
}

double BenchTruth::Seconds() const
{
  return this->Self->Seconds;
}

Status BenchTruth::Save() const
{
  const Implementation& self = *this->Self;
  if (!self.Changed)
  {
    return {};
  }
  const std::string temporary = self.File + ".part";
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(self.Samples.data()),
    static_cast<std::streamsize>(self.Samples.size() * sizeof(Sample)));
  stream.close();
  std::error_code error;
  std::filesystem::rename(temporary, self.File, error);
  return stream && !error ? Status()
                          : Status(StatusCode::InputOutput, self.File + " can't be written.");
}

} // namespace teravox::program
