// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ShaderLibrary.h"

#include "EmbeddedShaders.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

namespace teravox
{

namespace
{
struct Feature
{
  const char* Name;
  bool ShaderVariant::*Member;
};
constexpr std::array<Feature, 19> Features = { {
  { "TERAVOX_NEAREST", &ShaderVariant::Nearest },
  { "TERAVOX_FIXED_STEP", &ShaderVariant::FixedStep },
  { "TERAVOX_FLOAT_DATA", &ShaderVariant::FloatData },
  { "TERAVOX_SLOT_TABLE", &ShaderVariant::SlotTable },
  { "TERAVOX_SHADE", &ShaderVariant::Shade },
  { "TERAVOX_LIGHTS", &ShaderVariant::Lights },
  { "TERAVOX_INTERACTIVE", &ShaderVariant::Interactive },
  { "TERAVOX_SUBSTITUTE", &ShaderVariant::Substitute },
  { "TERAVOX_COUNT", &ShaderVariant::Count },
  { "TERAVOX_SHOW_LEVEL", &ShaderVariant::ShowLevel },
  { "TERAVOX_ESTIMATE", &ShaderVariant::Estimate },
  { "TERAVOX_FIRST_HIT", &ShaderVariant::FirstHit },
  { "TERAVOX_OPAQUE_DEPTH", &ShaderVariant::OpaqueDepth },
  { "TERAVOX_DEPENDENT", &ShaderVariant::Dependent },
  { "TERAVOX_GRADIENT_OPACITY", &ShaderVariant::GradientOpacity },
  { "TERAVOX_MASK", &ShaderVariant::Masked },
  { "TERAVOX_LABELS", &ShaderVariant::Labels },
  { "TERAVOX_PLANE", &ShaderVariant::Plane },
  { "TERAVOX_CLIPPED_GRADIENT", &ShaderVariant::ClippedGradient },
} };

Result<std::string> ReadShaderFile(const std::string& file)
{
  if (const char* folder = std::getenv("TERAVOX_SHADER_DIR"))
  {
    std::ifstream in(std::string(folder) + "/" + file);
    if (!in)
    {
      return Status(StatusCode::NotFound, "The shader file " + file + " isn't in " + folder + ".");
    }
    return std::string(std::istreambuf_iterator<char>(in), {});
  }
  const auto& files = EmbeddedShaders();
  const auto at = files.find(file);
  if (at == files.end())
  {
    return Status(StatusCode::NotFound, "There is no shader file " + file + ".");
  }
  return at->second;
}

int FileIndex(const std::string& file)
{
  const auto& files = EmbeddedShaders();
  return static_cast<int>(std::distance(files.begin(), files.find(file)));
}

Status Append(const std::string& file, std::set<std::string>& included, std::string& text)
{
  if (!included.insert(file).second)
  {
    return {};
  }
  Result<std::string> content = ReadShaderFile(file);
  if (!content)
  {
    return content.GetStatus();
  }
  const std::string index = std::to_string(FileIndex(file));
  text += "#line 1 " + index + "\n";
  std::istringstream lines(content.Value());
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number)
  {
    const std::string keyword = "#include \"";
    if (line.compare(0, keyword.size(), keyword) == 0)
    {
      const std::string name =
        line.substr(keyword.size(), line.find('"', keyword.size()) - keyword.size());
      if (Status status = Append(name, included, text); !status)
      {
        return status;
      }
      text += "#line " + std::to_string(number + 1) + " " + index + "\n";
    }
    else
    {
      text += line + "\n";
    }
  }
  return {};
}
} // namespace

unsigned ShaderVariant::Key() const
{
  unsigned key = 0;
  for (std::size_t i = 0; i < Features.size(); ++i)
  {
    key |= this->*Features[i].Member ? 1u << i : 0u;
  }
  constexpr unsigned bitsOfBlend = 3;
  return key | static_cast<unsigned>(this->Blend) << Features.size() |
    static_cast<unsigned>(this->Components - 1) << (Features.size() + bitsOfBlend);
}

std::string ShaderVariant::Defines() const
{
  std::string text;
  for (const Feature& feature : Features)
  {
    text += std::string("#define ") + feature.Name + (this->*feature.Member ? " 1\n" : " 0\n");
  }
  const int components = this->Components > 1 ? this->Components : 0;
  return text + "#define TERAVOX_BLEND " + std::to_string(static_cast<int>(this->Blend)) +
    "\n#define TERAVOX_COMPONENTS " + std::to_string(components) + "\n";
}

namespace
{
// Other blend modes have no steps, no debug picture, no estimate and no gradients; of them
// those that meet something are lit, hit it first, and are of one component; dependent ones have
// extremes.
void AddBlends(ShaderVariant variant, std::vector<ShaderVariant>& all)
{
  if (variant.FixedStep || variant.ShowLevel || variant.Estimate || variant.GradientOpacity)
  {
    return;
  }
  for (const BlendKind kind : { BlendKind::Maximum, BlendKind::Minimum, BlendKind::Average,
         BlendKind::Additive, BlendKind::Isosurface, BlendKind::Slice })
  {
    variant.Blend = kind;
    const bool meets = kind == BlendKind::Isosurface || kind == BlendKind::Slice;
    if (variant.Dependent && kind != BlendKind::Maximum && kind != BlendKind::Minimum)
    {
      continue;
    }
    if (meets ? variant.Components == 1
              : !variant.Shade && !variant.FirstHit && !variant.ClippedGradient)
    {
      all.push_back(variant);
    }
  }
}
} // namespace

std::vector<ShaderVariant> ShaderVariant::All()
{
  std::vector<ShaderVariant> all;
  for (unsigned key = 0; key < 1u << Features.size(); ++key)
  {
    ShaderVariant variant;
    for (std::size_t i = 0; i < Features.size(); ++i)
    {
      variant.*Features[i].Member = (key >> i & 1u) != 0;
    }
    // Nearest interpolation has its own cuts; an interactive variant substitutes anyway; the debug
    // picture is neither lit nor wrong; lights are there to shade; the opaque depth is in the
    // intervals already; who looks for the first hit gets neither counters nor estimates.
    if ((variant.Nearest && variant.FixedStep) || (variant.Interactive && variant.Substitute) ||
      (variant.ShowLevel && (variant.Shade || variant.Estimate)) ||
      (variant.Lights && !variant.Shade) || variant.OpaqueDepth ||
      (variant.FirstHit && (variant.ShowLevel || variant.Estimate || variant.Count)) ||
      (variant.Labels && !variant.Masked) ||
      (variant.Plane && (variant.GradientOpacity || variant.Masked)))
    {
      continue;
    }
    // Masks end where they do, not where a step does.
    if (variant.Masked && variant.FixedStep)
    {
      continue;
    }
    // In composite blending, gradients not in variants of the debug picture; of two components
    // nothing else than a plane says what is seen.
    const bool isGradient = variant.GradientOpacity || (variant.Plane && !variant.Dependent);
    if (isGradient && variant.ShowLevel)
    {
      continue;
    }
    if (variant.ClippedGradient && !variant.Shade && !isGradient)
    {
      continue;
    }
    // Labels are of one component, planes over one or two, which are dependent then.
    if (variant.Plane || variant.Labels)
    {
      if (!variant.Dependent || !variant.Labels)
      {
        all.push_back(variant);
        all.back().Components = variant.Dependent ? 2 : 1;
      }
      continue;
    }
    // Several components: the last of two or of four may have the opacity of all.
    for (const int components : { 2, 3, 4 })
    {
      if (!variant.Dependent || components != 3)
      {
        all.push_back(variant);
        all.back().Components = components;
        AddBlends(all.back(), all);
      }
    }
    if (variant.Dependent)
    {
      continue;
    }
    all.push_back(variant);
    AddBlends(variant, all);
  }
  return all;
}

Result<std::string> AssembleShader(const std::string& file, const ShaderVariant& variant)
{
  std::string text = "#version 430 core\n" + variant.Defines();
  std::set<std::string> included;
  if (const Status status = Append(file, included, text); !status)
  {
    return status;
  }
  return text;
}

std::string ShaderFileName(int index)
{
  const auto& files = EmbeddedShaders();
  if (index < 0 || index >= static_cast<int>(files.size()))
  {
    return "?";
  }
  return std::next(files.begin(), index)->first;
}

} // namespace teravox
