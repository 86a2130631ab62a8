// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Included by one translation unit per instruction set, which sets TERAVOX_KERNEL to a namespace of
// its own, and TERAVOX_KERNEL_FUNCTIONS to the name of what it defines.
#include "NativeScene.h"

namespace teravox::TERAVOX_KERNEL
{
// Declared so, the whole kernel isn't compiled once more for some of its functions.
[[maybe_unused]] static NativeKernel Kernel();
} // namespace teravox::TERAVOX_KERNEL

#include "Kernel.h"
#include "KernelFunctions.h"

namespace teravox::TERAVOX_KERNEL
{
namespace
{
using Lane8 = test::KernelFunctions::Lane8;

Floats Take(const Lane8& from)
{
  Floats v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}

void Put(Floats v, Lane8& to)
{
  __builtin_memcpy(to, &v, sizeof(v));
}

Vectors Take(const Lane8 (&from)[3])
{
  return { Take(from[0]), Take(from[1]), Take(from[2]) };
}

void Put(const Cubic& c, Lane8 (&to)[4])
{
  Put(c.A, to[0]);
  Put(c.B, to[1]);
  Put(c.C, to[2]);
  Put(c.D, to[3]);
}

template <typename T>
void LoadBrick(const std::uint8_t* texels, int edge, const std::int32_t (&voxels)[8],
  const Lane8 (&w)[3], const Lane8 (&d)[3], Lane8 (&corners)[8], Lane8 (&cubics)[3][4])
{
  BrickView view{};
  view.Voxels = texels;
  view.Edge = edge;
  Ints at;
  __builtin_memcpy(&at, voxels, sizeof(at));
  const Offsets offsets = OffsetsOf<T>(at);
  const Corners k = LoadCorners<T>(view, offsets);
  for (int i = 0; i < 8; ++i)
  {
    Put(k.V[i], corners[i]);
  }
  const Gradient g = LoadGradient<T>(view, offsets, k, Take(w), Take(d));
  Put(g.X, cubics[0]);
  Put(g.Y, cubics[1]);
  Put(g.Z, cubics[2]);
}
} // namespace
} // namespace teravox::TERAVOX_KERNEL

namespace teravox::test
{

KernelFunctions TERAVOX_KERNEL_FUNCTIONS()
{
  using namespace TERAVOX_KERNEL;
  using Lane8 = KernelFunctions::Lane8;
  KernelFunctions f{};
  f.ExpOfMinus = [](const Lane8& x, Lane8& r) { Put(ExpOfMinus(Take(x)), r); };
  f.ExpOfMinusOne = [](float x) { return ExpOfMinus(x); };
  f.PowerOf = [](const Lane8& x, float power, Lane8& r) { Put(PowerOf(Take(x), power), r); };
  f.OpacityOf = [](const Lane8& depth, Lane8& r) { Put(OpacityOf(Take(depth)), r); };
  f.CentroidOf = [](const Lane8& front, const Lane8& back, const Lane8& depth, Lane8& r)
  { Put(CentroidOf(Take(front), Take(back), Take(depth)), r); };
  f.KinkOf =
    [](const Lane8(&values)[2], const Lane8(&slopes)[2], const Lane8& dx, Lane8& mean, Lane8& error)
  {
    const auto grey = [](const Lane8& v) -> Color<Floats> {
      return { Take(v), Take(v), Take(v) };
    };
    const Kink kink =
      KinkOf(grey(values[0]), grey(slopes[0]), grey(values[1]), grey(slopes[1]), Take(dx));
    Put(kink.Mean.Green, mean);
    Put(kink.Error, error);
  };
  f.TurningPoints = [](const Lane8(&c)[4], Lane8& first, Lane8& second)
  {
    const Turns turns = TurningPoints(Cubic{ Take(c[0]), Take(c[1]), Take(c[2]), Take(c[3]) });
    Put(turns.First, first);
    Put(turns.Second, second);
  };
  f.Transpose = [](const Lane8(&columns)[4], float(&rows)[8][4], Lane8(&again)[4])
  {
    const Floats in[4] = { Take(columns[0]), Take(columns[1]), Take(columns[2]), Take(columns[3]) };
    Quad quads[Lanes];
    Transpose(in, quads);
    __builtin_memcpy(rows, quads, sizeof(quads));
    Floats back[4];
    Transpose(quads, back);
    for (int i = 0; i < 4; ++i)
    {
      Put(back[i], again[i]);
    }
  };
  f.CubicAlong =
    [](const Lane8(&corners)[8], const Lane8(&w)[3], const Lane8(&d)[3], Lane8(&cubic)[4])
  {
    Corners k;
    for (int i = 0; i < 8; ++i)
    {
      k.V[i] = Take(corners[i]);
    }
    Put(CubicAlong(k, Take(w), Take(d)), cubic);
  };
  f.LoadGradient = [](int bytesPerTexel, const std::uint8_t* texels, int edge,
                     const std::int32_t(&voxels)[8], const Lane8(&w)[3], const Lane8(&d)[3],
                     Lane8(&corners)[8], Lane8(&cubics)[3][4])
  {
    bytesPerTexel == 1     ? LoadBrick<std::uint8_t>(texels, edge, voxels, w, d, corners, cubics)
      : bytesPerTexel == 2 ? LoadBrick<std::uint16_t>(texels, edge, voxels, w, d, corners, cubics)
                           : LoadBrick<float>(texels, edge, voxels, w, d, corners, cubics);
  };
  return f;
}

} // namespace teravox::test
