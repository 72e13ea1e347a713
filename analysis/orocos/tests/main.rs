//! The tests of generated packages: one program, a module for each subject.
//!
//! | module | what it tests |
//! |---|---|
//! | [`build`] | the build files of packages |
//! | [`component`] | the classes of components |
//! | [`deployments`] | the scripts of random deployments, executed by Lua |
//! | [`fuzz`] | the properties of folders of packages, on some hundred texts |
//! | [`growth`] | the size of generated files |
//! | [`spec`] | the reference of generated code in `tests/spec` |
//! | [`tracing`] | traced code, recorded by LTTng |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod build;
mod component;
mod deployments;
mod fuzz;
mod growth;
mod spec;
mod tracing;
