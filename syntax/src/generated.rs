//! What `tests/generated.rs` makes from `mauve.ungram`.

pub mod keywords;
pub(crate) mod kinds;
pub(crate) mod nodes;
