// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace teravox::program
{

/// Bytes from "1073741824", "512K", "256MiB", "1.5G", "2T": units are powers of 1024, their letters
/// may be small, "B" and "iB" may follow. Nothing for anything else, and beyond 2^63.
std::optional<std::uint64_t> ParseByteCount(const std::string& text);

/// "17 B", "35.2 MiB".
std::string FormatByteCount(double bytes);

/// "0.4 s", "12 s", "3 min 20 s", "2 h 05 min".
std::string FormatDuration(double seconds);

} // namespace teravox::program
