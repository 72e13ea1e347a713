//! Message packages and the format of `.msg` files.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use crate::item_tree::Name;

/// The built-in types of `.msg` files.
pub const BUILT_IN_TYPES: [&str; 17] = [
    "bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
    "float32", "float64", "string", "wstring", "time", "duration",
];

/// A message package, such as `geometry_msgs`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Package {
    /// Its name.
    pub name: Name,
    /// Its messages, by name.
    pub messages: BTreeMap<Name, Message>,
}

/// A message: the content of a `.msg` file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Message {
    /// The fields, in the order of the text.
    pub fields: Vec<MessageField>,
    /// The constants, in the order of the text.
    pub constants: Vec<MessageConstant>,
    /// The file; `None` for a built-in message.
    pub path: Option<PathBuf>,
}

/// `float64[36] covariance`, in ROS 2 also `int32 count 1`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageField {
    /// Its name.
    pub name: Name,
    /// Its type as written: `string<=10`, `uint8[]`, `Point[<=4]`, `geometry_msgs/Pose`. A type without a package is built in
    /// or of the same package; the `Header` of ROS 1 is `std_msgs/Header`.
    pub ty: Name,
    /// Its default value, as written.
    pub default: Option<Name>,
}

/// `uint8 DEBUG=1`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageConstant {
    /// Its name.
    pub name: Name,
    /// Its type, as written.
    pub ty: Name,
    /// Its value, as written.
    pub value: Name,
}

impl MessageField {
    /// Returns the type without array dimensions or bounds: `geometry_msgs/Point` for `geometry_msgs/Point[4]`.
    pub fn element(&self) -> &str {
        self.ty.split(['[', '<']).next().unwrap_or_default()
    }

    /// Returns whether it is an array.
    pub fn is_array(&self) -> bool {
        self.ty.ends_with(']')
    }

    /// Returns the parts of its type; `None` if a number in it is too large.
    ///
    /// ```
    /// use mauve_hir::{MessageSize, read_message};
    /// let names = read_message("string<=10[<=3] names");
    /// let parts = names.fields[0].parts().unwrap();
    /// assert_eq!((parts.element, parts.text_bound, parts.size), ("string", 10, MessageSize::Sequence(3)));
    /// ```
    pub fn parts(&self) -> Option<FieldParts<'_>> {
        let (element, size) = match self.ty.strip_suffix(']').and_then(|ty| ty.rsplit_once('[')) {
            None => (self.ty.as_str(), MessageSize::One),
            Some((element, "")) => (element, MessageSize::Sequence(0)),
            Some((element, size)) => match size.strip_prefix("<=") {
                Some(bound) => (element, MessageSize::Sequence(bound.parse().ok()?)),
                None => (element, MessageSize::Array(size.parse().ok()?)),
            },
        };
        let (element, text_bound) = match element.split_once("<=") {
            Some((element, bound)) => (element, bound.parse().ok()?),
            None => (element, 0),
        };
        Some(FieldParts { element, text_bound, size })
    }
}

/// The parts of a field's type, such as `string<=10[<=3]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldParts<'a> {
    /// The type of an element: `string`, `geometry_msgs/Pose`.
    pub element: &'a str,
    /// The most characters of a string; 0 if it has no bound.
    pub text_bound: u64,
    /// How many elements it has.
    pub size: MessageSize,
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MessageSize {
    /// One: it is no array.
    One,
    /// `[3]`
    Array(u64),
    /// `[<=3]`, or `[]`: at most so many; 0 if it has no bound.
    Sequence(u64),
}

impl fmt::Display for MessageField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.ty, self.name)?;
        self.default.as_ref().map_or(Ok(()), |default| write!(f, " {default}"))
    }
}

impl fmt::Display for MessageConstant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}={}", self.ty, self.name, self.value)
    }
}

/// Reads a `.msg` text; skips invalid lines.
///
/// ```
/// let pose = mauve_hir::read_message("Header header # when, and where\ngeometry_msgs/Pose[<=2] poses\nuint8 FULL=2");
/// assert_eq!(pose.fields[0].ty, "std_msgs/Header");
/// assert_eq!(pose.fields[1].to_string(), "geometry_msgs/Pose[<=2] poses");
/// assert_eq!(pose.constants[0].to_string(), "uint8 FULL=2");
/// ```
pub fn read_message(text: &str) -> Message {
    let mut message = Message::default();
    for line in text.trim_start_matches('\u{feff}').lines() {
        read_line(&mut message, line.trim());
    }
    message
}

/// Reads `type name`, `type name default` or `type name = value`; `None` for any other line.
fn read_line(message: &mut Message, line: &str) -> Option<()> {
    let (ty, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, rest) = rest.split_at_checked(end)?;
    if !is_type(ty) || !is_name(name) {
        return None;
    }
    let (name, is_string) = (Name::from(name), ty.starts_with("string") || ty.starts_with("wstring"));
    match rest.trim_start().strip_prefix('=') {
        Some(value) if !ty.ends_with(']') && !ty.contains('/') => {
            let value = value_of(value, is_string);
            let is_complete = is_string || !value.is_empty();
            is_complete
                .then(|| message.constants.push(MessageConstant { name, ty: ty.into(), value: value.into() }))
        }
        Some(_) => None,
        None if !rest.is_empty() && !rest.starts_with(char::is_whitespace) && !rest.starts_with('#') => None,
        None => {
            // A default string is quoted; a comment may follow.
            let value = value_of(rest, is_string && rest.trim_start().starts_with(['"', '\'']));
            let default = (!value.is_empty()).then(|| value.into());
            let ty = if ty == "Header" { "std_msgs/Header" } else { ty };
            message.fields.push(MessageField { name, ty: ty.into(), default });
            Some(())
        }
    }
}

/// Returns a value without the comment after it. A string extends to the end of the line in ROS 1, and is quoted in ROS 2.
fn value_of(text: &str, is_string: bool) -> &str {
    let text = text.trim();
    let Some(quote) = text.chars().next().filter(|_| is_string) else {
        return text.split('#').next().unwrap_or_default().trim_end();
    };
    if !matches!(quote, '"' | '\'') {
        return text;
    }
    let mut is_escaped = false;
    let end = text.char_indices().skip(1).find(|&(_, c)| {
        let is_end = c == quote && !is_escaped;
        is_escaped = c == '\\' && !is_escaped;
        is_end
    });
    end.and_then(|(index, _)| text.get(..=index)).unwrap_or(text)
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Returns whether the text is `T`, `package/T`, a bounded string, or an array of these.
fn is_type(text: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (element, is_array) = match text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        Some((element, size)) => {
            (element, size.is_empty() || is_number(size.strip_prefix("<=").unwrap_or(size)))
        }
        None => (text, true),
    };
    let is_element = match (element.split_once("<="), element.split_once('/')) {
        (Some((string, bound)), _) => matches!(string, "string" | "wstring") && is_number(bound),
        (None, Some((package, name))) => is_name(package) && is_name(name),
        (None, None) => is_name(element),
    };
    is_array && is_element
}
