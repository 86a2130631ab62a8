// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL avx2_components
#define TERAVOX_COMPONENTS 1
#define TERAVOX_MASK 1
#include "Kernel.h"
