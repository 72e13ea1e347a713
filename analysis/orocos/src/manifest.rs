//! `.mauve-manifest.json`: the files that the generator has written into a package, to detect later changes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::package::{is_codel_path, is_generated_path};

/// The name of the manifest in a package.
pub const MANIFEST: &str = ".mauve-manifest.json";

/// The format number, to be incremented when an older generator would misread a newer manifest.
const FORMAT: u32 = 1;

/// The files that the generator has written into a package; paths are relative to the package's folder.
///
/// ```json
/// {
///   "format": 1,
///   "files": { "package.xml": "9f86d081884c7d65…" },
///   "codels": { "src/codels/clearance.cpp": { "prototype": "double clearance(double width)" } }
/// }
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    format: u32,
    /// The hash of each generated file.
    pub(crate) files: BTreeMap<String, String>,
    pub(crate) codels: BTreeMap<String, CodelFile>,
}

/// The record of a file of the user.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CodelFile {
    /// The prototype that it was written for; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) prototype: Option<String>,
    /// Whether the user has removed the stub for that prototype, and so has confirmed the file.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) is_right: bool,
    /// The hash of the stub that the generator wrote there; `None` if the file was never a stub, or is one of an earlier version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) stub: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offered: Option<Offer>,
}

/// A stub next to a file of the user that was written for another prototype.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Offer {
    /// The prototype of the stub.
    pub(crate) prototype: String,
    pub(crate) hash: String,
}

/// Why a text is not a valid manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ManifestError {
    /// The text is not JSON, or has other fields: the message of the JSON parser.
    Json(String),
    /// The format number differs.
    Format {
        /// The number in the manifest.
        found: u32,
        /// The number that this generator writes.
        known: u32,
    },
    /// This path does not name a file in the package, or names the manifest.
    OutsidePackage(String),
    /// The path of a file that belongs to the user is listed as generated.
    UserFile(String),
    /// The generator does not write a file with this path.
    NotGenerated(String),
    /// This is not the path of a file of a codel.
    NotACodel(String),
}

impl From<serde_json::Error> for ManifestError {
    fn from(error: serde_json::Error) -> Self {
        ManifestError::Json(error.to_string())
    }
}

impl Default for Manifest {
    fn default() -> Manifest {
        Manifest { format: FORMAT, files: BTreeMap::new(), codels: BTreeMap::new() }
    }
}

impl Manifest {
    /// Reads the manifest of a package. It is untrusted, so its paths are checked to stay in the package.
    ///
    /// # Errors
    ///
    /// The text is not a valid manifest.
    pub(crate) fn read(package: &str, text: &str) -> Result<Manifest, ManifestError> {
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let version: Version = serde_json::from_str(text)?;
        if version.format != FORMAT {
            return Err(ManifestError::Format { found: version.format, known: FORMAT });
        }
        let manifest: Manifest = serde_json::from_str(text)?;
        if let Some(path) = manifest.files.keys().chain(manifest.codels.keys()).find(|path| !is_inside(path))
        {
            return Err(ManifestError::OutsidePackage(path.clone()));
        }
        // Listed files that are no longer generated are removed, so a manifest must not list files of the user or
        // unknown files.
        if let Some(path) = manifest.files.keys().find(|path| is_the_users(path)) {
            return Err(ManifestError::UserFile(path.clone()));
        }
        if let Some(path) = manifest.files.keys().find(|path| !is_generated_path(package, path)) {
            return Err(ManifestError::NotGenerated(path.clone()));
        }
        match manifest.codels.keys().find(|path| !is_codel_path(package, path)) {
            Some(path) => Err(ManifestError::NotACodel(path.clone())),
            None => Ok(manifest),
        }
    }

    pub(crate) fn text(&self) -> Result<String, ManifestError> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// Returns whether the generator writes a file at most once.
fn is_the_users(path: &str) -> bool {
    path == "user.cmake" || path.starts_with("src/codels/")
}

/// Returns whether a path names a file in its folder, other than the manifest.
fn is_inside(path: &str) -> bool {
    let is_name = |part: &str| !matches!(part, "" | "." | "..") && !part.contains(['\\', ':', '\0']);
    path != MANIFEST && path.split('/').all(is_name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::type_hash::hash;

    #[test]
    fn what_is_written_is_read() {
        let offered = Some(Offer { prototype: "int f()".to_owned(), hash: hash("") });
        let codel = CodelFile {
            prototype: Some("void f()".to_owned()),
            is_right: true,
            stub: Some(hash("s")),
            offered,
        };
        let manifest = Manifest {
            files: BTreeMap::from([("B/B-component.hpp".to_owned(), hash("b"))]),
            codels: BTreeMap::from([
                ("src/codels/f.cpp".to_owned(), codel),
                ("src/codels/g.cpp".to_owned(), CodelFile::default()),
            ]),
            ..Manifest::default()
        };
        assert_eq!(Manifest::read("p", &manifest.text().unwrap()), Ok(manifest));
    }

    #[test]
    fn what_is_no_manifest_says_why() {
        let why = |text: &str| Manifest::read("p", text).unwrap_err();
        let json = |message: &str| ManifestError::Json(message.to_owned());
        assert_eq!(why(""), json("EOF while parsing a value at line 1 column 0"));
        assert_eq!(why("<<<<<<< HEAD\n{"), json("expected value at line 1 column 1"));
        assert_eq!(
            why(r#"{"format":2,"files":{},"packages":{}}"#),
            ManifestError::Format { found: 2, known: 1 }
        );
        assert_eq!(
            why(r#"{"format":1,"files":{},"codels":{},"more":1}"#),
            json("unknown field `more`, expected one of `format`, `files`, `codels` at line 1 column 41")
        );
        for path in [
            "../a",
            "a/../../b",
            "/etc/passwd",
            "",
            "a//b",
            "./a",
            "a/.",
            "C:/a",
            "a\\..\\b",
            ".mauve-manifest.json",
        ] {
            let files = serde_json::json!({ "format": 1, "files": { path: "0" }, "codels": {} });
            assert_eq!(why(&files.to_string()), ManifestError::OutsidePackage(path.to_owned()));
            let codels = serde_json::json!({ "format": 1, "files": {}, "codels": { path: {} } });
            assert_eq!(why(&codels.to_string()), ManifestError::OutsidePackage(path.to_owned()));
        }
        for path in ["user.cmake", "src/codels/plan.cpp"] {
            let files = serde_json::json!({ "format": 1, "files": { path: hash("mine") }, "codels": {} });
            assert_eq!(why(&files.to_string()), ManifestError::UserFile(path.to_owned()));
        }
        // A forged one may know the hash of any file.
        for path in
            ["main.cpp", "src/main.cpp", ".bashrc", "User.cmake", "src/Codels/plan.cpp", "models/robot.mal"]
        {
            let files = serde_json::json!({ "format": 1, "files": { path: hash("mine") }, "codels": {} });
            assert_eq!(why(&files.to_string()), ManifestError::NotGenerated(path.to_owned()));
            let codels = serde_json::json!({ "format": 1, "files": {}, "codels": { path: {} } });
            assert_eq!(why(&codels.to_string()), ManifestError::NotACodel(path.to_owned()));
        }
    }
}
