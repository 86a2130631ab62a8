// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "EmbeddedShaders.h"
#include "ShaderLibrary.h"

#include <algorithm>
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
} // namespace

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
