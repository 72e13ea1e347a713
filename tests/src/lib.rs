//! mauve-tests
