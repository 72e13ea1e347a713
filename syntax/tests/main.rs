//! The tests of parser, formatter and grammar: one program, a module for each subject.
//!
//! | module | what it tests |
//! |---|---|
//! | [`format`] | formatting changes white space and nothing else |
//! | [`generated`] | `src/generated/` and the highlighters agree with `mauve.ungram` |
//! | [`golden`] | the trees of the models above the rules of the grammar |
//! | [`reparse`] | a reparse equals a full parse |
//! | [`robust`] | no text loses a byte or makes the parser panic |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod format;
mod generated;
mod golden;
mod reparse;
mod robust;
