# find_package(OROCOS-RTT): the stand-in for tests, see ../../../README.md.

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

get_filename_component(_rtt_shim "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(OROCOS-RTT_VERSION 2.10.0)
set(OROCOS-RTT_INCLUDE_DIRS "${_rtt_shim}/include")
set(OROCOS-RTT_LIBRARIES Threads::Threads ${CMAKE_DL_LIBS})
set(OROCOS-RTT_DEFINITIONS "-DOROCOS_TARGET=${OROCOS_TARGET}")
set(OROCOS-RTT_USE_FILE_PATH "${CMAKE_CURRENT_LIST_DIR}")
set(OROCOS-RTT_USE_FILE "${OROCOS-RTT_USE_FILE_PATH}/UseOROCOS-RTT.cmake")
unset(_rtt_shim)
