// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "EmbeddedShaders.h"
#include "ShaderLibrary.h"

#include <algorithm>
#include <bitset>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace teravox
{

namespace
{
std::vector<std::string> Lines(const std::string& text)
{
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
  {
    lines.push_back(line);
  }
  return lines;
}

std::vector<std::string> StageFiles()
{
  std::vector<std::string> files;
  for (const auto& file : EmbeddedShaders())
  {
    const std::string suffix = std::filesystem::path(file.first).extension().string();
    if (suffix == ".frag" || suffix == ".vert" || suffix == ".comp")
    {
      files.push_back(file.first);
    }
  }
  return files;
}
// What a compiler sees of a text: lines under conditions that don't hold are left out, as are
// comments and what is only defined.
class Preprocessor
{
public:
  static std::string Run(const std::string& text)
  {
    Preprocessor self;
    for (const std::string& line : Lines(text))
    {
      self.Take(line.substr(0, line.find("//")));
    }
    EXPECT_TRUE(self.Open.empty());
    return self.Out;
  }

private:
  struct Branch
  {
    bool Outside; ///< what is around it holds
    bool Taken;   ///< this branch or one before
    bool Holds;
  };

  // Alternatives of conjunctions of "name", "!name", "name == name" and "name != name".
  bool IsSet(const std::string& condition) const
  {
    std::istringstream stream(condition);
    const std::vector<std::string> words(std::istream_iterator<std::string>(stream), {});
    bool any = false;
    bool all = true;
    for (std::size_t i = 0; i < words.size(); ++i)
    {
      if (words[i] == "||")
      {
        any = any || all;
        all = true;
        continue;
      }
      if (words[i] == "&&")
      {
        continue;
      }
      const bool negated = words[i][0] == '!';
      const std::string value = this->ValueOf(words[i].substr(negated ? 1 : 0));
      const bool compares = i + 2 < words.size() && (words[i + 1] == "==" || words[i + 1] == "!=");
      if (compares)
      {
        const bool equal = value == this->ValueOf(words[i + 2]);
        all = all && equal == (words[i + 1] == "==");
        i += 2;
      }
      else
      {
        all = all && (value != "0") != negated;
      }
    }
    return any || all;
  }

  std::string ValueOf(const std::string& name) const
  {
    const auto found = this->Defined.find(name);
    EXPECT_TRUE(found != this->Defined.end()) << name << " isn't defined";
    return found == this->Defined.end() ? "0" : found->second;
  }

  void Take(const std::string& line)
  {
    std::istringstream words(line);
    std::string directive;
    words >> directive;
    const bool holds = this->Open.empty() || this->Open.back().Holds;
    std::string rest;
    std::getline(words, rest);
    if (directive == "#if" || directive == "#ifndef")
    {
      const bool set = !holds ||
        (directive == "#if" ? this->IsSet(rest) : this->Defined.count(rest.substr(1)) == 0);
      this->Open.push_back({ holds, set, holds && set });
    }
    else if (directive == "#elif" || directive == "#else")
    {
      Branch& branch = this->Open.back();
      const bool set = branch.Outside && !branch.Taken && (directive == "#else" || IsSet(rest));
      branch.Taken = branch.Taken || set;
      branch.Holds = set;
    }
    else if (directive == "#endif")
    {
      this->Open.pop_back();
    }
    else if (holds && directive == "#define")
    {
      std::istringstream definition(rest);
      std::string name;
      std::string value;
      definition >> name >> value;
      this->Defined[name] = value;
      if (name.rfind("COUNT(", 0) == 0)
      {
        this->Out += rest + "\n"; // it stands for what it is defined as
      }
    }
    else if (holds && directive[0] != '#')
    {
      this->Out += line + "\n";
    }
  }

  std::map<std::string, std::string> Defined;
  std::vector<Branch> Open;
  std::string Out;
};

bool Has(const std::string& text, const std::string& word)
{
  return text.find(word) != std::string::npos;
}
} // namespace

// Light, gradients, depth reads and counters are in the texts of those variants that need them, and
// in no other.
TEST(ShaderLibrary, VariantsHoldOnlyWhatTheyNeed)
{
  int shaded = 0;
  int counting = 0;
  for (const ShaderVariant& variant : ShaderVariant::All())
  {
    if (std::bitset<32>(variant.Key()).count() > 2)
    {
      continue; // two features at a time tell which one brings a word along
    }
    if (variant.Blend != BlendKind::Composite)
    {
      continue; // they have texts of their own
    }
    if (variant.Components > 1)
    {
      continue; // likewise
    }
    const auto assembled = AssembleShader("RayMarch.frag", variant);
    ASSERT_TRUE(assembled.Ok());
    const std::string text = Preprocessor::Run(assembled.Value());
    const std::string name = "variant " + std::to_string(variant.Key());
    shaded += variant.Shade ? 1 : 0;
    counting += variant.Count ? 1 : 0;
    for (const char* word :
      { "struct Light", "LightFrom(", "NormalOf(", "LitColor(", "LightOf(", "struct RayLight" })
    {
      EXPECT_EQ(Has(text, word), variant.Shade) << word << ", " << name;
    }
    for (const char* word : { "struct Gradient", "GradientAlong(", "CentralDifference(" })
    {
      EXPECT_EQ(Has(text, word), variant.Shade || variant.GradientOpacity || variant.Plane)
        << word << ", " << name;
    }
    for (const char* word : { "PlaneSample", "u_planeTable" })
    {
      EXPECT_EQ(Has(text, word), variant.Plane) << word << ", " << name;
    }
    for (const char* word : { "SampledGradient", "u_gradientTable" })
    {
      EXPECT_EQ(Has(text, word), variant.GradientOpacity) << word << ", " << name;
    }
    for (const char* word : { "state.counter +=", "uint samples;", "uint evaluated;",
           "uint contributing;", "uint gradients;", "uint visits;", "b_feedback[FEEDBACK_SAMPLES]",
           "b_feedback[FEEDBACK_EVALUATED]", "b_feedback[FEEDBACK_CONTRIBUTING]",
           "b_feedback[FEEDBACK_GRADIENTS]", "b_feedback[FEEDBACK_VISITS]" })
    {
      EXPECT_EQ(Has(text, word), variant.Count) << word << ", " << name;
    }
    EXPECT_EQ(Has(text, "FindAncestor("), variant.Interactive || variant.Substitute) << name;
    EXPECT_EQ(Has(text, "isnan("), variant.FloatData) << name;
    EXPECT_EQ(Has(text, "b_slots[slot]"), variant.SlotTable) << name;
    EXPECT_EQ(Has(text, "MaskAt("), variant.Masked) << name;
    EXPECT_EQ(Has(text, "EnterStretch("), variant.ClippedGradient) << name;
    EXPECT_EQ(Has(text, "g_label = value;"), variant.Labels) << name;
    EXPECT_EQ(Has(text, "u_firstHit"), variant.FirstHit) << name;
    EXPECT_EQ(Has(text, "DrawAndSearch("), variant.FirstHit) << name;
    EXPECT_FALSE(Has(text, "u_depth")) << name << ": intervals hold the depth already";
    EXPECT_TRUE(Has(text, "IntegrateBrick(")) << name;
    for (const char* word : { "PartOf(", "EMITTERS", "struct Point", "b_slots[slot *" })
    {
      EXPECT_FALSE(Has(text, word)) << word << ", " << name;
    }
  }
  for (const int components : { 2, 3, 4 })
  {
    ShaderVariant variant;
    variant.Components = components;
    const std::string text = Preprocessor::Run(AssembleShader("RayMarch.frag", variant).Value());
    for (const char* word :
      { "isnan(", "b_slots[slot", "struct Gradient", "vec3 normal[", "vec3 TableColor(" })
    {
      EXPECT_EQ(Has(text, word), word == std::string("vec3 TableColor(")) << word;
    }
    EXPECT_TRUE(Has(text, "PartOf("));
  }
  EXPECT_GT(shaded, 6);
  EXPECT_GT(counting, 6);
  for (const bool depth : { false, true })
  {
    ShaderVariant variant;
    variant.OpaqueDepth = depth;
    const auto assembled = AssembleShader("Intervals.frag", variant);
    ASSERT_TRUE(assembled.Ok());
    const std::string text = Preprocessor::Run(assembled.Value());
    EXPECT_EQ(Has(text, "sampler2D u_depth;"), depth);
    EXPECT_EQ(Has(text, "texelFetch(u_depth"), depth);
    EXPECT_EQ(Has(text, "u_depthToView"), depth);
    EXPECT_TRUE(Has(text, "f_intervals"));
  }
}

TEST(ShaderLibrary, EmbedsEveryFileByteForByte)
{
  std::set<std::string> found;
  const std::filesystem::path root = TERAVOX_SHADER_SOURCES;
  for (const auto& item : std::filesystem::recursive_directory_iterator(root))
  {
    const std::string suffix = item.path().extension().string();
    if (suffix == ".glsl" || suffix == ".frag" || suffix == ".vert" || suffix == ".comp")
    {
      const std::string name = std::filesystem::relative(item.path(), root).generic_string();
      found.insert(name);
      std::ifstream in(item.path(), std::ios::binary);
      const std::string content(std::istreambuf_iterator<char>(in), {});
      ASSERT_EQ(EmbeddedShaders().count(name), 1u) << name << " isn't embedded";
      EXPECT_EQ(EmbeddedShaders().at(name), content) << name;
    }
  }
  EXPECT_EQ(found.size(), EmbeddedShaders().size());
}

TEST(ShaderLibrary, FilesAreShortAndAscii)
{
  for (const auto& file : EmbeddedShaders())
  {
    EXPECT_LE(Lines(file.second).size(), 250u) << file.first;
    EXPECT_TRUE(std::all_of(file.second.begin(), file.second.end(),
      [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }))
      << file.first;
  }
}

// A driver's "file:line" leads to the line that it means, in every stage.
TEST(ShaderLibrary, LineDirectivesTellWhereEachLineComesFrom)
{
  for (const std::string& stage : StageFiles())
  {
    const auto text = AssembleShader(stage, {});
    ASSERT_TRUE(text.Ok()) << text.GetStatus().Message();
    const std::vector<std::string> lines = Lines(text.Value());
    ASSERT_EQ(lines[0], "#version 430 core");
    std::string file;
    std::size_t number = 0;
    std::map<std::string, std::set<std::size_t>> seen;
    for (const std::string& line : lines)
    {
      if (line.rfind("#line ", 0) == 0)
      {
        int index = -1;
        std::istringstream(line.substr(6)) >> number >> index;
        file = ShaderFileName(index);
        ASSERT_EQ(EmbeddedShaders().count(file), 1u) << line;
      }
      else if (!file.empty())
      {
        const std::vector<std::string> original = Lines(EmbeddedShaders().at(file));
        ASSERT_LE(number, original.size()) << file;
        ASSERT_EQ(line, original[number - 1]) << file << ":" << number;
        ASSERT_TRUE(seen[file].insert(number).second) << file << " twice";
        ++number;
      }
    }
    // Nothing is left out but the includes.
    for (const auto& part : seen)
    {
      const std::vector<std::string> original = Lines(EmbeddedShaders().at(part.first));
      const auto includes = std::count_if(original.begin(), original.end(),
        [](const std::string& line) { return line.rfind("#include", 0) == 0; });
      EXPECT_EQ(part.second.size() + static_cast<std::size_t>(includes), original.size())
        << part.first;
    }
    EXPECT_EQ(text.Value().find("#include"), std::string::npos);
  }
  EXPECT_EQ(ShaderFileName(-1), "?");
  EXPECT_EQ(ShaderFileName(1000), "?");
}

TEST(ShaderLibrary, VariantsAreDifferentAndHaveDifferentTexts)
{
  const std::vector<ShaderVariant> all = ShaderVariant::All();
  std::set<unsigned> keys;
  std::set<std::string> defines;
  for (const ShaderVariant& variant : all)
  {
    keys.insert(variant.Key());
    defines.insert(variant.Defines());
    // Each define has a default in Variant.glsl, so that files parse alone.
    for (const std::string& line : Lines(variant.Defines()))
    {
      const std::string name = line.substr(8, line.rfind(' ') - 8);
      ASSERT_NE(
        EmbeddedShaders().at("Variant.glsl").find("#ifndef " + name + "\n"), std::string::npos)
        << name;
    }
  }
  EXPECT_EQ(keys.size(), all.size());
  EXPECT_EQ(defines.size(), all.size());
  EXPECT_GT(all.size(), 64u);
}

TEST(ShaderLibrary, WhatIsMissingIsNamed)
{
  const auto text = AssembleShader("Nowhere.frag", {});
  ASSERT_FALSE(text.Ok());
  EXPECT_EQ(text.GetStatus().Code(), StatusCode::NotFound);
  EXPECT_NE(text.GetStatus().Message().find("Nowhere.frag"), std::string::npos);
}

TEST(ShaderLibrary, AFolderReplacesTheBinarysFiles)
{
  const auto folder = std::filesystem::path(testing::TempDir()) / "teravox-shader-folder";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "Compose.frag") << "#include \"Own.glsl\"\nvoid main() {}\n";
  ASSERT_EQ(setenv("TERAVOX_SHADER_DIR", folder.c_str(), 1), 0);
  const auto missing = AssembleShader("Compose.frag", {});
  std::ofstream(folder / "Own.glsl") << "// own text\n";
  const auto own = AssembleShader("Compose.frag", {});
  ASSERT_EQ(setenv("TERAVOX_SHADER_DIR", TERAVOX_SHADER_SOURCES, 1), 0);
  const auto same = AssembleShader("RayMarch.frag", {});
  unsetenv("TERAVOX_SHADER_DIR");
  std::filesystem::remove_all(folder);
  ASSERT_FALSE(missing.Ok());
  EXPECT_NE(missing.GetStatus().Message().find("Own.glsl"), std::string::npos);
  ASSERT_TRUE(own.Ok());
  EXPECT_NE(own.Value().find("// own text"), std::string::npos);
  EXPECT_EQ(same.Value(), AssembleShader("RayMarch.frag", {}).Value());
}

} // namespace teravox
