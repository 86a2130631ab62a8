// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What the kernel for voxels of several components reads of their functions. In the kernel for one
// there is nothing of it.
#ifndef TERAVOX_COMPONENTS
#define TERAVOX_COMPONENTS 0
#endif

struct GradientOpacityTable
{
  const float* Nodes; // GradientTable::Values
  Vec Scale;          // MarchParameters::Gradient
};

#if TERAVOX_COMPONENTS
constexpr int MostComponents = 4;

struct ComponentTables
{
  int Count;
  bool Dependent;
  int Emitters[MostComponents]; // components with an opacity
  int EmitterCount;
  Transfer Tables[MostComponents];
  float Weight[MostComponents];    // of an emitter, > 0; else 0
  float PerWeight[MostComponents]; // 1 / weight
  float LargestLight;              // see Core/Components.h
  // Opacity by gradient, of emitters.
  bool ByGradient;
  GradientOpacityTable Gradients[MostComponents];
  // Copies of the picture's parameters with the material of a component.
  MarchParameters Lit[MostComponents];
};

inline ComponentTables ComponentsOf(const NativeScene& scene)
{
  const MarchParameters& p = *scene.Parameters;
  ComponentTables r{};
  r.Count = scene.Components;
  r.Dependent = p.Components[1] != 0;
  r.ByGradient = scene.GradientOpacity != nullptr;
  for (int k = 0; k < r.Count; ++k)
  {
    const auto i = static_cast<std::size_t>(k);
    const NativeScene::ComponentTable& from = scene.ComponentTables[i];
    const Vec& transfer = p.ComponentTransfer[i];
    r.Tables[k] = { from.Integrals, reinterpret_cast<const float*>(from.Colors), from.Occupied,
      from.Extremes, nullptr, from.Blocks, scene.ExtremesBlock, transfer[0], transfer[1],
      transfer[2], transfer[3] };
    const Vec& table = p.ComponentTable[i];
    r.Weight[k] = table[2];
    r.PerWeight[k] = table[2] > 0.0f ? 1.0f / table[2] : 0.0f;
    r.LargestLight = table[3];
    if (r.ByGradient)
    {
      const Vec& gradient = p.ComponentGradient[i];
      r.Gradients[k] = { scene.GradientOpacity + 4 * static_cast<std::ptrdiff_t>(gradient[3]),
        { gradient[0], gradient[1], gradient[2], p.Gradient[3] } };
    }
    if (table[2] > 0.0f)
    {
      r.Emitters[r.EmitterCount] = k;
      ++r.EmitterCount;
    }
    if (scene.Shade)
    {
      r.Lit[k] = p;
      r.Lit[k].Material = p.ComponentMaterial[i];
    }
  }
  return r;
}
#else
struct ComponentTables
{
};
inline ComponentTables ComponentsOf(const NativeScene&)
{
  return {};
}
#endif
