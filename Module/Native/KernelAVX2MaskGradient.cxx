// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL avx2_mask_gradient
#define TERAVOX_MASK 1
#define TERAVOX_GRADIENT_OPACITY 1
#include "Kernel.h"
