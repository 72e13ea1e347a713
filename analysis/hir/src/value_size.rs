//! The size of the values of a type: what a read or a write of a port copies.

use crate::item_tree::Name;
use crate::messages::package;
use crate::project::Project;
use crate::types::{Integer, Type};
use crate::{ModelDb, Workspace};

/// A text counts as so many bytes: most are names of coordinate frames.
const TEXT: u64 = 64;

/// Messages nested deeper than this count as of variable size: they may contain themselves.
const DEEPEST: u32 = 16;

/// Returns the number of bytes of a value of a type; `None` if that varies.
///
/// An external type counts as a pointer or a number: what it refers to is not copied.
pub fn value_size(db: &dyn ModelDb, project: Project<'_>, ty: &Type) -> Option<u64> {
    match ty {
        Type::Bool => Some(1),
        Type::Integer(integer) => Some(match integer {
            Integer::Char | Integer::Int8 | Integer::Uint8 => 1,
            Integer::Short | Integer::Uint16 => 2,
            Integer::Int | Integer::Uint32 => 4,
            Integer::Long | Integer::Int64 | Integer::Uint64 | Integer::Size => 8,
        }),
        Type::Float | Type::PortStatus | Type::CallStatus => Some(4),
        Type::Double | Type::External(_) | Type::Handle(_) => Some(8),
        Type::Void => Some(0),
        Type::Message(package, message) => message_size(db, project.workspace(db), package, message, DEEPEST),
        Type::String => Some(TEXT),
        // That is reported.
        Type::Unknown => Some(0),
    }
}

fn message_size(db: &dyn ModelDb, workspace: Workspace, of: &Name, name: &Name, left: u32) -> Option<u64> {
    let left = left.checked_sub(1)?;
    let message = package(db, workspace, of)?.messages.get(name)?;
    message.fields.iter().try_fold(0u64, |sum, field| {
        let element = match field.element() {
            "bool" | "byte" | "char" | "int8" | "uint8" => 1,
            "int16" | "uint16" => 2,
            "int32" | "uint32" | "float32" => 4,
            "int64" | "uint64" | "float64" | "time" | "duration" => 8,
            "string" | "wstring" => TEXT,
            "Header" => message_size(db, workspace, &"std_msgs".into(), &"Header".into(), left)?,
            nested => {
                let (package, name) = nested.split_once('/').unwrap_or((of, nested));
                message_size(db, workspace, &package.into(), &name.into(), left)?
            }
        };
        let count = match field.ty.split_once('[').and_then(|(_, rest)| rest.strip_suffix(']')) {
            None => 1,
            // `[]` and `[<=4]` vary.
            Some(count) => count.parse().ok()?,
        };
        sum.checked_add(element.checked_mul(count)?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Database;

    #[test]
    fn sizes_of_messages() {
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), [("/robot.mal".into(), String::new())]);
        let size = |package: &str, message: &str| {
            message_size(&db, workspace, &package.into(), &message.into(), DEEPEST)
        };
        assert_eq!(size("geometry_msgs", "Pose"), Some(7 * 8));
        assert_eq!(size("geometry_msgs", "AccelWithCovariance"), Some(6 * 8 + 36 * 8));
        assert_eq!(size("sensor_msgs", "Image"), None);
        // A sequence number, a time and a text.
        assert_eq!(size("std_msgs", "Header"), Some(4 + 8 + 64));
        assert_eq!(size("std_msgs", "Nothing"), None);
    }
}
