//! The hash of a message type, by which programs of ROS 2 know that they mean the same type: `RIHS01_` and the SHA-256 of a
//! description in JSON, as REP 2016 has it.
//!
//! ```text
//! {"type_description": {"type_name": "std_msgs/msg/String", "fields": [{"name": "data", "type": {"type_id": 17, …}}]},
//!  "referenced_type_descriptions": []}
//! ```

use std::collections::BTreeMap;

use mauve_hir::item_tree::Name;
use mauve_hir::{FieldParts, Message, MessageField, MessageSize, ModelDb, Workspace, package};
use sha2::{Digest as _, Sha256};

/// Returns the hash of a message; `None` if a type in it is unknown, or has no description.
pub(crate) fn type_hash(db: &dyn ModelDb, workspace: Workspace, of: &Name, name: &Name) -> Option<String> {
    let find = |of: &str, name: &str| package(db, workspace, &of.into())?.messages.get(name);
    let mut described: BTreeMap<String, String> = BTreeMap::new();
    let own = type_name(of, name);
    let mut open = vec![(of.to_string(), name.to_string())];
    while let Some((of, name)) = open.pop() {
        let full = type_name(&of, &name);
        if !described.contains_key(&full) {
            described.insert(full.clone(), description(&full, &of, find(&of, &name)?, &mut open)?);
        }
    }
    let root = described.remove(&own)?;
    let others: Vec<String> = described.into_values().collect();
    let text =
        format!(r#"{{"type_description": {root}, "referenced_type_descriptions": [{}]}}"#, others.join(", "));
    Some(format!("RIHS01_{}", hash(&text)))
}

fn type_name(of: &str, name: &str) -> String {
    format!("{of}/msg/{name}")
}

/// Returns the description of a message of package `of`. Adds the messages in it.
fn description(full: &str, of: &str, message: &Message, open: &mut Vec<(String, String)>) -> Option<String> {
    let fields: Option<Vec<String>> = message.fields.iter().map(|it| field(of, it, open)).collect();
    let mut fields = fields?;
    if fields.is_empty() {
        fields.push(field_text("structure_needs_at_least_one_member", 3, [0, 0], ""));
    }
    Some(format!(r#"{{"type_name": "{full}", "fields": [{}]}}"#, fields.join(", ")))
}

fn field(of: &str, field: &MessageField, open: &mut Vec<(String, String)>) -> Option<String> {
    let FieldParts { element, text_bound, size } = field.parts()?;
    let mut nested = String::new();
    let id = match element {
        "int8" => 2,
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "bool" => 15,
        "byte" => 16,
        "string" if text_bound > 0 => 21,
        "string" => 17,
        "wstring" if text_bound > 0 => 22,
        "wstring" => 18,
        _ => {
            let (of, name) = element.split_once('/').unwrap_or((of, element));
            nested = type_name(of, name);
            open.push((of.to_owned(), name.to_owned()));
            1
        }
    };
    // Arrays, bounded and unbounded sequences.
    let (offset, capacity) = match size {
        MessageSize::One => (0, 0),
        MessageSize::Array(size) => (48, size),
        MessageSize::Sequence(0) => (144, 0),
        MessageSize::Sequence(bound) => (96, bound),
    };
    Some(field_text(&field.name, id + offset, [capacity, text_bound], &nested))
}

fn field_text(name: &str, id: u32, [capacity, string_capacity]: [u64; 2], nested: &str) -> String {
    format!(
        "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {id}, \"capacity\": {capacity}, \"string_capacity\": \
         {string_capacity}, \"nested_type_name\": \"{nested}\"}}}}"
    )
}

/// Returns the hash of a text, independent of its line ends.
pub(crate) fn hash(text: &str) -> String {
    let digest = Sha256::digest(text.replace("\r\n", "\n").as_bytes());
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace};

    use super::*;

    #[test]
    fn a_hash_is_that_of_sha256sum_and_knows_no_line_ends() {
        assert_eq!(hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(hash("a\r\nb\r\n"), hash("a\nb\n"));
        assert_ne!(hash("a\rb"), hash("a\nb"));
    }

    /// As `ros2 topic info --verbose` of Jazzy shows them.
    #[test]
    fn hashes_are_those_of_ros_2() {
        let db = Database::default();
        let texts = [("/m.mal".into(), String::new()), ("/mauve.toml".into(), "[ros2]".to_owned())];
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let hash = |of: &str, name: &str| type_hash(&db, workspace, &of.into(), &name.into());
        let scan = "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828";
        assert_eq!(hash("sensor_msgs", "LaserScan").as_deref(), Some(scan));
        let twist = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a";
        assert_eq!(hash("geometry_msgs", "Twist").as_deref(), Some(twist));
        assert_eq!(hash("geometry_msgs", "Nothing"), None);
    }
}
