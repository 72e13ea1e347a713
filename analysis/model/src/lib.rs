//! mauve-model
