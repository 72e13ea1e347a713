//! What `tests/generated.rs` makes from `mauve.ungram`.

pub(crate) mod kinds;
pub(crate) mod nodes;
