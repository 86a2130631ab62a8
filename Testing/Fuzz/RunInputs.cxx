// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a target without libFuzzer, so that it is built and run by every compiler:
//
//   FuzzX FOLDER [mutations]
//
// First each file of the folder, then as many mutations of them, always the same ones. The exit
// code is 0 if the target came back from all.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace
{
using Input = std::vector<std::uint8_t>;

Input Read(const std::string& name)
{
  std::ifstream in(name, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return { text.begin(), text.end() };
}

// Bytes changed, cut off, or repeated elsewhere.
void Mutate(Input& input, std::mt19937& random)
{
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::size_t changes = 1 + below(8);
  for (std::size_t i = 0; i < changes && !input.empty(); ++i)
  {
    const std::size_t at = below(input.size());
    switch (below(8))
    {
      case 0:
        input.resize(at);
        break;
      case 1:
      {
        const std::size_t from = below(input.size());
        const std::size_t length = std::min(below(64), input.size() - std::max(at, from));
        std::copy_n(Input(input).begin() + static_cast<std::ptrdiff_t>(from), length,
          input.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      }
      case 2:
        input[at] = static_cast<std::uint8_t>(below(2) * 255);
        break;
      default:
        input[at] = static_cast<std::uint8_t>(random());
    }
  }
}
} // namespace

int main(int argc, char* argv[])
{
  if (argc < 2 || !std::filesystem::is_directory(argv[1]))
  {
    std::fprintf(stderr, "A folder with inputs is needed.\n");
    return 2;
  }
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1]))
  {
    names.push_back(entry.path().string());
  }
  std::sort(names.begin(), names.end());
  if (names.empty())
  {
    std::fprintf(stderr, "The folder is empty.\n");
    return 2;
  }
  std::vector<Input> inputs;
  for (const std::string& name : names)
  {
    inputs.push_back(Read(name));
    LLVMFuzzerTestOneInput(inputs.back().data(), inputs.back().size());
  }
  const long mutations = argc > 2 ? std::strtol(argv[2], nullptr, 10) : 0;
  std::mt19937 random(1);
  for (long i = 0; i < mutations; ++i)
  {
    Input input = inputs[random() % inputs.size()];
    Mutate(input, random);
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  std::printf("%zu inputs and %ld mutations\n", inputs.size(), mutations);
  return 0;
}
