//! mauve-syntax
