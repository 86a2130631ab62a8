#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Resources released and made again, windows and renderers that come and go, a thousand times each
# (TestRenderResources.cxx); some minutes.
#
#   cycles.sh <program TestRender> [number of cycles]
set -euo pipefail
export TERAVOX_TEST_CYCLES=${2:-1000}
exec "$1" --gtest_filter='Resources.*'
