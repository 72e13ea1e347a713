//! The messages of ROS as plain structs, for machines without the headers of ROS 1: the messages that the packages use, and
//! those of their fields. They have the names, the fields and the types of these headers.
//!
//! ```text
//! messages/include/geometry_msgs/Twist.h
//! messages/geometry_msgs/geometry_msgsConfig.cmake    what find_package(geometry_msgs) finds
//! ```
//!
//! The build file (`templates/standalone.cmake`) uses the headers of ROS instead if all of them are installed, and never some
//! of both. It does not use ROS's own packages for CMake: they execute Python programs of catkin.

use std::collections::{BTreeMap, BTreeSet};

use mauve_hir::item_tree::Name;
use mauve_hir::{
    FieldParts, Message, MessageConstant, MessageField, MessageSize, ModelDb, Workspace, package,
};

use crate::cpp_name::field_name;
use crate::cpp_type::included;
use crate::escape::{comment, cpp_string};
use crate::generated_file::{GeneratedFile, STANDALONE_MARK, is_name};
use crate::template::{filled, lines};

/// The messages of a project.
pub(super) struct MessageHeaders<'db> {
    db: &'db dyn ModelDb,
    workspace: Workspace,
    /// Whether they have the types of ROS 2, and list their fields: samples of topics.
    are_samples: bool,
    /// By package and name.
    all: BTreeMap<(Name, Name), &'db Message>,
}

/// The type of a field in C++.
struct FieldType {
    cpp: String,
    /// As in `#include <…>`.
    headers: Vec<String>,
    /// The message of its elements.
    message: Option<(Name, Name)>,
    /// Further arguments of a stream: of a sequence or a string, and of the strings in a sequence.
    bounds: String,
    /// Sets it to zero, if its constructor does not.
    initial: &'static str,
}

impl<'db> MessageHeaders<'db> {
    pub(super) fn new(db: &'db dyn ModelDb, workspace: Workspace, are_samples: bool) -> MessageHeaders<'db> {
        MessageHeaders { db, workspace, are_samples, all: BTreeMap::new() }
    }

    /// Adds messages, and those of their fields.
    pub(super) fn add(&mut self, messages: impl IntoIterator<Item = (Name, Name)>) {
        let mut open: Vec<(Name, Name)> = messages.into_iter().collect();
        while let Some(key) = open.pop() {
            if self.all.contains_key(&key) {
                continue;
            }
            if let Some(message) = self.message(&key) {
                let types = message.fields.iter().filter_map(|field| self.field_type(&key.0, field));
                open.extend(types.filter_map(|it| it.message));
                self.all.insert(key, message);
            }
        }
    }

    fn message(&self, (of, name): &(Name, Name)) -> Option<&'db Message> {
        let found = package(self.db, self.workspace, of)?.messages.get(name)?;
        Some(found).filter(|_| is_name(of) && is_name(name))
    }

    pub(super) fn files(&self) -> Vec<GeneratedFile> {
        let mark = || ("mark", STANDALONE_MARK.to_owned());
        let mut texts: BTreeMap<String, String> = BTreeMap::new();
        let mut uses_time = false;
        for (key @ (of, name), message) in &self.all {
            let text = self.header(key, message);
            uses_time |= text.contains(TIME_HEADER);
            texts.insert(format!("messages/include/{of}/{name}.h"), text);
            let package = filled(
                include_str!("../../templates/message_package.cmake"),
                &[mark(), ("of", of.to_string())],
            );
            texts.insert(format!("messages/{of}/{of}Config.cmake"), package);
        }
        if uses_time {
            let text = filled(include_str!("../../templates/time.h"), &[mark()]);
            texts.insert(format!("messages/include/{TIME_HEADER}"), text);
        }
        texts.into_iter().map(|(path, text)| GeneratedFile::generated(path, text)).collect()
    }

    /// Returns the header of a message.
    fn header(&self, (of, name): &(Name, Name), message: &Message) -> String {
        let mut headers: BTreeSet<String> = BTreeSet::new();
        let mut visited: Vec<String> = Vec::new();
        let mut body: Vec<String> = message.constants.iter().filter_map(|it| constant(it, name)).collect();
        if !body.is_empty() && !message.fields.is_empty() {
            body.push(String::new());
        }
        for field in &message.fields {
            let found = self.field_type(of, field);
            // A message that is not installed.
            let found = found.filter(|it| it.message.as_ref().is_none_or(|it| self.all.contains_key(it)));
            let Some(found) = found else {
                body.push(format!("// {} is missing: its type is unknown.", comment(&field.to_string())));
                continue;
            };
            if self.are_samples {
                let field_name = field_name(&field.name, name);
                visited.push(format!("  stream(message.{field_name}{});", found.bounds));
            }
            headers.extend(found.headers);
            body.push(format!("{} {}{};", found.cpp, field_name(&field.name, name), found.initial));
        }
        let indented =
            body.iter().map(|line| if line.is_empty() { String::new() } else { format!("  {line}") });
        let [standard, own] = included(&headers);
        let is_empty = visited.is_empty();
        if self.are_samples && is_empty {
            visited.push("  stream.empty();".to_owned());
        }
        let values = [
            ("mark", STANDALONE_MARK.to_owned()),
            ("of", of.to_string()),
            ("name", name.to_string()),
            ("installed", installed_header(of, name)),
            ("standard", standard),
            ("own", own),
            ("body", lines(indented)),
            ("ros", if self.are_samples { "2" } else { "1" }.to_owned()),
            ("message", if is_empty { "" } else { " message" }.to_owned()),
            ("visit", lines(visited)),
        ];
        filled(include_str!("../../templates/message.h"), &values)
    }

    /// Returns the type of a field of a message in `package`; `None` if it has no form of ROS.
    fn field_type(&self, package: &Name, field: &MessageField) -> Option<FieldType> {
        let FieldParts { element, text_bound, size } = field.parts()?;
        let (cpp, header) = match element {
            "bool" if self.are_samples => ("bool", ""),
            "byte" if self.are_samples => ("std::uint8_t", "cstdint"),
            "bool" | "char" | "uint8" => ("std::uint8_t", "cstdint"),
            "byte" | "int8" => ("std::int8_t", "cstdint"),
            "int16" => ("std::int16_t", "cstdint"),
            "uint16" => ("std::uint16_t", "cstdint"),
            "int32" => ("std::int32_t", "cstdint"),
            "uint32" => ("std::uint32_t", "cstdint"),
            "int64" => ("std::int64_t", "cstdint"),
            "uint64" => ("std::uint64_t", "cstdint"),
            "float32" => ("float", ""),
            "float64" => ("double", ""),
            "string" => ("std::string", "string"),
            "wstring" => ("std::u16string", "string"),
            "time" => ("::ros::Time", TIME_HEADER),
            "duration" => ("::ros::Duration", TIME_HEADER),
            _ => ("", ""),
        };
        let mut found = FieldType {
            cpp: cpp.to_owned(),
            headers: Some(header).filter(|it| !it.is_empty()).map(str::to_owned).into_iter().collect(),
            message: None,
            bounds: match (size, text_bound) {
                (MessageSize::One | MessageSize::Array(_) | MessageSize::Sequence(0), 0) => String::new(),
                (MessageSize::One, bound) | (MessageSize::Sequence(bound), 0) => format!(", {bound}"),
                (MessageSize::Array(_), of_text) => format!(", 0, {of_text}"),
                (MessageSize::Sequence(bound), of_text) => format!(", {bound}, {of_text}"),
            },
            initial: if header == "cstdint" || matches!(cpp, "float" | "double" | "bool") {
                " = 0"
            } else {
                ""
            },
        };
        if cpp.is_empty() {
            let (of, name) = element.split_once('/').unwrap_or((package, element));
            found.cpp = format!("::{of}::{name}");
            found.headers.push(format!("{of}/{name}.h"));
            found.message = Some((of.into(), name.into()));
        }
        match size {
            MessageSize::One => {}
            MessageSize::Sequence(_) => {
                found.cpp = format!("std::vector<{}>", found.cpp);
                found.headers.push("vector".to_owned());
                found.initial = "";
            }
            MessageSize::Array(size) => {
                let size = u32::try_from(size).ok()?;
                found.cpp = format!("std::array<{}, {size}>", found.cpp);
                found.headers.push("array".to_owned());
                found.initial = "{}";
            }
        }
        Some(found)
    }

    /// Returns the paths of all headers.
    pub(super) fn headers(&self) -> impl Iterator<Item = String> {
        self.all.keys().map(|(of, name)| format!("{of}/{name}.h"))
    }

    /// Returns the paths of all headers of ROS 2.
    pub(super) fn installed_headers(&self) -> impl Iterator<Item = String> {
        self.all.keys().map(|(of, name)| installed_header(of, name))
    }

    /// Returns the packages of all messages.
    pub(super) fn packages(&self) -> Vec<&str> {
        let mut packages: Vec<&str> = self.all.keys().map(|(of, _)| of.as_str()).collect();
        packages.dedup();
        packages
    }
}

const TIME_HEADER: &str = "ros/time.h";

/// Returns the declaration of a constant; `None` if its value is not of its type.
fn constant(of: &MessageConstant, message: &str) -> Option<String> {
    let MessageConstant { name, ty, value } = of;
    let name = field_name(name, message);
    let integer = |value: i128| match value {
        // Its digits alone are too large for a signed integer.
        _ if value == i128::from(i64::MIN) => Some(format!("{} - 1", i64::MIN + 1)),
        _ if i64::try_from(value).is_ok() => Some(value.to_string()),
        _ => u64::try_from(value).ok().map(|value| format!("{value}u")),
    };
    let number = |value: f64| value.is_finite().then(|| format!("{value:?}"));
    Some(match ty.as_str() {
        "bool" if matches!(value.as_str(), "True" | "true") => format!("enum {{ {name} = 1 }};"),
        "bool" if matches!(value.as_str(), "False" | "false") => format!("enum {{ {name} = 0 }};"),
        "float32" => {
            format!("static constexpr float {name} = {}f;", number(value.parse::<f32>().ok()?.into())?)
        }
        "float64" => format!("static constexpr double {name} = {};", number(value.parse().ok()?)?),
        "string" => {
            let quoted = value.strip_prefix(['"', '\'']).and_then(|text| text.strip_suffix(['"', '\'']));
            format!("static constexpr const char* {name} = {};", cpp_string(quoted.unwrap_or(value)))
        }
        "wstring" => return None,
        _ => format!("enum {{ {name} = {} }};", integer(value.parse().ok()?)?),
    })
}

/// Returns the header of a message in ROS 2: `sensor_msgs/msg/laser_scan.hpp`.
fn installed_header(of: &str, message: &str) -> String {
    let letters: Vec<char> = message.chars().collect();
    let mut file = String::new();
    for (index, letter) in letters.iter().enumerate() {
        let before = index.checked_sub(1).and_then(|it| letters.get(it));
        let is_after_small = before.is_some_and(|it| it.is_ascii_lowercase() || it.is_ascii_digit());
        let is_before_small = letters.get(index + 1).is_some_and(char::is_ascii_lowercase);
        if letter.is_ascii_uppercase() && (is_after_small || before.is_some() && is_before_small) {
            file.push('_');
        }
        file.push(letter.to_ascii_lowercase());
    }
    format!("{of}/msg/{file}.hpp")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Package, Workspace, catalogue_of, read_message};
    use salsa::Setter as _;

    use super::*;

    /// The headers of a message of package `p` that has these messages, and of those that it needs.
    fn check(messages: &[(&str, &str)], expected: Expect) {
        let messages = messages.iter().map(|(name, text)| (Name::from(*name), read_message(text)));
        let package = Package { name: "p".into(), messages: messages.collect() };
        let mut db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), []);
        let packages = BTreeMap::from([(package.name.clone(), Arc::new(package))]);
        workspace.set_packages(&mut db).to(Arc::new(packages));
        let mut messages = MessageHeaders::new(&db, workspace, false);
        messages.add([("p".into(), "M".into())]);
        let files = messages.files().into_iter().filter(|file| file.path.ends_with(".h"));
        let texts = files.map(|file| format!("---- {}\n{}", file.path, file.text));
        expected.assert_eq(&texts.collect::<String>());
    }

    #[test]
    fn fields_have_the_types_of_ros() {
        check(
            &[
                (
                    "M",
                    "bool on\nbyte b\nchar c\nuint16 n\nfloat32 f\nfloat64[3] d\nstring s\nwstring<=5 w\ntime at\n\
                 duration[] for\nOther[<=4] others\nq/Missing[2] missing\nstd_msgs/Empty empty\nint8[99999999999] many",
                ),
                ("Other", "M[] again\nint32 Other\nint64 class"),
            ],
            expect![[r#"
                ---- messages/include/p/M.h
                // Generated by `mauve generate` for standalone programs: do not change this file.
                //
                // The message p/M, with the fields of the header of ROS 1.

                #pragma once

                #include <array>
                #include <cstdint>
                #include <string>
                #include <vector>

                #include <p/Other.h>
                #include <ros/time.h>
                #include <std_msgs/Empty.h>

                namespace p {

                struct M {
                  std::uint8_t on = 0;
                  std::int8_t b = 0;
                  std::uint8_t c = 0;
                  std::uint16_t n = 0;
                  float f = 0;
                  std::array<double, 3> d{};
                  std::string s;
                  std::u16string w;
                  ::ros::Time at;
                  std::vector<::ros::Duration> for_;
                  std::vector<::p::Other> others;
                  // q/Missing[2] missing is missing: its type is unknown.
                  ::std_msgs::Empty empty;
                  // int8[99999999999] many is missing: its type is unknown.
                };

                }  // namespace p
                ---- messages/include/p/Other.h
                // Generated by `mauve generate` for standalone programs: do not change this file.
                //
                // The message p/Other, with the fields of the header of ROS 1.

                #pragma once

                #include <cstdint>
                #include <vector>

                #include <p/M.h>

                namespace p {

                struct Other {
                  std::vector<::p::M> again;
                  std::int32_t Other_ = 0;
                  std::int64_t class_ = 0;
                };

                }  // namespace p
                ---- messages/include/ros/time.h
                // Generated by `mauve generate` for standalone programs: do not change this file.
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
                ---- messages/include/std_msgs/Empty.h
                // Generated by `mauve generate` for standalone programs: do not change this file.
                //
                // The message std_msgs/Empty, with the fields of the header of ROS 1.

                #pragma once

                namespace std_msgs {

                struct Empty {};

                }  // namespace std_msgs
            "#]],
        );
    }

    #[test]
    fn constants_have_the_values_of_ros() {
        check(
            &[(
                "M",
                "uint8 ERROR=2\nint64 LEAST=-9223372036854775808\nuint64 MOST=18446744073709551615\nbool YES=True\n\
                 float32 HALF=0.5\nfloat64 MANY=1e300\nfloat64 NONE=nan\nstring TEXT=a \"b\nstring QUOTED='c'\n\
                 int32 BROKEN=1; evil\nint8 class=1",
            )],
            expect![[r#"
                ---- messages/include/p/M.h
                // Generated by `mauve generate` for standalone programs: do not change this file.
                //
                // The message p/M, with the fields of the header of ROS 1.

                #pragma once

                namespace p {

                struct M {
                  enum { ERROR = 2 };
                  enum { LEAST = -9223372036854775807 - 1 };
                  enum { MOST = 18446744073709551615u };
                  enum { YES = 1 };
                  static constexpr float HALF = 0.5f;
                  static constexpr double MANY = 1e300;
                  static constexpr const char* TEXT = "a \"b";
                  static constexpr const char* QUOTED = "c";
                  enum { class_ = 1 };
                };

                }  // namespace p
            "#]],
        );
    }

    #[test]
    fn headers_are_named_as_in_ros_2() {
        let all = [
            "LaserScan",
            "PointCloud2",
            "UInt8MultiArray",
            "NavSatFix",
            "BatteryState",
            "String",
            "TFMessage",
        ];
        assert_eq!(
            all.map(|it| installed_header("p", it)).join(" "),
            "p/msg/laser_scan.hpp p/msg/point_cloud2.hpp p/msg/u_int8_multi_array.hpp p/msg/nav_sat_fix.hpp \
             p/msg/battery_state.hpp p/msg/string.hpp p/msg/tf_message.hpp"
        );
    }

    #[test]
    fn the_catalogue_is_complete() {
        for (config, are_samples) in [("", false), ("[ros2]", true)] {
            let db = Database::default();
            let workspace = Workspace::of_texts(&db, "/".into(), [("/mauve.toml".into(), config.to_owned())]);
            let catalogue = catalogue_of(&db, workspace);
            let mut messages = MessageHeaders::new(&db, workspace, are_samples);
            let named =
                catalogue.iter().flat_map(|(of, it)| it.messages.keys().map(|it| (of.clone(), it.clone())));
            messages.add(named);
            let files = messages.files();
            // ROS 1 has no such package.
            assert_eq!(files.iter().any(|it| it.path.contains("/action_msgs/")), are_samples);
            for file in files {
                assert!(!file.text.contains("is missing"), "{}", file.text);
            }
        }
    }
}
