//! The pages of the diagnostics as files, so that an editor can open the page of a code.

use std::fs::File;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use mauve_diagnostics::{codes, page};
use mauve_projects::address::address_of;
use mauve_projects::cache::cache_folder;
use tower_lsp::lsp_types::Url;

/// Returns the address of the page of a diagnostic; none if there is no folder for the pages.
pub(crate) fn address(code: &str) -> Option<Url> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    let folder =
        FOLDER.get_or_init(|| written().inspect_err(|error| tracing::info!("no pages: {error}")).ok());
    address_of(&folder.as_ref()?.join(format!("{code}.md")))
}

/// Writes the pages of this version to the user's cache. Other servers of this version write the same pages.
fn written() -> io::Result<PathBuf> {
    let cache = cache_folder().ok_or_else(|| io::Error::other("neither XDG_CACHE_HOME nor HOME is set"))?;
    let folder = cache.join(format!("pages-{}", env!("CARGO_PKG_VERSION")));
    std::fs::create_dir_all(&folder)?;
    for code in codes() {
        let (path, page) = (folder.join(format!("{}.md", code.name)), page(code.name).unwrap_or_default());
        write(&path, &page)?;
    }
    Ok(folder)
}

/// Writes a page if its text differs; replaces a link instead of following it.
fn write(path: &Path, page: &str) -> io::Result<()> {
    if !path.is_symlink() && std::fs::read_to_string(path).is_ok_and(|there| there == page) {
        return Ok(());
    }
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    match File::create_new(path).and_then(|mut file| file.write_all(page.as_bytes())) {
        // Another server wrote it first.
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        written => written,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn a_page_takes_the_place_of_another_and_of_a_link() {
        let folder = mauve_tests::own_scratch("pages");
        let (page, other) = (folder.join("page.md"), folder.join("other"));
        for text in ["new", "newer", "newer"] {
            write(&page, text).unwrap();
            assert_eq!(fs::read_to_string(&page).unwrap(), text);
        }
        for text in ["mine", "newer"] {
            fs::write(&other, text).unwrap();
            fs::remove_file(&page).unwrap();
            symlink(&other, &page).unwrap();
            write(&page, "newer").unwrap();
            assert!(!page.is_symlink() && fs::read_to_string(&page).unwrap() == "newer");
            assert_eq!(fs::read_to_string(&other).unwrap(), text);
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
