# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Libaec::Libaec, which decodes szip (Debian: libaec-dev); it has neither a CMake nor a pkg-config file.
find_path(Libaec_INCLUDE_DIR libaec.h)
find_library(Libaec_LIBRARY NAMES aec)
mark_as_advanced(Libaec_INCLUDE_DIR Libaec_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Libaec REQUIRED_VARS Libaec_LIBRARY Libaec_INCLUDE_DIR)
if (Libaec_FOUND AND NOT TARGET Libaec::Libaec)
  add_library(Libaec::Libaec UNKNOWN IMPORTED GLOBAL)
  set_target_properties(Libaec::Libaec PROPERTIES
    IMPORTED_LOCATION "${Libaec_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${Libaec_INCLUDE_DIR}")
endif ()
