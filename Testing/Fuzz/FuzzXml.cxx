// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The XML file of BigDataViewer.
#include "Formats/BigDataViewerXml.h"
#include "FuzzInput.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  using namespace teravox;
  const std::string file = fuzz::FileOf(data, size, ".xml");
  static_cast<void>(BigDataViewerXml::IsXml(file));
  const auto read = BigDataViewerXml::Read(file);
  fuzz::Require(read.Ok() || !read.GetStatus().Message().empty(), "an error has a message");
  return 0;
}
