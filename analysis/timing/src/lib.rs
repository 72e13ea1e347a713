//! mauve-timing
