#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Random steps of a user (camera, functions, crop, level, time, budgets, files), each checked
# (TestRenderSoak.cxx), with both marchers; an hour or more.
#
#   soak.sh <program TestRender> [number of steps]
set -euo pipefail
export TERAVOX_TEST_STEPS=${2:-10000}
for marcher in native gpu; do
  echo "== $marcher"
  TERAVOX_TEST_MARCHER=$marcher "$1" --gtest_filter='Soak.*'
done
