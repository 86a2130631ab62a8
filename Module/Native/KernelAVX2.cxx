// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#define TERAVOX_KERNEL avx2
#include "Kernel.h"
