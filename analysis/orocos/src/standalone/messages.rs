//! The messages of ROS as plain structs, for machines without the headers of ROS 1: the messages that the packages use, and
//! those of their fields. They have the names, the fields and the types of these headers.
//!
//! ```text
//! messages/include/geometry_msgs/Twist.h
//! messages/geometry_msgs/geometry_msgsConfig.cmake    what find_package(geometry_msgs) finds
//! ```

use std::collections::{BTreeMap, BTreeSet};

use mauve_hir::item_tree::Name;
use mauve_hir::{Message, MessageConstant, MessageField, ModelDb, Workspace, package};

use super::STANDALONE_MARK;
use crate::cpp_name::field_name;
use crate::escape::{comment, cpp_string};
use crate::package::{GeneratedFile, is_name};

/// The messages of a project.
pub(super) struct Messages<'db> {
    db: &'db dyn ModelDb,
    workspace: Workspace,
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
    /// Sets it to zero, if its constructor does not.
    initial: &'static str,
}

impl<'db> Messages<'db> {
    pub(super) fn new(db: &'db dyn ModelDb, workspace: Workspace) -> Messages<'db> {
        Messages { db, workspace, all: BTreeMap::new() }
    }

    /// Adds messages, and those of their fields.
    pub(super) fn add(&mut self, messages: impl IntoIterator<Item = (Name, Name)>) {
        let mut open: Vec<(Name, Name)> = messages.into_iter().collect();
        while let Some(key) = open.pop() {
            if self.all.contains_key(&key) {
                continue;
            }
            if let Some(message) = self.message(&key) {
                let types = message.fields.iter().filter_map(|field| field_type(&key.0, field));
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
        let mut texts: BTreeMap<String, String> = BTreeMap::new();
        let mut uses_time = false;
        for (key @ (of, name), message) in &self.all {
            let text = self.header(key, message);
            uses_time |= text.contains(TIME_HEADER);
            texts.insert(format!("messages/include/{of}/{name}.h"), text);
            texts.insert(format!("messages/{of}/{of}Config.cmake"), config(of));
        }
        if uses_time {
            texts.insert(format!("messages/include/{TIME_HEADER}"), format!("{}{TIME}", heading("//")));
        }
        texts.into_iter().map(|(path, text)| GeneratedFile::generated(path, text)).collect()
    }

    /// Returns the header of a message.
    fn header(&self, (of, name): &(Name, Name), message: &Message) -> String {
        let mut headers: BTreeSet<String> = BTreeSet::new();
        let mut body: Vec<String> = message.constants.iter().filter_map(|it| constant(it, name)).collect();
        if !body.is_empty() {
            body.push(String::new());
        }
        for field in &message.fields {
            let found = field_type(of, field);
            // A message that is not installed.
            let found = found.filter(|it| it.message.as_ref().is_none_or(|it| self.all.contains_key(it)));
            let Some(found) = found else {
                body.push(format!("// {} is missing: its type is unknown.", comment(&field.to_string())));
                continue;
            };
            headers.extend(found.headers);
            body.push(format!("{} {}{};", found.cpp, field_name(&field.name, name), found.initial));
        }
        let mut out = heading("//");
        out += &format!(
            "//\n// The message {of}/{name}, with the fields of the header of ROS 1.\n\n#pragma once\n"
        );
        let (own, standard): (Vec<&String>, Vec<&String>) =
            headers.iter().partition(|path| path.contains('/'));
        for block in [standard, own].into_iter().filter(|block| !block.is_empty()) {
            out.push('\n');
            block.iter().for_each(|path| out += &format!("#include <{path}>\n"));
        }
        out += &format!("\nnamespace {of} {{\n\nstruct {name} {{\n");
        let lines =
            body.iter().map(|line| if line.is_empty() { "\n".to_owned() } else { format!("  {line}\n") });
        out.extend(lines);
        out + &format!("}};\n\n}}  // namespace {of}\n")
    }

    /// Returns the part of the build file that chooses between the headers of ROS and these.
    pub(super) fn cmake(&self) -> String {
        let mut headers: BTreeMap<&Name, String> = BTreeMap::new();
        for (of, name) in self.all.keys() {
            headers.entry(of).or_insert_with(|| format!("{of}/{name}.h"));
        }
        if headers.is_empty() {
            return String::new();
        }
        let headers: Vec<String> = headers.into_values().collect();
        CMAKE.replace("{headers}", &headers.join(" "))
    }
}

const CMAKE: &str = r#"
# The messages: the headers of ROS 1, if those of all packages are installed; otherwise all from the folder `messages`.
set(message_headers {headers})
set(own_messages "${CMAKE_CURRENT_SOURCE_DIR}/messages")
set(has_ros ON)
foreach(header ${message_headers})
  get_filename_component(package ${header} DIRECTORY)
  if("${${package}_DIR}" STREQUAL "${own_messages}/${package}")
    unset(${package}_DIR CACHE)
  endif()
  find_package(${package} CONFIG QUIET)
  set(has_header OFF)
  foreach(folder ${${package}_INCLUDE_DIRS})
    if(EXISTS "${folder}/${header}")
      set(has_header ON)
    endif()
  endforeach()
  if(NOT has_header)
    set(has_ros OFF)
  endif()
endforeach()
if(has_ros)
  message(STATUS "Messages: the headers of ROS")
else()
  message(STATUS "Messages: the structs in ${own_messages}")
  foreach(header ${message_headers})
    get_filename_component(package ${header} DIRECTORY)
    set(${package}_DIR "${own_messages}/${package}")
  endforeach()
endif()
"#;

const TIME_HEADER: &str = "ros/time.h";

const TIME: &str = "//
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
";

fn heading(mark: &str) -> String {
    format!("{mark} {STANDALONE_MARK}: do not change this file.\n")
}

fn config(package: &str) -> String {
    format!(
        "{}\nset({package}_INCLUDE_DIRS \"${{CMAKE_CURRENT_LIST_DIR}}/../include\")\nset({package}_LIBRARIES)\n\
         set({package}_EXPORTED_TARGETS)\n",
        heading("#")
    )
}

/// Returns the type of a field of a message in `package`; `None` if it has no form of ROS.
fn field_type(package: &Name, field: &MessageField) -> Option<FieldType> {
    let element = field.element();
    let (cpp, header) = match element {
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
        initial: if header == "cstdint" || matches!(element, "float32" | "float64") { " = 0" } else { "" },
    };
    if cpp.is_empty() {
        let (of, name) = element.split_once('/').unwrap_or((package, element));
        found.cpp = format!("::{of}::{name}");
        found.headers.push(format!("{of}/{name}.h"));
        found.message = Some((of.into(), name.into()));
    }
    if !field.is_array() {
        return Some(found);
    }
    let size = field.ty.strip_suffix(']')?.rsplit_once('[')?.1;
    if size.is_empty() || size.starts_with("<=") {
        found.cpp = format!("std::vector<{}>", found.cpp);
        found.headers.push("vector".to_owned());
        found.initial = "";
    } else {
        let size: u32 = size.parse().ok()?;
        found.cpp = format!("std::array<{}, {size}>", found.cpp);
        found.headers.push("array".to_owned());
        found.initial = "{}";
    }
    Some(found)
}

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
