//! Projects on the disk and in commits, and what the command line and the language server both say and write of them.
//!
//! `load.rs` reads models from the disk, `revision.rs` and `git.rs` from a commit; `generate.rs` writes what is generated;
//! `analysis_document.rs`, `graph_document.rs` and `verdict.rs` are the results as JSON. Projects may be a stranger's: `disk.rs` says
//! what of the disk is read, `folder.rs` goes from folder to folder without following links, `destination.rs` says where an output may
//! go, `harmless.rs` makes visible what a terminal would obey, `address.rs` says which addresses are files.
//!
//! This crate must never know commands, or messages of the language server.

pub mod address;
pub mod analysis_document;
pub mod cache;
pub mod destination;
pub mod disk;
pub mod folder;
pub mod generate;
pub mod git;
mod git_folder;
pub mod graph_document;
pub mod harmless;
pub mod holder;
pub mod json;
pub mod load;
pub mod memory;
pub mod output;
pub mod replace;
pub mod revision;
pub mod signals;
pub mod verdict;
