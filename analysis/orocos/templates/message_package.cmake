# {mark}: do not change this file.

set({of}_INCLUDE_DIRS ${ros_include_dirs})
set({of}_LIBRARIES ${ros_libraries})
set({of}_EXPORTED_TARGETS)
