// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL baseline_alone
#define TERAVOX_KERNEL_FUNCTIONS BaselineKernelFunctions
#include "KernelFunctionsOf.h"
