# {mark}: change the model, not this file.
@if programs
#
# Builds a program for each deployment, without Orocos:
#
#   cmake -S standalone -B build && cmake --build build && build/{first_program}
@end

cmake_minimum_required(VERSION 3.10...3.25)
project(standalone LANGUAGES C CXX)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "The build type" FORCE)
endif()
if(NOT CMAKE_CXX_STANDARD)
  set(CMAKE_CXX_STANDARD 14)
endif()
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)

@if ros2_package
# The package of ROS 2: its libraries are beside its programs, and nothing else of them is installed.
set(CMAKE_INSTALL_RPATH "$ORIGIN")
@end
set(MAUVE_PACKAGES "${CMAKE_CURRENT_SOURCE_DIR}/.." CACHE PATH "The folder of the packages")

# The packages find the runtime in place of Orocos.
set(ORO_USE_CATKIN OFF)
set(OROCOS_TARGET gnulinux)
add_subdirectory(runtime{excluded})
@if ros2
{ros2}
@end
set(OROCOS-RTT_DIR "${CMAKE_CURRENT_SOURCE_DIR}/runtime/lib/cmake/orocos-rtt")
@if headers

# The messages: the headers of ROS 1 if all of them are installed; otherwise those in the folder `messages`.
option(MAUVE_ROS_MESSAGES "Use the messages of ROS 1 if they are installed" ON)
set(ros_include_dirs)
set(ros_libraries)
set(has_ros {has_ros})
foreach(header
  ros/serialization.h
{headers}
)
  get_filename_component(package ${header} DIRECTORY)
  find_path(MAUVE_INCLUDE_${package} ${header})
  mark_as_advanced(MAUVE_INCLUDE_${package})
  list(APPEND ros_include_dirs ${MAUVE_INCLUDE_${package}})
  if(NOT EXISTS "${MAUVE_INCLUDE_${package}}/${header}")
    set(has_ros OFF)
  endif()
endforeach()
foreach(package {message_packages})
  set(${package}_DIR "${CMAKE_CURRENT_SOURCE_DIR}/messages/${package}")
endforeach()
foreach(library roscpp_serialization rostime)
  find_library(MAUVE_LIBRARY_${library} ${library})
  mark_as_advanced(MAUVE_LIBRARY_${library})
  list(APPEND ros_libraries ${MAUVE_LIBRARY_${library}})
  if(NOT MAUVE_LIBRARY_${library})
    set(has_ros OFF)
  endif()
endforeach()
if(has_ros)
  list(REMOVE_DUPLICATES ros_include_dirs)
  message(STATUS "Messages of ROS: ${ros_include_dirs}")
else()
  # An installed package cannot refer to this folder.
  set(ros_include_dirs "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/messages/include>")
  set(ros_libraries)
  message(STATUS "Messages without ROS: ${CMAKE_CURRENT_SOURCE_DIR}/messages")
endif()
@if ros2

# The types of ROS 2, if it is sourced and has all of these messages: then codels have `sensor_msgs::msg::LaserScan` of rclcpp.
option(MAUVE_ROS2_MESSAGES "Use the types of ROS 2 if it is sourced" ON)
string(REPLACE ":" ";" ros2_prefixes "$ENV{AMENT_PREFIX_PATH}")
set(ros2_include_dirs)
set(has_ros2 ${MAUVE_ROS2_MESSAGES})
foreach(header
{ros2_headers}
  # What they include.
  rosidl_runtime_c/message_type_support_struct.h
  rosidl_runtime_cpp/bounded_vector.hpp
  rosidl_typesupport_cpp/message_type_support.hpp
  rosidl_typesupport_interface/macros.h
  rosidl_typesupport_introspection_cpp/visibility_control.h
  rcutils/allocator.h
)
  string(REGEX REPLACE "/.*" "" package ${header})
  set(folder)
  foreach(prefix ${ros2_prefixes})
    foreach(candidate "${prefix}/include/${package}" "${prefix}/include")
      if(NOT folder AND EXISTS "${candidate}/${header}")
        set(folder ${candidate})
      endif()
    endforeach()
  endforeach()
  if(folder)
    list(APPEND ros2_include_dirs ${folder})
  elseif(header MATCHES "/msg/")
    set(has_ros2 OFF)
  endif()
endforeach()
if(has_ros2)
  list(REMOVE_DUPLICATES ros2_include_dirs)
  list(APPEND ros_include_dirs ${ros2_include_dirs})
  add_definitions(-DMAUVE_ROS2_MESSAGES)
  if(CMAKE_CXX_STANDARD LESS 17)
    set(CMAKE_CXX_STANDARD 17)
  endif()
  message(STATUS "Messages of ROS 2: ${ros2_include_dirs}")
endif()
@end
@end
@if packages

# The packages; those that others call come first.
foreach(package {packages})
  add_subdirectory("${MAUVE_PACKAGES}/${package}" "packages/${package}"{excluded})
endforeach()
@end
@if programs

# What recordings say of the programs: with another compiler or other flags, execution times are others.
string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
string(REGEX REPLACE "[ \t\r\n]+" " " flags "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}}")
string(STRIP "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_SYSTEM_PROCESSOR} ${flags}" built_by)
file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/mauve-build.hpp" CONTENT "#define MAUVE_BUILD R\"mauve(${built_by})mauve\"\n")

# A program loads its components by their names, so it is linked with them although it calls none of them.
function(add_program program)
  add_executable(${program} ${program}.cpp)
  target_link_libraries(${program} PRIVATE {runtime} ${ARGN})
@if ros2
  target_include_directories(${program} SYSTEM PRIVATE ${ros_include_dirs})
@end
  target_compile_options(${program} PRIVATE -include "${CMAKE_CURRENT_BINARY_DIR}/mauve-build.hpp")
  set_target_properties(${program} PROPERTIES
    LINK_FLAGS "-Wl,--no-as-needed"
    RUNTIME_OUTPUT_DIRECTORY "$<1:${CMAKE_BINARY_DIR}>"
  )
endfunction()

{programs}
@if ros2_package

# A package of ROS 2: `ros2 run {ros2_package} PROGRAM`, `ros2 launch {ros2_package} DEPLOYMENT.launch.py`.
get_property(built DIRECTORY PROPERTY BUILDSYSTEM_TARGETS)
set(folder "lib/{ros2_package}")
foreach(target ${built} {libraries} {runtime} mauve-rtt)
  if(TARGET ${target})
    get_target_property(type ${target} TYPE)
    if(type MATCHES "^(EXECUTABLE|SHARED_LIBRARY)$")
      install(TARGETS ${target} RUNTIME DESTINATION "${folder}" LIBRARY DESTINATION "${folder}")
    endif()
  endif()
endforeach()
install(FILES package.xml DESTINATION "share/{ros2_package}")
install(DIRECTORY launch DESTINATION "share/{ros2_package}")
file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/{ros2_package}" "")
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/{ros2_package}"
  DESTINATION share/ament_index/resource_index/packages)
@end
@end
