// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_LOOPS loops_avx2
#include "VoxelLoopsKernel.h"
