//! JSON documents for programs.

use serde::Serialize;

/// Makes a JSON object with these keys in this order. A key in brackets has an `Option`, and is left out for `None`.
///
/// ```text
/// object! { name: "loop", [errors]: Some(2) }
/// ```
#[macro_export]
macro_rules! object {
    ($($($key:ident)? $([$optional:ident])? : $value:expr),* $(,)?) => {{
        #[allow(non_camel_case_types, non_snake_case, reason = "each key names a field and its type")]
        let object = {
            #[derive(serde::Serialize)]
            struct Object<$($($key)? $($optional)?),*> {
                $(
                    $($key: $key)?
                    $(#[serde(skip_serializing_if = "Option::is_none")] $optional: Option<$optional>)?
                ),*
            }
            Object { $($($key)? $($optional)?: $value),* }
        };
        object
    }};
}

pub use crate::object;

/// Returns a document as text with a final line break.
pub fn text(document: &impl Serialize) -> Result<String, String> {
    let text = serde_json::to_string_pretty(document).map_err(|error| error.to_string())?;
    Ok(text + "\n")
}

/// Returns the only document as text, or the list of all.
pub fn one_or_all(documents: impl Iterator<Item = impl Serialize>) -> Result<String, String> {
    match documents.collect::<Vec<_>>().as_slice() {
        [one] => text(one),
        all => text(&all),
    }
}

/// Collects the values of a key that is left out if there are none.
pub fn non_empty<T>(values: impl IntoIterator<Item = T>) -> Option<Vec<T>> {
    let values: Vec<T> = values.into_iter().collect();
    (!values.is_empty()).then_some(values)
}
