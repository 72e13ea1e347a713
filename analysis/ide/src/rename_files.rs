//! What is written about files that get other names: `include` lines, and the roots and tables of `mauve.toml`.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use mauve_model::{
    CONFIG_FILE, File, ModelDb, Workspace, config_file, config_of, include_candidates, includes, is_model,
    normalised, source_map,
};
use mauve_syntax::TextRange;
use mauve_syntax::format::Replacement;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::change::Change;

/// What must be changed before these files, or folders, get other names: each an old path and a new one, absolute.
///
/// A pattern of `[timing] tables` that names a moved table by `*` is left as it is: whether it should follow, only its
/// author knows.
///
/// ```
/// use mauve_model::{Database, Workspace};
/// let db = Database::default();
/// let files = [("/a.mal", "include \"b.mal\""), ("/b.mal", "codel f(): int")];
/// let files = files.map(|(path, text)| (path.into(), text.to_owned()));
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let change = mauve_ide::rename_files(&db, &[workspace], &[("/b.mal".into(), "/parts/c.mal".into())]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// assert_eq!(change.applied(&db, file), "include \"parts/c.mal\"");
/// ```
pub fn rename_files(db: &dyn ModelDb, workspaces: &[Workspace], moves: &[(PathBuf, PathBuf)]) -> Change {
    let moves = moves.iter().map(|(old, new)| (old.as_path(), new.as_path())).collect();
    let moving = Moving { db, moves };
    let mut change = Change::default();
    for &workspace in workspaces {
        // The paths that lead to files afterwards.
        let known: FxHashSet<PathBuf> = workspace.files(db).keys().map(|path| moving.moved(path)).collect();
        for (&file, path) in moving.files(workspace) {
            db.unwind_if_revision_cancelled();
            if is_model(path) {
                moving.model(workspace, file, &known, &mut change);
            }
        }
        moving.config(workspace, &mut change);
    }
    for of_file in &mut change.files {
        let is_config = of_file.file.path(db).ends_with(CONFIG_FILE);
        let place = if is_config { CONFIG_FILE } else { "includes" };
        of_file.note = Some(format!("Follow the renamed files in {place}"));
    }
    change
}

struct Moving<'a> {
    db: &'a dyn ModelDb,
    /// By the old path; the last, where there are several.
    moves: FxHashMap<&'a Path, &'a Path>,
}

impl Moving<'_> {
    /// Each file once, in the order of the paths.
    fn files(&self, workspace: Workspace) -> impl Iterator<Item = (&File, &PathBuf)> {
        let files: &Arc<_> = workspace.files(self.db);
        files.iter().filter(|(path, file)| *path == file.path(self.db)).map(|(path, file)| (file, path))
    }

    /// Where a path leads to afterwards: what moves the nearest of its folders moves it, where nothing moves itself.
    fn moved(&self, path: &Path) -> PathBuf {
        for old in path.ancestors() {
            if let (Some(new), Ok(rest)) = (self.moves.get(old), path.strip_prefix(old)) {
                return if rest.as_os_str().is_empty() { new.to_path_buf() } else { new.join(rest) };
            }
        }
        path.to_owned()
    }

    /// `after`: the paths that lead to files afterwards.
    fn model(&self, workspace: Workspace, file: File, after: &FxHashSet<PathBuf>, change: &mut Change) {
        let db = self.db;
        let tree = mauve_model::parse(db, file).file();
        let written = tree.items().filter_map(|item| match item {
            mauve_syntax::ast::Item::Include(include) => Some(include.path()),
            _ => None,
        });
        let old_place = file.path(db);
        let new_place = self.moved(old_place);
        let found = includes(db, workspace, file).iter().zip(&source_map(db, file).includes).zip(written);
        for ((target, &range), path) in found {
            let (Some(target), Some(path)) = (target, path) else { continue };
            let known = workspace.files(db);
            let candidates = include_candidates(db, workspace, file, &path);
            // By which of its paths, and in which folder it was found.
            let Some(found) = candidates.iter().position(|path| known.contains_key(path)) else { continue };
            let Some(old_target) = candidates.get(found) else { continue };
            let new_target =
                self.moved(if known.get(old_target) == Some(target) { old_target } else { target.path(db) });
            let folder = |place: &Path| place.parent().unwrap_or(Path::new("/")).to_owned();
            let mut folders = vec![folder(&new_place)];
            folders.extend(workspace.model_path(db).iter().cloned());
            // It may lead there as it is.
            let leads_to = |path: &str| {
                let mut all = folders.iter().map(|folder| normalised(&folder.join(path)));
                all.find(|path| *path == new_target || after.contains(path))
            };
            if leads_to(&path).as_ref() == Some(&new_target) {
                continue;
            }
            let in_folder = (found > 0).then(|| folders.get(found)).flatten();
            let below = in_folder.and_then(|folder| new_target.strip_prefix(folder).ok());
            let below = below.map(slashed).filter(|path| leads_to(path).as_ref() == Some(&new_target));
            let new = below.unwrap_or_else(|| relative(&folder(&new_place), &new_target));
            let text = format!("\"{}\"", new.replace('\\', "\\\\").replace('"', "\\\""));
            change.replace(file, Replacement { range, text });
        }
    }

    fn config(&self, workspace: Workspace, change: &mut Change) {
        let db = self.db;
        let Some(file) = config_file(db, workspace) else { return };
        let folder = workspace.folder(db);
        // Where all of it moves, its paths stay.
        let new_folder = self.moved(folder);
        let config = config_of(db, workspace);
        let is_pattern = |path: &str| path.contains(['*', '?', '[', '{']);
        let tables = config.tables.iter().filter(|(path, _)| !is_pattern(path));
        for (path, span) in config.roots.iter().chain(tables) {
            let old = normalised(&folder.join(path));
            let new = self.moved(&old);
            let is_there = workspace.files(db).contains_key(&old);
            if !is_there || new == normalised(&new_folder.join(path)) {
                continue;
            }
            let path = relative(&new_folder, &new);
            let text = format!("\"{}\"", path.replace('\\', "\\\\").replace('"', "\\\""));
            let range = TextRange::new((span.start as u32).into(), (span.end.max(span.start) as u32).into());
            change.replace(file, Replacement { range, text });
        }
    }
}

/// How a path is written from a folder.
fn relative(folder: &Path, path: &Path) -> String {
    let common = folder.components().zip(path.components()).take_while(|(one, other)| one == other).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    slashed(&up.chain(path.components().skip(common)).collect::<PathBuf>())
}

fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};
    use mauve_model::{Database, project_files, projects};

    const ROBOT: &str = r#"
//- /w/robot.mal
include "parts/laser.mal"  include /* 🦀 */ "parts/map.mal"
//- /w/parts/laser.mal
include "common.mal"
//- /w/parts/map.mal
include "./common.mal"
include "../shared/msgs.mal"
//- /w/parts/common.mal
codel f(): int
//- /w/shared/msgs.mal
codel g(): int
//- /w/mauve.toml
project.roots = ["robot.mal", 'parts/laser.mal']
timing.tables = ["timing/t.toml", "timing/*.toml"]
//- /w/timing/t.toml
codel.f = 1
"#;

    fn workspace(fixture: &str) -> (Database, Workspace) {
        let db = Database::default();
        let files = mauve_tests::fixture(fixture).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/w".into(), files);
        (db, workspace)
    }

    /// The lines that change; and every project has the files that it had.
    fn check(moves: &[(&str, &str)], expected: Expect) {
        let (db, before) = workspace(ROBOT);
        let moves: Vec<(PathBuf, PathBuf)> =
            moves.iter().map(|(old, new)| (old.into(), new.into())).collect();
        let change = rename_files(&db, &[before], &moves);
        let mut shown = String::new();
        for of_file in &change.files {
            let (old, new) = (of_file.file.text(&db), change.applied(&db, of_file.file));
            for (_, line) in old.lines().zip(new.lines()).filter(|(old, new)| old != new) {
                shown += &format!("{}: {line}\n", of_file.file.path(&db).display());
            }
        }
        expected.assert_eq(&shown);
        let moves = moves.iter().map(|(old, new)| (old.as_path(), new.as_path())).collect();
        let moving = Moving { db: &db, moves };
        let new_db = Database::default();
        let files =
            before.files(&db).iter().map(|(path, &file)| (moving.moved(path), change.applied(&db, file)));
        let after = Workspace::of_texts(&new_db, moving.moved(Path::new("/w")), files.collect::<Vec<_>>());
        let old: Vec<Vec<PathBuf>> = projects(&db, before)
            .iter()
            .map(|&it| project_files(&db, it).iter().map(|file| moving.moved(file.path(&db))).collect())
            .collect();
        let new: Vec<Vec<PathBuf>> = projects(&new_db, after)
            .iter()
            .map(|&it| project_files(&new_db, it).iter().map(|file| file.path(&new_db).clone()).collect())
            .collect();
        assert_eq!(old, new);
    }

    #[test]
    fn files_and_folders() {
        check(
            &[("/w/parts/common.mal", "/w/parts/base.mal")],
            expect![[r#"
            /w/parts/laser.mal: include "base.mal"
            /w/parts/map.mal: include "base.mal"
        "#]],
        );
        check(
            &[("/w/parts/map.mal", "/w/map.mal")],
            expect![[r#"
            /w/parts/map.mal: include "parts/common.mal"
            /w/parts/map.mal: include "shared/msgs.mal"
            /w/robot.mal: include "parts/laser.mal"  include /* 🦀 */ "map.mal"
        "#]],
        );
        check(
            &[("/w/parts", "/w/components")],
            expect![[r#"
            /w/robot.mal: include "components/laser.mal"  include /* 🦀 */ "components/map.mal"
            /w/mauve.toml: project.roots = ["robot.mal", "components/laser.mal"]
        "#]],
        );
        check(
            &[("/w/shared", "/w/parts/shared")],
            expect![[r#"
            /w/parts/map.mal: include "shared/msgs.mal"
        "#]],
        );
        check(
            &[("/w/robot.mal", "/w/apps/robot.mal")],
            expect![[r#"
            /w/robot.mal: include "../parts/laser.mal"  include /* 🦀 */ "../parts/map.mal"
            /w/mauve.toml: project.roots = ["apps/robot.mal", 'parts/laser.mal']
        "#]],
        );
        check(
            &[("/w/timing/t.toml", "/w/timing/u.toml")],
            expect![[r#"
            /w/mauve.toml: timing.tables = ["timing/u.toml", "timing/*.toml"]
        "#]],
        );
        check(
            &[("/w/parts/laser.mal", "/w/parts/map2.mal"), ("/w/parts/common.mal", "/w/a \" é.mal")],
            expect![[r#"
                /w/parts/laser.mal: include "../a \" é.mal"
                /w/parts/map.mal: include "../a \" é.mal"
                /w/robot.mal: include "parts/map2.mal"  include /* 🦀 */ "parts/map.mal"
                /w/mauve.toml: project.roots = ["robot.mal", "parts/map2.mal"]
            "#]],
        );
        // All of it moves, and so does what it says.
        check(&[("/w", "/v")], expect![[r#""#]]);
        // Two files change places.
        check(
            &[("/w/parts/laser.mal", "/w/parts/map.mal"), ("/w/parts/map.mal", "/w/parts/laser.mal")],
            expect![[r#"
                /w/robot.mal: include "parts/map.mal"  include /* 🦀 */ "parts/laser.mal"
                /w/mauve.toml: project.roots = ["robot.mal", "parts/map.mal"]
            "#]],
        );
    }

    #[test]
    fn along_the_model_path() {
        let Fixture { db, workspace, .. } = Fixture::new(
            "//- /w/a.mal\n$0include \"lib/b.mal\" include \"c.mal\"\n//- /models/lib/b.mal\n\n//- /w/c.mal\n",
        );
        let workspace = Workspace::new(
            &db,
            "/w".into(),
            workspace.files(&db).clone(),
            vec!["/models".into()],
            Vec::new(),
            Vec::new(),
            Arc::default(),
        );
        let file = workspace.file(&db, Path::new("/w/a.mal")).unwrap();
        let renamed = |old: &str, new: &str| {
            rename_files(&db, &[workspace], &[(old.into(), new.into())]).applied(&db, file)
        };
        assert_eq!(renamed("/models/lib/b.mal", "/models/b2.mal"), "include \"b2.mal\" include \"c.mal\"\n");
        assert_eq!(renamed("/models/lib", "/w/lib"), "include \"lib/b.mal\" include \"c.mal\"\n");
        assert_eq!(renamed("/w/a.mal", "/w/x/a.mal"), "include \"lib/b.mal\" include \"../c.mal\"\n");
        // What lies beside the file comes first.
        assert_eq!(
            renamed("/models/lib/b.mal", "/models/c.mal"),
            "include \"../models/c.mal\" include \"c.mal\"\n"
        );
    }
}
