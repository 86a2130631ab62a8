// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL avx2_alone
#define TERAVOX_KERNEL_FUNCTIONS AVX2KernelFunctions
#include "KernelFunctionsOf.h"
