// {mark}: do not change this file.
//
// An instant and a duration, with the fields of ROS 1.

#pragma once

#include <cstdint>

namespace ros {

struct Time {
  std::uint32_t sec = 0;
  std::uint32_t nsec = 0;
};

struct Duration {
  std::int32_t sec = 0;
  std::int32_t nsec = 0;
};

}  // namespace ros
