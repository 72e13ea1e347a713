//! The inputs of codels, as values in TOML: checked against the types of parameters, and as C++ that assigns or records them.
//!
//! ```text
//! ["motion.steer"]
//! gap = [0.5, 1.0]                                  in_0[0] = 0.5; in_0[1] = 1.0;
//! command = [{ linear = { x = 0.1, … }, … }]        in_1[0].linear.x = 0.1;
//! ```
//!
//! Nothing is assumed for a value that is missing: a codel may take a short way where all inputs are 0.

use mauve_hir::item_tree::{Direction, Name};
use mauve_hir::{Decl, Integer, MessageField, ModelDb, Type, Workspace, codel, package};
use toml::Value;

use crate::cpp_name::field_name;
use crate::escape::cpp_string;
use crate::library::Model;

/// Messages that contain messages, at most.
const DEEPEST: usize = 16;

/// What values of a type consist of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// `true` or `false`.
    Bool,
    /// An integer.
    Integer(Integer),
    /// A number; whether it is one of 32 bits.
    Float(bool),
    /// A text.
    Text,
    /// A list of values; how many, if that is known.
    List(Box<Shape>, Option<usize>),
    /// A message: its fields, each with its name in C++.
    Fields(Vec<(String, String, Shape)>),
}

/// Why a codel cannot run alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InputProblem {
    /// The package of this codel is not one of the deployment.
    NotThere,
    /// The values of a parameter exist only in the robot: the parameter and its type.
    Opaque(String, String),
    /// There is no value: where, such as `command[3].linear.x`, and what to write.
    Missing(String, String),
    /// There is no such parameter that takes a value, or no such field.
    Unknown(String),
    /// Two parameters have different numbers of values.
    Rows(String, String),
    /// There are too many values for a program: the number of rows.
    TooMany(usize),
    /// A value is wrong: where, and what it should be.
    Wrong(String, Shape),
}

/// Returns the shape of each parameter of a codel with its name, in their order; none for those without an input.
pub(super) fn inputs_of(
    model: Model<'_, '_>,
    of: Decl<'_>,
) -> Result<Vec<Option<(String, Shape)>>, InputProblem> {
    let parameters = codel(model.db, of).map(|it| it.parameters.as_slice()).unwrap_or_default();
    let input = |it: &mauve_hir::item_tree::Parameter| {
        if it.direction == Direction::Out {
            return Ok(None);
        }
        let name = it.name.name.to_string();
        match Shape::of(model.db, model.workspace(), &model.type_of(of, it.ty.as_ref())) {
            Some(shape) => Ok(Some((name, shape))),
            None => {
                Err(InputProblem::Opaque(name, it.ty.as_ref().map(ToString::to_string).unwrap_or_default()))
            }
        }
    };
    parameters.iter().map(input).collect()
}

impl Shape {
    /// Returns the shape of a type; `None` if its values exist only in a program: external types, handles and statuses.
    fn of(db: &dyn ModelDb, workspace: Workspace, ty: &Type) -> Option<Shape> {
        match ty {
            Type::Bool => Some(Shape::Bool),
            Type::Integer(integer) => Some(Shape::Integer(*integer)),
            Type::Float => Some(Shape::Float(true)),
            Type::Double => Some(Shape::Float(false)),
            Type::String => Some(Shape::Text),
            Type::Message(of, name) => message(db, workspace, of, name, DEEPEST),
            _ => None,
        }
    }

    /// Appends the statements that assign a value, which is at `place`, to `target`.
    pub(super) fn assign(
        &self,
        target: &str,
        value: &Value,
        place: &str,
        out: &mut Vec<String>,
    ) -> Result<(), InputProblem> {
        let wrong = || InputProblem::Wrong(place.to_owned(), self.clone());
        match self {
            Shape::List(element, size) => {
                let values = value.as_array().filter(|it| size.is_none_or(|size| it.len() == size));
                let values = values.ok_or_else(wrong)?;
                let at = |index: usize| format!("{place}[{index}]");
                if matches!(**element, Shape::List(..) | Shape::Fields(_)) {
                    if size.is_none() {
                        out.push(format!("{target}.resize({});", values.len()));
                    }
                    let mut all = values.iter().enumerate();
                    return all.try_for_each(|(index, value)| {
                        element.assign(&format!("{target}[{index}]"), value, &at(index), out)
                    });
                }
                let literal = |(index, value)| {
                    element.literal(value).ok_or_else(|| InputProblem::Wrong(at(index), (**element).clone()))
                };
                let all = values.iter().enumerate().map(literal).collect::<Result<Vec<String>, _>>()?;
                // An array is a class with one member.
                let [open, close] = if size.is_some() { ["{{", "}}"] } else { ["{", "}"] };
                out.push(format!("{target} = {open}{}{close};", all.join(", ")));
            }
            Shape::Fields(fields) => {
                let table = value.as_table().ok_or_else(wrong)?;
                if let Some(other) = table.keys().find(|key| fields.iter().all(|(name, ..)| name != *key)) {
                    return Err(InputProblem::Unknown(format!("{place}.{other}")));
                }
                for (name, cpp, shape) in fields {
                    let place = format!("{place}.{name}");
                    let missing = || InputProblem::Missing(place.clone(), shape.example());
                    let value = table.get(name).ok_or_else(missing)?;
                    shape.assign(&format!("{target}.{cpp}"), value, &place, out)?;
                }
            }
            _ => out.push(format!("{target} = {};", self.literal(value).ok_or_else(wrong)?)),
        }
        Ok(())
    }

    fn literal(&self, value: &Value) -> Option<String> {
        match self {
            Shape::Bool => value.as_bool().map(|it| it.to_string()),
            Shape::Integer(integer) => {
                let (low, high) = integer.ends();
                let value = value.as_integer().filter(|it| (low..=high).contains(&i128::from(*it)))?;
                // The digits of the least one alone are too large for a signed integer.
                Some(match value {
                    i64::MIN => format!("{} - 1", i64::MIN + 1),
                    value => value.to_string(),
                })
            }
            Shape::Float(is_single) => {
                let value = value.as_float().or_else(|| value.as_integer().map(|it| it as f64))?;
                let ty = if *is_single { "float" } else { "double" };
                let is_small = !is_single || !value.is_finite() || (value as f32).is_finite();
                let limits = format!("std::numeric_limits<{ty}>");
                let literal = match value {
                    _ if value.is_nan() => format!("{limits}::quiet_NaN()"),
                    f64::INFINITY => format!("{limits}::infinity()"),
                    f64::NEG_INFINITY => format!("-{limits}::infinity()"),
                    _ => format!("static_cast<{ty}>({value:?})"),
                };
                is_small.then_some(literal)
            }
            Shape::Text => value.as_str().map(|it| format!("std::string({}, {})", cpp_string(it), it.len())),
            Shape::List(..) | Shape::Fields(_) => None,
        }
    }

    /// Returns a value of this shape in TOML, for a user to change.
    pub(super) fn example(&self) -> String {
        match self {
            Shape::Bool => "false".to_owned(),
            Shape::Integer(_) => "0".to_owned(),
            Shape::Float(_) => "0.0".to_owned(),
            Shape::Text => "\"\"".to_owned(),
            // A long one is for the user to write.
            Shape::List(element, size) => {
                format!("[{}]", vec![element.example(); size.map_or(1, |size| size.min(100))].join(", "))
            }
            Shape::Fields(fields) => {
                let fields = fields.iter().map(|(name, _, shape)| format!("{name} = {}", shape.example()));
                format!("{{ {} }}", fields.collect::<Vec<_>>().join(", "))
            }
        }
    }

    /// Returns the C++ statements that record the value of an expression: see `mauve/inputs.hpp`.
    pub(super) fn record(&self, expression: &str, depth: usize) -> String {
        match self {
            Shape::Bool => format!("mauve_row.boolean({expression} != 0);"),
            Shape::Integer(_) => format!("mauve_row.integer({expression});"),
            Shape::Float(_) => format!("mauve_row.number({expression});"),
            Shape::Text => format!("mauve_row.text({expression});"),
            Shape::List(element, _) => {
                let body = element.record(&format!("it{depth}"), depth + 1);
                format!(
                    "mauve_row.begin('['); for (const auto& it{depth} : {expression}) {{ mauve_row.next(\"\"); {body} }} mauve_row.end(']');"
                )
            }
            Shape::Fields(fields) => {
                let field = |(name, cpp, shape): &(String, String, Shape)| {
                    let value = shape.record(&format!("{expression}.{cpp}"), depth);
                    format!("mauve_row.next({}); {value} ", cpp_string(&format!("{name} = ")))
                };
                let fields: String = fields.iter().map(field).collect();
                format!("mauve_row.begin('{{'); {fields}mauve_row.end('}}');")
            }
        }
    }
}

/// Returns the shape of a message; `None` if one of its fields has none.
fn message(db: &dyn ModelDb, workspace: Workspace, of: &Name, name: &Name, depth: usize) -> Option<Shape> {
    let found = package(db, workspace, of)?.messages.get(name)?;
    let field = |field: &MessageField| {
        let shape = field_shape(db, workspace, of, field, depth.checked_sub(1)?)?;
        Some((field.name.to_string(), field_name(&field.name, name), shape))
    };
    Some(Shape::Fields(found.fields.iter().map(field).collect::<Option<_>>()?))
}

fn field_shape(
    db: &dyn ModelDb,
    workspace: Workspace,
    of: &Name,
    field: &MessageField,
    depth: usize,
) -> Option<Shape> {
    let instant = |integer| {
        let part = |name: &str| (name.to_owned(), name.to_owned(), Shape::Integer(integer));
        Shape::Fields(vec![part("sec"), part("nsec")])
    };
    let element = match field.element() {
        "bool" => Shape::Bool,
        "byte" | "int8" => Shape::Integer(Integer::Int8),
        "char" | "uint8" => Shape::Integer(Integer::Uint8),
        "int16" => Shape::Integer(Integer::Short),
        "uint16" => Shape::Integer(Integer::Uint16),
        "int32" => Shape::Integer(Integer::Int),
        "uint32" => Shape::Integer(Integer::Uint32),
        "int64" => Shape::Integer(Integer::Int64),
        "uint64" => Shape::Integer(Integer::Uint64),
        "float32" => Shape::Float(true),
        "float64" => Shape::Float(false),
        "string" => Shape::Text,
        "wstring" => return None,
        "time" => instant(Integer::Uint32),
        "duration" => instant(Integer::Int),
        other => match other.split_once('/') {
            Some((of, name)) => message(db, workspace, &of.into(), &name.into(), depth)?,
            None => message(db, workspace, of, &other.into(), depth)?,
        },
    };
    if !field.is_array() {
        return Some(element);
    }
    let size = field.ty.strip_suffix(']')?.rsplit_once('[')?.1;
    let is_any = size.is_empty() || size.starts_with("<=");
    Some(Shape::List(Box::new(element), if is_any { None } else { Some(size.parse().ok()?) }))
}
