// A robot with topics in both directions.

#include <mauve/robot.hpp>
#include <mauve/ros2.hpp>

#include "messages.hpp"

int main(int argc, char** argv) {
  constexpr std::int64_t ms = 1000000;
  constexpr std::size_t mib = 1048576;
  mauve::Robot robot("rig.Run");
  for (const auto& it : {"Laser", "TwistEcho", "ImageEcho", "AllEcho"}) robot.instance(it, "rig", it);
  // A virtual machine may be stopped for some of it; a CPU without time for others stops for more.
  const std::int64_t deadline = 40 * ms;
  robot.activity("Laser", 2 * ms, 40, mauve::cpus({0}), 0, deadline, mauve::no_bound);
  robot.activity("TwistEcho", 2 * ms, 39, mauve::cpus({0}), 0, deadline, mauve::no_bound);
  robot.activity("ImageEcho", 10 * ms, 10, mauve::cpus({0}), 0, 0, mauve::no_bound);
  robot.activity("AllEcho", 5 * ms, 9, mauve::cpus({0}), 0, 0, mauve::no_bound);
  mauve::Ros2 ros2(robot, "/rig", "rig_Run");
  ros2.domain(0);
  ros2.discovery(mauve::Ros2::Localhost);
  ros2.gateway(ms, 20, mauve::cpus({1}), deadline, mauve::no_bound);
  const char twist[] = "geometry_msgs::msg::dds_::Twist_";
  const char twist_hash[] = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a";
  const char image[] = "sensor_msgs::msg::dds_::Image_";
  const char image_hash[] = "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47";
  const char all_hash[] = "RIHS01_0000000000000000000000000000000000000000000000000000000000000000";
  ros2.publish<sensor_msgs::msg::LaserScan>({"laser.ranges", "Laser", "ranges", "/rig/scan",
                                             "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
                                             "sensor_msgs::msg::dds_::LaserScan_", 1, true, false, mib});
  ros2.subscribe<geometry_msgs::msg::Twist>({"twist.in", "TwistEcho", "in", "/cmd_vel", twist_hash, twist, 10, true, false, mib});
  ros2.publish<geometry_msgs::msg::Twist>({"twist.out", "TwistEcho", "out", "/rig/twist", twist_hash, twist, 10, true, false, mib});
  ros2.subscribe<sensor_msgs::msg::Image>({"image.in", "ImageEcho", "in", "/rig/image_in", image_hash, image, 2, true, false, 4 * mib});
  ros2.publish<sensor_msgs::msg::Image>({"image.out", "ImageEcho", "out", "/rig/image_out", image_hash, image, 2, true, false, 4 * mib});
  ros2.subscribe<rig::msg::All>({"all.in", "AllEcho", "in", "/rig/all_in", all_hash, "rig::msg::dds_::All_", 10, true, false, 4096});
  ros2.publish<rig::msg::All>({"all.out", "AllEcho", "out", "/rig/all_out", all_hash, "rig::msg::dds_::All_", 10, true, true, 4096});
  return robot.run(argc, argv);
}
