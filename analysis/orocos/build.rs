//! Lists the files of the runtime, which `src/runtime.rs` embeds.

#![allow(clippy::print_stdout, reason = "cargo reads it")]

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=runtime");
    let folder = env::current_dir()?.join("runtime");
    let mut files = Vec::new();
    add_files(&folder, &mut files)?;
    files.sort();
    let row = |path: &PathBuf| {
        let name = path.strip_prefix(&folder).unwrap_or(path);
        format!("({name:?}, include_str!({path:?})),\n")
    };
    let rows: String = files.iter().map(row).collect();
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    fs::write(out.join("runtime.rs"), format!("&[\n{rows}]"))
}

/// Adds the files of a folder and of those in it.
fn add_files(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            add_files(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}
