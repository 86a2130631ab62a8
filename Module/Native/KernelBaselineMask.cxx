// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL baseline_mask
#define TERAVOX_MASK 1
#include "Kernel.h"
