// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace teravox
{

/// Whether a name stands for several files: it has a * or a %d (%3d, %03d), and no file is called
/// so.
bool IsPattern(const std::string& name);

/// The regular files that a pattern means, in natural order: a9 before a10. A * is anything but a
/// slash, %d digits only, %03d at least three of them. None: nothing matches.
std::vector<std::string> FilesLike(const std::string& pattern);

/// The regular files of a folder in natural order, without hidden ones.
std::vector<std::string> FilesIn(const std::string& folder);

} // namespace teravox
