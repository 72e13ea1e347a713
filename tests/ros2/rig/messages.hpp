// Messages, as generated headers have them.

#ifndef MAUVE_TESTS_MESSAGES_HPP
#define MAUVE_TESTS_MESSAGES_HPP

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace builtin_interfaces {
namespace msg {

struct Time {
  std::int32_t sec{};
  std::uint32_t nanosec{};
};

template <class Stream>
void visit(Stream& stream, Time& message) {
  stream(message.sec);
  stream(message.nanosec);
}

}  // namespace msg
}  // namespace builtin_interfaces

namespace std_msgs {
namespace msg {

struct Header {
  builtin_interfaces::msg::Time stamp{};
  std::string frame_id{};
};

template <class Stream>
void visit(Stream& stream, Header& message) {
  stream(message.stamp);
  stream(message.frame_id);
}

}  // namespace msg
}  // namespace std_msgs

namespace geometry_msgs {
namespace msg {

struct Vector3 {
  double x{}, y{}, z{};
};

template <class Stream>
void visit(Stream& stream, Vector3& message) {
  stream(message.x);
  stream(message.y);
  stream(message.z);
}

struct Twist {
  Vector3 linear{}, angular{};
};

template <class Stream>
void visit(Stream& stream, Twist& message) {
  stream(message.linear);
  stream(message.angular);
}

}  // namespace msg
}  // namespace geometry_msgs

namespace sensor_msgs {
namespace msg {

struct LaserScan {
  std_msgs::msg::Header header{};
  float angle_min{}, angle_max{}, angle_increment{}, time_increment{}, scan_time{}, range_min{}, range_max{};
  std::vector<float> ranges{}, intensities{};
};

template <class Stream>
void visit(Stream& stream, LaserScan& message) {
  stream(message.header);
  stream(message.angle_min);
  stream(message.angle_max);
  stream(message.angle_increment);
  stream(message.time_increment);
  stream(message.scan_time);
  stream(message.range_min);
  stream(message.range_max);
  stream(message.ranges);
  stream(message.intensities);
}

struct Image {
  std_msgs::msg::Header header{};
  std::uint32_t height{}, width{};
  std::string encoding{};
  std::uint8_t is_bigendian{};
  std::uint32_t step{};
  std::vector<std::uint8_t> data{};
};

template <class Stream>
void visit(Stream& stream, Image& message) {
  stream(message.header);
  stream(message.height);
  stream(message.width);
  stream(message.encoding);
  stream(message.is_bigendian);
  stream(message.step);
  stream(message.data);
}

}  // namespace msg
}  // namespace sensor_msgs

// Every kind of field.
namespace rig {
namespace msg {

struct Inner {
  std::uint8_t kind{};
  std::string name{};
};

template <class Stream>
void visit(Stream& stream, Inner& message) {
  stream(message.kind);
  stream(message.name, 20);
}

struct All {
  bool flag{};
  std::int8_t i8{};
  std::uint8_t u8{};
  std::int16_t i16{};
  std::uint16_t u16{};
  std::int32_t i32{};
  std::uint32_t u32{};
  std::int64_t i64{};
  std::uint64_t u64{};
  float f32{};
  double f64{};
  std::string text{}, short_text{};
  std::array<double, 3> numbers{};
  std::array<bool, 3> flags{};
  std::vector<std::int16_t> sequence{};
  std::vector<double> bounded{};
  std::vector<bool> many_flags{};
  std::vector<std::string> texts{};
  std::vector<std::string> short_texts{};
  Inner inner{};
  std::array<Inner, 2> inners{};
  std::vector<Inner> many_inners{};
  std::uint8_t last{};
};

template <class Stream>
void visit(Stream& stream, All& message) {
  stream(message.flag);
  stream(message.i8);
  stream(message.u8);
  stream(message.i16);
  stream(message.u16);
  stream(message.i32);
  stream(message.u32);
  stream(message.i64);
  stream(message.u64);
  stream(message.f32);
  stream(message.f64);
  stream(message.text);
  stream(message.short_text, 10);
  stream(message.numbers);
  stream(message.flags);
  stream(message.sequence);
  stream(message.bounded, 4);
  stream(message.many_flags);
  stream(message.texts);
  stream(message.short_texts, 3, 10);
  stream(message.inner);
  stream(message.inners);
  stream(message.many_inners);
  stream(message.last);
}

}  // namespace msg
}  // namespace rig

#endif
