//! Types and signatures in messages.

use std::borrow::Cow;

use mauve_hir::item_tree::{Direction, FeatureKind};
use mauve_hir::{Signature, Type};

/// Returns a type for messages: its name in models, or a description.
pub fn type_name(ty: &Type) -> Cow<'_, str> {
    let words = match ty {
        Type::Void => "nothing",
        Type::PortStatus => "the status of a port",
        Type::CallStatus => "the status of a call",
        Type::Handle(operation) => return Cow::Owned(format!("a call of `{operation}`")),
        ty => return ty.written().unwrap_or(Cow::Borrowed("an unknown type")),
    };
    Cow::Borrowed(words)
}

/// Returns what a value is, as a sentence.
pub(super) fn found(ty: &Type) -> String {
    match ty {
        Type::Void => "this gives nothing".to_owned(),
        ty => format!("this is {}", type_name(ty)),
    }
}

/// Returns what a feature is, with its article.
pub(super) fn feature_kind(kind: FeatureKind) -> &'static str {
    match kind {
        FeatureKind::Input => "an input port",
        FeatureKind::Output => "an output port",
        FeatureKind::Required => "a required operation",
        FeatureKind::Provided => "a provided operation",
        FeatureKind::Constant => "a constant",
        FeatureKind::Property => "a property",
    }
}

/// Returns the signature of the operation `name` for messages: `f(a: int, out b: bool): void`.
pub(super) fn signature(name: &str, signature: &Signature) -> String {
    let word = |direction| match direction {
        Direction::In => "",
        Direction::Out => "out ",
        Direction::InOut => "inout ",
    };
    let parameters = signature.parameters.iter();
    let parameters: Vec<String> = parameters
        .map(|(direction, name, ty)| format!("{}{name}: {}", word(*direction), type_name(ty)))
        .collect();
    let result = match &signature.result {
        Type::Void => Cow::Borrowed("void"),
        result => type_name(result),
    };
    format!("{name}({}): {result}", parameters.join(", "))
}
