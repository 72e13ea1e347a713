# find_package(OROCOS-RTT): the runtime for Linux, see the README.md of its sources. Either it is installed, or its sources are a
# part of the same project.

if(NOT OROCOS_TARGET)
  if(NOT "$ENV{OROCOS_TARGET}" STREQUAL "")
    set(OROCOS_TARGET "$ENV{OROCOS_TARGET}")
  else()
    set(OROCOS-RTT_FOUND FALSE)
    set(OROCOS-RTT_NOT_FOUND_MESSAGE "OROCOS_TARGET is not set, in CMake or in the environment; gnulinux is the usual one")
    return()
  endif()
endif()

find_package(Threads REQUIRED)

get_filename_component(_mauve_rtt "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET mauve-rtt-library)
  # Packages export what they are linked with, and may export only what others have made.
  add_library(mauve-rtt-library SHARED IMPORTED GLOBAL)
  if(TARGET mauve-rtt)
    get_target_property(_mauve_rtt_build mauve-rtt BINARY_DIR)
    set_target_properties(mauve-rtt-library PROPERTIES IMPORTED_LOCATION "${_mauve_rtt_build}/libmauve-rtt.so")
    add_dependencies(mauve-rtt-library mauve-rtt)
  else()
    set_target_properties(mauve-rtt-library PROPERTIES IMPORTED_LOCATION "${_mauve_rtt}/lib/libmauve-rtt.so")
  endif()
endif()
set(OROCOS-RTT_VERSION 2.10.0)
set(OROCOS-RTT_INCLUDE_DIRS "${_mauve_rtt}/include")
set(OROCOS-RTT_LIBRARIES mauve-rtt-library Threads::Threads ${CMAKE_DL_LIBS})
set(OROCOS-RTT_DEFINITIONS "-DOROCOS_TARGET=${OROCOS_TARGET}" -DMAUVE_RUNTIME)
set(OROCOS-RTT_USE_FILE_PATH "${CMAKE_CURRENT_LIST_DIR}")
set(OROCOS-RTT_USE_FILE "${OROCOS-RTT_USE_FILE_PATH}/UseOROCOS-RTT.cmake")
unset(_mauve_rtt)
