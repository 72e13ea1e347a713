//! C++ types and the headers that declare them.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Direction, Name};
use mauve_hir::{Integer, ModelDb, Type, Workspace, external_types};

use crate::template::lines;

/// Returns a type in C++, valid in any namespace; `None` if its C++ type is unknown: see [`crate::problems`].
pub(crate) fn cpp_type(db: &dyn ModelDb, workspace: Workspace, ty: &Type) -> Option<String> {
    Some(match ty {
        Type::Bool => "bool".to_owned(),
        Type::Integer(integer) => integer_type(*integer).to_owned(),
        Type::Float => "float".to_owned(),
        Type::Double => "double".to_owned(),
        Type::String => "std::string".to_owned(),
        Type::Void => "void".to_owned(),
        Type::PortStatus => "RTT::FlowStatus".to_owned(),
        Type::CallStatus => "RTT::SendStatus".to_owned(),
        Type::Message(package, name) => format!("::{package}::{name}"),
        Type::External(name) => {
            let external = external_types(db, workspace).get(name)?;
            Some(external.cpp.clone()).filter(|cpp| !cpp.is_empty())?
        }
        Type::Handle(_) | Type::Unknown => return None,
    })
}

pub(crate) fn integer_type(integer: Integer) -> &'static str {
    match integer {
        Integer::Int => "int",
        Integer::Char => "char",
        Integer::Short => "short",
        Integer::Long => "long",
        Integer::Int8 => "std::int8_t",
        Integer::Int64 => "std::int64_t",
        Integer::Uint8 => "std::uint8_t",
        Integer::Uint16 => "std::uint16_t",
        Integer::Uint32 => "std::uint32_t",
        Integer::Uint64 => "std::uint64_t",
        Integer::Size => "std::size_t",
    }
}

/// Returns whether copies of such a value may be expensive.
pub(crate) fn is_large(ty: &Type) -> bool {
    matches!(ty, Type::String | Type::Message(..) | Type::External(_))
}

/// The type of a parameter: `in` by value, or as a constant reference where it is large; `out` and `inout` as a reference.
pub(crate) fn parameter_type(cpp: &str, ty: &Type, direction: Direction) -> String {
    match direction {
        Direction::In if is_large(ty) && !cpp.ends_with('*') => format!("const {cpp}&"),
        _ => operation_parameter_type(cpp, direction),
    }
}

/// The type of a parameter of an operation. RTT does not copy arguments that are passed by reference: they would have
/// to live until the other component executes the call. So `in` is passed by value.
pub(crate) fn operation_parameter_type(cpp: &str, direction: Direction) -> String {
    match direction {
        Direction::In => cpp.to_owned(),
        Direction::Out | Direction::InOut => format!("{cpp}&"),
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Headers {
    /// The paths as in `#include <…>`.
    pub(crate) paths: BTreeSet<String>,
    /// The message packages that they come from.
    pub(crate) packages: BTreeSet<Name>,
    /// The messages that they declare: package and name.
    pub(crate) messages: BTreeSet<(Name, Name)>,
}

impl Headers {
    pub(crate) fn add(&mut self, db: &dyn ModelDb, workspace: Workspace, ty: &Type) {
        let path = match ty {
            Type::Integer(Integer::Size) => "cstddef".to_owned(),
            Type::Integer(_) => "cstdint".to_owned(),
            Type::String => "string".to_owned(),
            Type::PortStatus => "rtt/FlowStatus.hpp".to_owned(),
            Type::CallStatus => "rtt/SendStatus.hpp".to_owned(),
            Type::Message(package, name) => {
                self.packages.insert(package.clone());
                self.messages.insert((package.clone(), name.clone()));
                format!("{package}/{name}.h")
            }
            Type::External(name) => {
                let external = external_types(db, workspace).get(name);
                return self.paths.extend(external.and_then(|it| it.header.clone()));
            }
            Type::Bool | Type::Float | Type::Double | Type::Void | Type::Handle(_) | Type::Unknown => return,
        };
        self.paths.insert(path);
    }
}

/// Returns the lines that include headers: those of the standard library, which have neither a folder nor an extension, and
/// the others.
pub(crate) fn included(paths: &BTreeSet<String>) -> [String; 2] {
    let (own, standard): (Vec<&String>, Vec<&String>) =
        paths.iter().partition(|path| path.contains(['/', '.']));
    [standard, own].map(|paths| lines(paths.iter().map(|path| format!("#include <{path}>"))))
}
