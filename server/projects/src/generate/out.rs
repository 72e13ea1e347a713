//! The folder that packages go to, and the files in it.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use mauve_hir::{CONFIG_FILE, Database, Workspace, config_of, normalised};

use crate::destination::{behind_links, destination_folder, leads_nowhere, not_read};
use crate::disk::{LONGEST, bytes_of, is_hidden};
use crate::folder::{Folder, FolderEntryKind, Folders};

/// The folder that packages go to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Out {
    /// The path that is shown to the user.
    pub shown: PathBuf,
    /// The path with links resolved, which was checked and is opened.
    pub real: PathBuf,
}

impl Out {
    /// Returns the folder that the user has named, which may be anywhere; a link of a project does not lead there.
    pub fn named(path: &Path) -> Result<Out, String> {
        Ok(Out { shown: path.to_owned(), real: destination_folder(path)? })
    }
}

/// Returns the folder that `[generate] out` names, if it is set.
pub fn configured_out(db: &Database, workspace: Workspace) -> Result<Option<Out>, String> {
    let Some((out, _)) = &config_of(db, workspace).out else { return Ok(None) };
    let folder = workspace.folder(db);
    let shown = normalised(&folder.join(out));
    let outside = || {
        format!(
            "`[generate] out` of {} is {out:?}, which is outside its folder: a configuration file may not \
             choose where else files are written; to write there, use `--out {}`",
            folder.join(CONFIG_FILE).display(),
            shown.display(),
        )
    };
    if out.is_empty() || !shown.starts_with(folder) {
        return Err(outside());
    }
    let [home, real] = [behind_links(folder)?, behind_links(&shown)?];
    if !real.starts_with(&home) {
        return Err(outside());
    }
    refuse_hidden(folder, out, [(folder, &shown), (&home, &real)])?;
    Ok(Some(Out { shown, real }))
}

/// Refuses `[generate] out` if one of `ways`, each from a folder to a folder below it, leads through a hidden folder:
/// tools execute files in hidden folders, such as `.git/hooks` and `.github`.
pub fn refuse_hidden(folder: &Path, out: &str, ways: [(&Path, &Path); 2]) -> Result<(), String> {
    let is_hidden_way = |(from, to): (&Path, &Path)| to.strip_prefix(from).is_ok_and(is_hidden);
    if !ways.into_iter().any(is_hidden_way) {
        return Ok(());
    }
    Err(format!(
        "`[generate] out` of {} is {out:?}, which is in a hidden folder: name another folder, or use `--out`",
        folder.join(CONFIG_FILE).display()
    ))
}

/// Returns the text of a file below a folder, if it exists. Bytes that are not UTF-8 are replaced: the generator
/// writes only UTF-8, and only searches the user's files for definitions.
pub fn read(out: &Out, path: &str) -> Result<Option<String>, String> {
    let shown = out.shown.join(path);
    let Some(file) = open(out, path)? else { return Ok(None) };
    let bytes = bytes_of(file, LONGEST).map_err(|error| not_read(&shown, &error))?;
    Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
}

/// Opens a file below a folder, if it exists; follows links that stay in the folder.
fn open(out: &Out, path: &str) -> Result<Option<File>, String> {
    let Out { mut shown, real: mut at } = out.clone();
    let mut folders = match Folder::open(&at) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        root => Folders::below(root.map_err(|error| not_read(&shown, &error))?),
    };
    let mut parts = path.split('/').peekable();
    while let Some(part) = parts.next() {
        if !is_name(part) {
            return Err(no_path(path));
        }
        at.push(part);
        shown.push(part);
        let mut kind = match folders.kind(&at) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            kind => kind.map_err(|error| not_read(&shown, &error))?,
        };
        if kind == FolderEntryKind::Link {
            at = inside(out, &at, &shown)?;
            kind = folders.kind(&at).map_err(|error| not_read(&shown, &error))?;
        }
        match (parts.peek(), kind) {
            (None, FolderEntryKind::File) | (Some(_), FolderEntryKind::Folder) => {}
            (None, FolderEntryKind::Folder) => return Err(not_a_file(&shown)),
            (None, _) => return Err(not_generated(&shown)),
            (Some(_), _) => return Err(not_a_folder(&shown)),
        }
    }
    match folders.above(&at).and_then(|(folder, name)| folder.open_read(name)) {
        // The file was removed in the meantime.
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        file => file.map(Some).map_err(|error| not_read(&shown, &error)),
    }
}

fn inside(out: &Out, link: &Path, shown: &Path) -> Result<PathBuf, String> {
    let real = link.canonicalize().map_err(|error| match error.kind() {
        ErrorKind::NotFound => leads_nowhere(shown),
        _ => not_read(shown, &error),
    })?;
    if !real.starts_with(&out.real) {
        return Err(format!(
            "`{}` is a link that leads out of `{}`, and is not read: replace it by a file",
            shown.display(),
            out.shown.display()
        ));
    }
    Ok(real)
}

/// Returns whether a text is a plain path component on every system.
pub(super) fn is_name(part: &str) -> bool {
    !matches!(part, "" | "." | "..") && !part.contains(['\\', ':'])
}

pub(super) fn no_path(path: &str) -> String {
    format!("{path:?} is not a path of a generated file")
}

fn not_generated(path: &Path) -> String {
    format!("`{}` is neither a regular file nor a folder, so it was not generated", path.display())
}

pub(super) fn not_a_folder(path: &Path) -> String {
    format!("`{}` is not a folder, and a folder is needed there: move the file", path.display())
}

pub(super) fn not_a_file(path: &Path) -> String {
    format!("`{}` is a folder, and a file is needed there: move the folder", path.display())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;
    use crate::generate::left_packages;

    fn scratch(name: &str) -> PathBuf {
        mauve_tests::own_scratch(&format!("generate-{name}"))
    }

    #[test]
    fn a_path_is_found_behind_links_and_beyond_what_is_there() {
        let top = scratch("behind");
        fs::create_dir_all(top.join("real/deep")).unwrap();
        fs::write(top.join("file"), "").unwrap();
        symlink("real/deep", top.join("link")).unwrap();
        symlink("nowhere", top.join("dangling")).unwrap();
        for (path, found) in [
            ("real", "real"),
            ("link", "real/deep"),
            ("link/..", "real"),
            ("link/new/one", "real/deep/new/one"),
            ("link/new/../other", "real/deep/other"),
            ("new/../link/x", "real/deep/x"),
            ("new/one/../../../no-such-folder/x", "../no-such-folder/x"),
            ("./link/./new/.", "real/deep/new"),
        ] {
            assert_eq!(behind_links(&top.join(path)), Ok(normalised(&top.join(found))), "{path}");
        }
        for (path, message) in
            [("dangling", "leads nowhere"), ("dangling/new", "leads nowhere"), ("file/new", "cannot be read")]
        {
            assert!(behind_links(&top.join(path)).unwrap_err().contains(message), "{path}");
        }
        assert!(behind_links(Path::new("")).is_err());
        let here = std::env::current_dir().unwrap().canonicalize().unwrap();
        assert_eq!(behind_links(Path::new("no-such-folder/new")), Ok(here.join("no-such-folder/new")));
        fs::remove_dir_all(&top).unwrap();
    }

    #[test]
    fn hidden_folders_are_refused() {
        let refused = |out: &str, real: &str| {
            let [home, behind] = [Path::new("/.home/robot"), Path::new("/.real/robot")];
            refuse_hidden(home, out, [(home, &normalised(&home.join(out))), (behind, Path::new(real))])
        };
        for (out, real) in
            [("out", "/.real/robot/out"), (".", "/.real/robot"), ("a/.b/../c", "/.real/robot/a/c")]
        {
            assert_eq!(refused(out, real), Ok(()), "{out}");
        }
        for (out, real) in [
            (".git/hooks", "/.real/robot/.git/hooks"),
            ("a/.github", "/.real/robot/a/.github"),
            ("link", "/.real/robot/.git"),
            (".link", "/.real/robot/out"),
        ] {
            let why = refused(out, real).unwrap_err();
            assert_eq!(
                why,
                format!(
                    "`[generate] out` of /.home/robot/mauve.toml is {out:?}, which is in a hidden folder: \
                     name another folder, or use `--out`"
                )
            );
        }
    }

    #[test]
    fn what_is_read_is_a_file_in_the_folder() {
        let top = scratch("read");
        fs::create_dir_all(top.join("out/p/deep")).unwrap();
        fs::create_dir_all(top.join("elsewhere")).unwrap();
        fs::write(top.join("elsewhere/secret"), "secret").unwrap();
        fs::write(top.join("out/p/deep/file"), "text \u{e9}").unwrap();
        fs::write(top.join("out/p/bytes"), b"\xff").unwrap();
        File::create(top.join("out/p/longest")).unwrap().set_len(LONGEST).unwrap();
        File::create(top.join("out/p/longer")).unwrap().set_len(LONGEST + 1).unwrap();
        symlink("deep", top.join("out/p/folder")).unwrap();
        symlink("../p/folder/file", top.join("out/p/link")).unwrap();
        symlink("../../elsewhere/secret", top.join("out/p/outside")).unwrap();
        symlink("/dev/zero", top.join("out/p/device")).unwrap();
        symlink(top.join("elsewhere"), top.join("out/q")).unwrap();
        symlink("nowhere", top.join("out/p/dangling")).unwrap();
        assert!(Command::new("mkfifo").arg(top.join("out/p/pipe")).status().unwrap().success());
        symlink("out", top.join("named")).unwrap();
        let out = Out::named(&top.join("named")).unwrap();
        assert_eq!(out.real, top.join("out"));
        for (path, text) in [
            ("p/deep/file", Some("text \u{e9}")),
            ("p/folder/file", Some("text \u{e9}")),
            ("p/link", Some("text \u{e9}")),
            ("p/bytes", Some("\u{fffd}")),
            ("p/nothing", None),
            ("nothing/deep/file", None),
        ] {
            assert_eq!(read(&out, path), Ok(text.map(str::to_owned)), "{path}");
        }
        assert_eq!(read(&out, "p/longest").unwrap().map(|text| text.len() as u64), Some(LONGEST));
        for (path, message) in [
            ("p/outside", "outside` is a link that leads out of"),
            ("p/device", "is a link that leads out of"),
            ("q/secret", "q` is a link that leads out of"),
            ("p/dangling", "is a link that leads nowhere"),
            ("p/longer", "this file is longer than"),
            ("p/pipe", "is neither a regular file nor a folder"),
            ("p/deep", "is a folder"),
            ("p/bytes/file", "bytes` is not a folder"),
            ("../elsewhere/secret", "is not a path of a generated file"),
            ("p//bytes", "is not a path of a generated file"),
        ] {
            let why = read(&out, path).unwrap_err();
            assert!(why.contains(message), "{why}");
        }
        // It becomes a link after it was looked at.
        fs::rename(top.join("out"), top.join("real")).unwrap();
        symlink("real", top.join("out")).unwrap();
        let why = read(&out, "p/deep/file").unwrap_err();
        assert!(why.contains("is not a folder, or has become a link"), "{why}");
        assert_eq!(left_packages(&out, &[]), Vec::<String>::new());
        let missing = Out { shown: top.join("missing"), real: top.join("missing") };
        assert_eq!(read(&missing, "p/file"), Ok(None));
        fs::remove_dir_all(&top).unwrap();
    }
}
