//! The pages of the diagnostics as files, so that an editor can open the one behind a code.

use std::path::PathBuf;
use std::sync::OnceLock;

use mauve_model::diagnostics::{codes, page};
use tower_lsp::lsp_types::Url;

/// The address of the page of a diagnostic; nothing where there is no place for such files.
pub(crate) fn address(code: &str) -> Option<Url> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    let folder =
        FOLDER.get_or_init(|| written().inspect_err(|error| tracing::info!("no pages: {error}")).ok());
    Url::from_file_path(folder.as_ref()?.join(format!("{code}.md"))).ok()
}

/// Writes the pages of this version to the user's cache. Another server may do the same: they are the same.
fn written() -> std::io::Result<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = variable("XDG_CACHE_HOME").or_else(|| variable("LOCALAPPDATA"));
    let cache = cache.or_else(|| variable("HOME").map(|home| home.join(".cache")));
    let cache = cache.ok_or_else(|| std::io::Error::other("neither XDG_CACHE_HOME nor HOME is set"))?;
    let folder = cache.join("mauve").join(format!("pages-{}", env!("CARGO_PKG_VERSION")));
    std::fs::create_dir_all(&folder)?;
    for code in codes() {
        let (path, page) = (folder.join(format!("{}.md", code.name)), page(code.name).unwrap_or_default());
        if std::fs::read_to_string(&path).is_ok_and(|there| there == page) {
            continue;
        }
        std::fs::write(path, page)?;
    }
    Ok(folder)
}
