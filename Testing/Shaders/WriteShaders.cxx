// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Writes the assembled text of each stage and variant into a folder: what a driver gets, byte for
// byte.
#include "EmbeddedShaders.h"
#include "ShaderLibrary.h"

#include <bitset>
#include <fstream>
#include <iostream>
#include <string>

namespace
{
using teravox::ShaderVariant;

bool Write(const std::string& folder, const std::string& file, const ShaderVariant& variant)
{
  const auto text = teravox::AssembleShader(file, variant);
  if (!text)
  {
    std::cerr << text.GetStatus().Message() << "\n";
    return false;
  }
  const std::size_t dot = file.rfind('.');
  const std::string name =
    file.substr(0, dot) + "-" + std::to_string(variant.Key()) + file.substr(dot);
  std::ofstream out(folder + "/" + name, std::ios::binary);
  out << text.Value();
  out.close();
  if (!out)
  {
    std::cerr << "Can't write " << name << ".\n";
    return false;
  }
  return true;
}

bool IsStage(const std::string& file)
{
  const std::string suffix = file.substr(file.rfind('.') + 1);
  return suffix == "frag" || suffix == "vert" || suffix == "comp";
}
} // namespace

int main(int argc, char* argv[])
{
  if (argc != 2)
  {
    std::cerr << "Usage: WriteShaders FOLDER\n";
    return 1;
  }
  const std::string folder = argv[1];
  bool ok = true;
  for (const auto& file : teravox::EmbeddedShaders())
  {
    if (!IsStage(file.first))
    {
      continue;
    }
    // Most features are the marcher's; other stages are drawn with none of them.
    if (file.first == "RayMarch.frag")
    {
      for (const ShaderVariant& variant : ShaderVariant::All())
      {
        // Of the many with several components, opacity by gradient, gradients at cuts, or a mask
        // and more, those with up to three features at a time; with a mask for components, two.
        constexpr std::size_t features = 19;
        const bool isMore = variant.Labels || variant.Blend != teravox::BlendKind::Composite;
        const std::size_t most = variant.Components > 1 && variant.Masked ? 2 : 3;
        if ((variant.Components > 1 || variant.GradientOpacity || variant.Plane ||
              variant.ClippedGradient || (variant.Masked && isMore)) &&
          std::bitset<features>(variant.Key()).count() > most)
        {
          continue;
        }
        ok = Write(folder, file.first, variant) && ok;
      }
    }
    else
    {
      ok = Write(folder, file.first, {}) && ok;
    }
    for (const int components : { 2, 3, 4 })
    {
      if (file.first == "Resolve.frag")
      {
        ShaderVariant variant;
        variant.Components = components;
        ok = Write(folder, file.first, variant) && ok;
        variant.Dependent = components != 3;
        ok = (!variant.Dependent || Write(folder, file.first, variant)) && ok;
      }
    }
    if (file.first == "Intervals.frag")
    {
      ShaderVariant variant;
      variant.OpaqueDepth = true;
      ok = Write(folder, file.first, variant) && ok;
    }
  }
  return ok ? 0 : 1;
}
