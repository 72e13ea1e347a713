# What a package of components calls: see the README.md of the runtime.

include(CMakeParseArguments)

include_directories(${OROCOS-RTT_INCLUDE_DIRS})
add_definitions(${OROCOS-RTT_DEFINITIONS})

set(OROCOS_SUFFIX "/${OROCOS_TARGET}")

# Links as RTT does, without the keywords of target_link_libraries: who uses them for the same target is told so by CMake.
function(_mauve_rtt_library name folder)
  set_target_properties(${name} PROPERTIES
    OUTPUT_NAME "${name}-${OROCOS_TARGET}"
    INSTALL_RPATH_USE_LINK_PATH TRUE)
  set_property(TARGET ${name} APPEND_STRING PROPERTY LINK_FLAGS " -Wl,-z,defs")
  target_link_libraries(${name} ${OROCOS-RTT_LIBRARIES})
  if(CATKIN_DEVEL_PREFIX)
    set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${CATKIN_DEVEL_PREFIX}/${folder}")
  endif()
  install(TARGETS ${name} LIBRARY DESTINATION "${folder}")
endfunction()

# orocos_component(name source... [INSTALL folder] [VERSION version]): lib<name>-<target>.so, which a deployer can load.
macro(orocos_component name)
  cmake_parse_arguments(_mauve_rtt "" "INSTALL;VERSION;EXPORT" "" ${ARGN})
  set(_mauve_rtt_folder "lib/orocos${OROCOS_SUFFIX}/${PROJECT_NAME}")
  if(_mauve_rtt_INSTALL)
    set(_mauve_rtt_folder "${_mauve_rtt_INSTALL}${OROCOS_SUFFIX}")
  endif()
  add_library(${name} SHARED ${_mauve_rtt_UNPARSED_ARGUMENTS})
  set_target_properties(${name} PROPERTIES DEFINE_SYMBOL RTT_COMPONENT)
  _mauve_rtt_library(${name} "${_mauve_rtt_folder}")
endmacro()

# orocos_library(name source... [INSTALL folder] [VERSION version]): a library that components are linked with.
macro(orocos_library name)
  cmake_parse_arguments(_mauve_rtt "" "INSTALL;VERSION;EXPORT" "" ${ARGN})
  set(_mauve_rtt_folder lib)
  if(_mauve_rtt_INSTALL)
    set(_mauve_rtt_folder "${_mauve_rtt_INSTALL}")
  endif()
  add_library(${name} SHARED ${_mauve_rtt_UNPARSED_ARGUMENTS})
  _mauve_rtt_library(${name} "${_mauve_rtt_folder}")
endmacro()

# orocos_install_headers(header... [INSTALL folder])
macro(orocos_install_headers)
  cmake_parse_arguments(_mauve_rtt "" "INSTALL" "" ${ARGN})
  set(_mauve_rtt_folder "include/orocos/${PROJECT_NAME}")
  if(_mauve_rtt_INSTALL)
    set(_mauve_rtt_folder "${_mauve_rtt_INSTALL}")
  endif()
  install(FILES ${_mauve_rtt_UNPARSED_ARGUMENTS} DESTINATION "${_mauve_rtt_folder}")
endmacro()

# orocos_generate_package([VERSION version] [DEPENDS package...]), the last call of a package: what pkg-config says of it.
macro(orocos_generate_package)
  cmake_parse_arguments(_mauve_rtt "" "VERSION" "DEPENDS" ${ARGN})
  if(NOT _mauve_rtt_VERSION)
    set(_mauve_rtt_VERSION 1.0)
  endif()
  set(_mauve_rtt_file "${PROJECT_BINARY_DIR}/${PROJECT_NAME}-${OROCOS_TARGET}.pc")
  string(CONCAT _mauve_rtt_text
    "prefix=${CMAKE_INSTALL_PREFIX}\n"
    "Name: ${PROJECT_NAME}\n"
    "Description: ${PROJECT_NAME} package for Orocos\n"
    "Version: ${_mauve_rtt_VERSION}\n"
    "Cflags: -I\${prefix}/include/orocos\n")
  file(WRITE "${_mauve_rtt_file}" "${_mauve_rtt_text}")
  install(FILES "${_mauve_rtt_file}" DESTINATION lib/pkgconfig)
endmacro()
