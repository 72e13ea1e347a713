//! Outputs that replace an earlier output only, and no other file of the user.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Returns an error if there is a file that does not begin as an output of the command does, upper and lower case alike. An empty
/// file may be replaced; pipes and devices are written as they are.
pub(super) fn check_own(path: &Path, begin: &str, kind: &str, option: &str) -> Result<(), String> {
    let is_own = || -> std::io::Result<bool> {
        let data = path.metadata()?;
        if !data.is_file() {
            return Ok(!data.is_dir());
        }
        let mut found = Vec::new();
        File::open(path)?.take(begin.len() as u64).read_to_end(&mut found)?;
        Ok(found.is_empty() || found.eq_ignore_ascii_case(begin.as_bytes()))
    };
    match path.exists() && !is_own().unwrap_or(false) {
        true => Err(format!(
            "`{}` is not a {kind}, and is not overwritten: choose another path for {option}",
            path.display()
        )),
        false => Ok(()),
    }
}
