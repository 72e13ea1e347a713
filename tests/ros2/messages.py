"""The messages of rig/messages.hpp, for Cyclone DDS and for rosbags."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int8, int16, int32, int64, sequence, uint8, uint16, uint32, uint64


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str = ""


@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: float64 = 0.0


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class HalfTwist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Another definition with the same name: its samples end too early."""

    x: float64 = 0.0


@dataclass
class OtherTwist(IdlStruct, typename="stranger::msg::dds_::Twist_"):
    x: float64 = 0.0


@dataclass
class LaserScan(IdlStruct, typename="sensor_msgs::msg::dds_::LaserScan_"):
    header: Header
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class Inner(IdlStruct, typename="rig::msg::dds_::Inner_"):
    kind: uint8
    name: bounded_str[20]


@dataclass
class All(IdlStruct, typename="rig::msg::dds_::All_"):
    flag: bool
    i8: int8
    u8: uint8
    i16: int16
    u16: uint16
    i32: int32
    u32: uint32
    i64: int64
    u64: uint64
    f32: float32
    f64: float64
    text: str
    short_text: bounded_str[10]
    numbers: array[float64, 3]
    flags: array[bool, 3]
    sequence: sequence[int16]
    bounded: sequence[float64, 4]
    many_flags: sequence[bool]
    texts: sequence[str]
    short_texts: sequence[bounded_str[10], 3]
    inner: Inner
    inners: array[Inner, 2]
    many_inners: sequence[Inner]
    last: uint8


DEFINITIONS = {
    "rig/msg/Inner": "uint8 kind\nstring<=20 name\n",
    "rig/msg/All": """bool flag
int8 i8
uint8 u8
int16 i16
uint16 u16
int32 i32
uint32 u32
int64 i64
uint64 u64
float32 f32
float64 f64
string text
string<=10 short_text
float64[3] numbers
bool[3] flags
int16[] sequence
float64[<=4] bounded
bool[] many_flags
string[] texts
string<=10[<=3] short_texts
rig/Inner inner
rig/Inner[2] inners
rig/Inner[] many_inners
uint8 last
""",
}
