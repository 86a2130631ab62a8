// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_LOOPS loops_baseline
#include "VoxelLoopsKernel.h"
