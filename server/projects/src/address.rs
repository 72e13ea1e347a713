//! The addresses of the protocol, and which of them are files on the disk. Everything that has or writes an address asks here: a
//! library's own way takes the path of an address of any scheme, and writes signs that no address may have.
//!
//! ```text
//! file:///robot/base.mal               a file; also FILE:///…, file://localhost/… and file:///robot/%62ase.mal
//! untitled:Untitled-1                  a new text, analysed by itself
//! git:/robot/base.mal?{"ref":"HEAD"}   a text beside the files: an earlier one, that of another computer, an editor's own
//! file:///robot/base.mal?ref=HEAD      the same
//! _diff_right:/robot/base.mal          no address: what is said of it is ignored
//! ```

use std::path::{Path, PathBuf};

use url::Url;

/// Where a text belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Home {
    /// To a file, which may not exist yet.
    File,
    /// To nothing else: it is analysed by itself.
    Itself,
    /// To a program that shows it. It is not analysed: what it includes is not there, or is not of its time.
    Elsewhere,
}

/// Behind the address of a text without a file, in its unique name. No file on the disk has such a name.
const NO_FILE: &str = "\0.";

/// Returns the path of the file or folder that an address names; none for a text beside the files.
#[expect(clippy::disallowed_methods, reason = "this is the one place")]
pub fn file_of(address: &Url) -> Option<PathBuf> {
    let is_plain = address.query().is_none() && address.fragment().is_none();
    address.to_file_path().ok().filter(|_| address.scheme() == "file" && is_plain)
}

/// Returns the same for an address as it is written.
pub fn file_at(address: &str) -> Option<PathBuf> {
    file_of(&Url::parse(address).ok()?)
}

/// Returns the address of a file or a folder; `None` if its path is relative.
///
/// `Url` leaves signs such as `[` and `^` as they are, which RFC 3986 allows in no path. Clients that compare texts, and readers of
/// SARIF, expect `%5B` and `%5E`.
#[expect(clippy::disallowed_methods, reason = "this is the one place")]
pub fn address_of(path: &Path) -> Option<Url> {
    let url = Url::from_file_path(path).ok()?;
    let is_allowed = |sign: char| sign.is_ascii_alphanumeric() || "-._~!$&'()*+,;=:@/%".contains(sign);
    let encoded = |sign: char| match is_allowed(sign) {
        true => sign.to_string(),
        false => format!("%{:02X}", u32::from(sign)),
    };
    let path: String = url.path().chars().map(encoded).collect();
    Url::parse(&format!("file://{path}")).ok()
}

/// Returns the path of a document, or a unique name if it is no file. Such a text is a model unless its name says otherwise.
pub fn path_of(address: &Url) -> (PathBuf, Home) {
    if let Some(path) = file_of(address) {
        return (path, Home::File);
    }
    let home = if address.scheme() == "untitled" { Home::Itself } else { Home::Elsewhere };
    let kind = if address.path().ends_with(".toml") { "toml" } else { "mal" };
    (PathBuf::from(format!("{address}{NO_FILE}{kind}")), home)
}

/// Returns the address of a document that is no file, from its unique name.
pub fn address_of_document(name: &Path) -> Option<Url> {
    Url::parse(name.to_str()?.rsplit_once(NO_FILE)?.0).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_plain_address_of_this_computer_is_a_file() {
        for file in ["file:///r/a b.mal", "file:/r/a%20b.mal", "FILE://LOCALHOST/r/x/../a%20b.mal"] {
            assert_eq!(file_at(file), Some(PathBuf::from("/r/a b.mal")), "{file}");
        }
        assert_eq!(file_at("file:///c%3A/r.mal"), file_at("file:///c:/r.mal"));
        for other in [
            "file://server/r/a.mal",
            "file:///r/a.mal?ref=HEAD",
            "file:///r/a.mal?",
            "file:///r/a.mal#L1",
            "git:/r/a.mal",
            "http://localhost/r/a.mal",
            "vscode-remote://wsl%2Bubuntu/r/a.mal",
            "untitled:/r/a.mal",
            "c:\\r\\a.mal",
            "/r/a.mal",
            "_diff_right:/r/a.mal",
            "",
        ] {
            assert_eq!(file_at(other), None, "{other}");
        }
    }

    #[test]
    fn a_text_beside_the_files_has_a_name_that_no_file_has() {
        for (address, home, kind) in [
            ("untitled:Untitled-1", Home::Itself, "mal"),
            ("untitled:Untitled-1.mal", Home::Itself, "mal"),
            ("git:/r/a.mal?%7B%22ref%22:%22~%22%7D", Home::Elsewhere, "mal"),
            ("git:/r/mauve.toml?ref=HEAD", Home::Elsewhere, "toml"),
            ("file:///r/a.mal#L1", Home::Elsewhere, "mal"),
            ("memfs:/", Home::Elsewhere, "mal"),
        ] {
            let address = Url::parse(address).unwrap();
            let (path, found) = path_of(&address);
            assert_eq!((found, path.extension().unwrap().to_str()), (home, Some(kind)), "{address}");
            assert_eq!(std::fs::write(&path, "").unwrap_err().kind(), std::io::ErrorKind::InvalidInput);
            assert!(!path.ends_with("mauve.toml"));
            assert_eq!(address_of_document(&path), Some(address));
        }
        assert_eq!(address_of_document(Path::new("/r/a.mal")), None);
    }

    #[test]
    fn an_address_has_the_signs_of_rfc_3986_and_leads_back() {
        let printed: String = (' '..='~').filter(|sign| *sign != '/').collect();
        for name in ["[a] ^b|c.mal", "a\\b`{}<>\"#?%41.mal", "größe 🦀.mal", printed.as_str(), "\u{1}\t.mal"]
        {
            let path = Path::new("/robot").join(name);
            let address = address_of(&path).unwrap();
            let is_allowed =
                |sign: char| sign.is_ascii_alphanumeric() || "-._~!$&'()*+,;=:@/%".contains(sign);
            assert!(address.path().chars().all(is_allowed), "{address}");
            assert_eq!(file_of(&address).unwrap(), path, "{address}");
        }
        assert_eq!(address_of(Path::new("/a[1]^|.mal")).unwrap().as_str(), "file:///a%5B1%5D%5E%7C.mal");
        assert_eq!(address_of(Path::new("a.mal")), None);
    }
}
