# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Debian packages by `cpack -G DEB` in the build folder, one for each install component:
#
#   libteravox       runtime      the library, and the one for VTK_AUTOLOAD_PATH
#   libteravox-dev   development  headers, find_package(Teravox)
#   python3-teravox  python       the package teravox
#   teravox          program      the program
#
# and in the build folder of the ParaView plugin
#
#   paraview-plugin-teravox  paraview  the plugin with its libraries
#
# A component alone: cmake --install <build> --component <component>.
if (TERAVOX_BUILD_PARAVIEW_PLUGIN)
  set(components paraview)
else ()
  set(components runtime development)
  if (TERAVOX_WRAP_PYTHON)
    list(APPEND components python)
  endif ()
  if (TARGET teravox)
    list(APPEND components program)
  endif ()
endif ()
set(package_of_runtime libteravox)
set(package_of_development libteravox-dev)
set(package_of_python python3-teravox)
set(package_of_program teravox)
set(package_of_paraview paraview-plugin-teravox)
set(text_of_runtime "Out-of-core volume rendering for VTK: library")
set(text_of_development "Out-of-core volume rendering for VTK: development files")
set(text_of_python "Out-of-core volume rendering for VTK: Python package")
set(text_of_program "Out-of-core volume rendering for VTK: program")
set(text_of_paraview "Out-of-core volume rendering for ParaView: plugin")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME teravox)
set(CPACK_PACKAGE_VENDOR "Teravox contributors")
set(CPACK_PACKAGE_CONTACT "Teravox contributors <teravox@localhost>")
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Out-of-core volume rendering for VTK")
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Our own library isn't in any package yet when the others' dependencies are looked up.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
if (TERAVOX_BUILD_PARAVIEW_PLUGIN)
  # Neither is ParaView where it is unpacked instead of installed. What its shlibs say of all its
  # libraries: this very version.
  get_target_property(paraview_library ParaView::RemotingCore LOCATION)
  get_filename_component(paraview_libraries "${paraview_library}" DIRECTORY)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${paraview_libraries}")
  string(CONCAT paraview_depends "paraview (>= ${ParaView_VERSION}+dfsg), "
    "paraview (<< ${ParaView_VERSION}+dfsg.)")
  set(CPACK_DEBIAN_PARAVIEW_PACKAGE_DEPENDS "${paraview_depends}")
  set(CPACK_DEBIAN_PARAVIEW_PACKAGE_SECTION science)
endif ()
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

foreach (component IN LISTS components)
  string(TOUPPER "${component}" upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME "${package_of_${component}}")
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${text_of_${component}}")
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE"
    DESTINATION "share/doc/${package_of_${component}}" RENAME copyright COMPONENT "${component}")
endforeach ()
set(same_version "libteravox (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${same_version}, libvtk9-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
if (TERAVOX_WRAP_PYTHON)
  # Extension modules are for one version of Python.
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
  string(CONCAT python_depends "${same_version}, python3 (>= 3.${Python3_VERSION_MINOR}), "
    "python3 (<< 3.${next_python}), python3-vtk9, python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${python_depends}")
endif ()
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-tqdm, python3-matplotlib, python3-h5py")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/CMake/debian/prerm")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "${same_version}")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "xvfb, xauth")
include(CPack)
