//! Updates the paths of renamed files: `include` lines, and the roots, tables and generated packages of `mauve.toml`.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_hir::{
    CONFIG_FILE, File, ModelDb, Workspace, config_file, config_of, include_candidates, includes, is_model,
    normalised, relative_path, source_map,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_wcrt::{pattern_of_path, table_pattern};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::change::Change;
use crate::occurrences::range_of;

/// Returns the change for renamed files or folders, each an old path and a new path, absolute.
///
/// No table is dropped: a pattern of `[timing] tables` follows its folder; a table that no pattern matches any more is listed by
/// its path.
///
/// ```
/// use mauve_hir::{Database, Workspace};
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
        // The paths of files after the rename.
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
        of_file.note = Some(format!("Update the paths of renamed files in {place}"));
    }
    change
}

struct Moving<'a> {
    db: &'a dyn ModelDb,
    /// By the old path; the last of several wins.
    moves: FxHashMap<&'a Path, &'a Path>,
}

impl Moving<'_> {
    fn files(&self, workspace: Workspace) -> impl Iterator<Item = (&File, &PathBuf)> {
        let files: &Arc<_> = workspace.files(self.db);
        files.iter().filter(|(path, file)| *path == file.path(self.db)).map(|(path, file)| (file, path))
    }

    /// Returns the path of a file after the rename: the innermost renamed folder determines it, unless the file itself is renamed.
    fn moved(&self, path: &Path) -> PathBuf {
        for old in path.ancestors() {
            if let (Some(new), Ok(rest)) = (self.moves.get(old), path.strip_prefix(old)) {
                return if rest.as_os_str().is_empty() { new.to_path_buf() } else { new.join(rest) };
            }
        }
        path.to_owned()
    }

    /// `after`: the paths of files after the rename.
    fn model(&self, workspace: Workspace, file: File, after: &FxHashSet<PathBuf>, change: &mut Change) {
        let db = self.db;
        let written = mauve_hir::parse(db, file).syntax().children().filter_map(ast::Include::cast);
        let old_place = file.path(db);
        let new_place = self.moved(old_place);
        let found = includes(db, workspace, file)
            .iter()
            .zip(&source_map(db, file).includes)
            .zip(written.map(|it| it.path()));
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
            // The old path may still be valid.
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
            change.replace(file, Replacement { range, text: quoted(&new) });
        }
    }

    fn config(&self, workspace: Workspace, change: &mut Change) {
        let db = self.db;
        let Some(file) = config_file(db, workspace) else { return };
        let config = config_of(db, workspace);
        for (path, span) in config.roots.iter().chain(&config.out) {
            if let Some(path) = self.path_in_config(workspace, path) {
                change.replace(file, Replacement { range: range_of(span), text: quoted(&path) });
            }
        }
        let of_deployments = config.deployment_tables.iter().map(|it| &it.tables);
        for patterns in std::iter::once(&config.tables).chain(of_deployments) {
            self.tables(workspace, file, patterns, change);
        }
    }

    /// Returns the new text of a path in the configuration, or `None` if it can stay, for example if its folder moves with all
    /// files that it names.
    fn path_in_config(&self, workspace: Workspace, path: &str) -> Option<String> {
        let folder = workspace.folder(self.db);
        let new_folder = self.moved(folder);
        let new = self.moved(&normalised(&folder.join(path)));
        (new != normalised(&new_folder.join(path))).then(|| relative(&new_folder, &new))
    }

    /// `[timing] tables`, or those of a deployment: the same files are tables before and after.
    fn tables(
        &self,
        workspace: Workspace,
        config: File,
        written: &[(String, Range<usize>)],
        change: &mut Change,
    ) {
        let db = self.db;
        let folder = workspace.folder(db);
        let new_folder = self.moved(folder);
        let known = || workspace.files(db).iter().filter(|(_, file)| **file != config);
        let names = |folder: &Path, patterns: &[&str]| {
            let globs: Vec<_> = patterns.iter().filter_map(|it| table_pattern(folder, it).ok()).collect();
            move |path: &Path| globs.iter().any(|glob| glob.is_match(path))
        };
        let all: Vec<&str> = written.iter().map(|(pattern, _)| pattern.as_str()).collect();
        let is_table = names(folder, &all);
        let followed = |pattern: &str| {
            let (fixed, rest) = split(pattern);
            let path = pattern_of_path(&self.path_in_config(workspace, fixed)?);
            let new = if rest.is_empty() { path } else { format!("{path}/{rest}") };
            let (is_old, is_new) = (names(folder, &[pattern]), names(&new_folder, &[&new]));
            let is_right = |path: &Path| match is_new(&self.moved(path)) {
                true => is_table(path),
                false => !is_old(path),
            };
            known().all(|(path, _)| is_right(path)).then_some(new)
        };
        let new: Vec<String> =
            all.iter().map(|&pattern| followed(pattern).unwrap_or_else(|| pattern.to_owned())).collect();
        let is_named = names(&new_folder, &new.iter().map(String::as_str).collect::<Vec<_>>());
        // A file may have several paths.
        let kept: FxHashSet<File> =
            known().filter(|(path, _)| is_named(&self.moved(path))).map(|(_, file)| *file).collect();
        let mut added: FxHashSet<File> = FxHashSet::default();
        for ((pattern, span), new) in written.iter().zip(&new) {
            let is_old = names(folder, &[pattern]);
            let mut patterns = Vec::new();
            for (path, &file) in known().filter(|(path, _)| is_old(path)) {
                let path = self.moved(path);
                if !kept.contains(&file) && !is_model(&path) && added.insert(file) {
                    patterns.push(pattern_of_path(&relative(&new_folder, &path)));
                }
            }
            // A pattern without a match would be an error.
            let is_new = names(&new_folder, &[new]);
            if patterns.is_empty() || known().any(|(path, _)| is_new(&self.moved(path))) {
                patterns.insert(0, new.clone());
            }
            if patterns != [pattern.as_str()] {
                let text = listed(config.text(db), span, &patterns);
                change.replace(config, Replacement { range: range_of(span), text });
            }
        }
    }
}

fn quoted(path: &str) -> String {
    format!("\"{}\"", path.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Splits a pattern into its literal folders and the rest; a path has no rest.
fn split(pattern: &str) -> (&str, &str) {
    match pattern.find(['*', '?', '[', '{']).and_then(|special| pattern.get(..special)) {
        None => (pattern, ""),
        Some(before) => {
            let fixed = before.rfind('/').and_then(|slash| pattern.split_at_checked(slash));
            fixed.map_or(("", pattern), |(fixed, rest)| (fixed, rest.trim_start_matches('/')))
        }
    }
}

/// Returns the replacement of the string at `span` for one pattern; a string outside a list becomes a list.
fn listed(text: &str, span: &Range<usize>, patterns: &[String]) -> String {
    let quoted: Vec<String> = patterns.iter().map(|pattern| quoted(pattern)).collect();
    let before = text.get(..span.start).unwrap_or_default();
    if before.trim_end_matches([' ', '\t']).ends_with('=') && quoted.len() > 1 {
        return format!("[{}]", quoted.join(", "));
    }
    let line = before.rsplit_once('\n').map_or(before, |(_, line)| line);
    match line.trim().is_empty() {
        true => quoted.join(&format!(",\n{line}")),
        false => quoted.join(", "),
    }
}

fn relative(folder: &Path, path: &Path) -> String {
    slashed(&relative_path(folder, path))
}

fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.components().map(|id| id.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};
    use mauve_hir::{Database, project_files, projects};
    use mauve_wcrt::table_files;

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

    /// What `mauve.toml` says then; and the tables and roots are those that were ones.
    fn configured(config: &str, moves: &[(&str, &str)], expected: &str) {
        let fixture = format!(
            "//- /w/app/robot.mal\ncodel f(): int\n//- /w/timing/p3dx.toml\n//- /w/timing/arm.toml\n\
             //- /w/timing/old/p3dx.toml\n//- /w/notes/a.toml\n//- /w/mauve.toml\n{config}\n"
        );
        let (db, before) = workspace(&fixture);
        let moves: Vec<(PathBuf, PathBuf)> =
            moves.iter().map(|(old, new)| (old.into(), new.into())).collect();
        let change = rename_files(&db, &[before], &moves);
        let file = config_file(&db, before).unwrap();
        assert_eq!(change.applied(&db, file).trim_end(), expected);
        let moves = moves.iter().map(|(old, new)| (old.as_path(), new.as_path())).collect();
        let moving = Moving { db: &db, moves };
        let files = before.files(&db).iter().map(|(path, &it)| (moving.moved(path), change.applied(&db, it)));
        let new_db = Database::default();
        let after = Workspace::of_texts(&new_db, moving.moved(Path::new("/w")), files.collect::<Vec<_>>());
        let (old, new) = (table_files(&db, before), table_files(&new_db, after));
        let mut paths: Vec<PathBuf> = old.files.iter().map(|file| moving.moved(file.path(&db))).collect();
        paths.sort();
        assert_eq!(new.files.iter().map(|file| file.path(&new_db).clone()).collect::<Vec<_>>(), paths);
        assert_eq!(new.errors.len(), old.errors.len(), "{:?}", new.errors);
    }

    #[test]
    fn no_table_is_lost() {
        let list = "timing.tables = [\"timing/*.toml\"]";
        let moved = |new: &str, expected: &str| configured(list, &[("/w/timing/p3dx.toml", new)], expected);
        configured(list, &[("/w/timing", "/w/times")], "timing.tables = [\"times/*.toml\"]");
        configured(list, &[("/w/timing", "/w/a/[b]*")], "timing.tables = [\"a/[[]b[]][*]/*.toml\"]");
        configured(list, &[("/w", "/v/x")], list);
        moved("/w/timing/p4.toml", list);
        moved("/w/p3dx_times.toml", "timing.tables = [\"timing/*.toml\", \"p3dx_times.toml\"]");
        moved("/w/timing/sub/p3dx.toml", "timing.tables = [\"timing/*.toml\", \"timing/sub/p3dx.toml\"]");
        moved("/w/timing/p3dx.tml", "timing.tables = [\"timing/*.toml\", \"timing/p3dx.tml\"]");
        moved("/w/timing/p*.tml", "timing.tables = [\"timing/*.toml\", \"timing/p[*].tml\"]");
        // A string becomes a list; and a list has its own lines.
        let string = "[timing]\ntables = 'timing/*.toml' # all";
        let out = [("/w/timing/arm.toml", "/w/arm.toml")];
        configured(string, &out, "[timing]\ntables = [\"timing/*.toml\", \"arm.toml\"] # all");
        configured(
            "[timing]\ntables = [ # = a\n  'timing/*.toml',\n]",
            &out,
            "[timing]\ntables = [ # = a\n  \"timing/*.toml\",\n  \"arm.toml\",\n]",
        );
        // Of a pattern that would name nothing, the paths are left.
        let both = [out[0], ("/w/timing/p3dx.toml", "/w/p3dx.toml")];
        configured(list, &both, "timing.tables = [\"arm.toml\", \"p3dx.toml\"]");
        configured("timing.tables = 'timing/ar?.toml'", &out, "timing.tables = \"arm.toml\"");
        // A pattern that would name others in its new folder does not follow.
        configured(
            list,
            &[("/w/timing", "/w/notes")],
            "timing.tables = [\"notes/arm.toml\", \"notes/p3dx.toml\"]",
        );
        configured(
            "timing.tables = '**/p3*.toml'",
            &[("/w/timing", "/w/times")],
            "timing.tables = '**/p3*.toml'",
        );
        // The tables of a deployment follow as well, and are no others than before.
        let sea = |general: &str, sea: &str| {
            format!("timing.tables = \"{general}\"\ntiming.deployment.Sea.tables = [\"{sea}\"]")
        };
        configured(
            &sea("timing/*.toml", "timing/old/*.toml"),
            &[("/w/timing/old", "/w/sea")],
            &sea("timing/*.toml", "sea/*.toml"),
        );
        configured(&sea("timing/*.toml", "timing/arm.toml"), &out, &{
            let general = "timing.tables = [\"timing/*.toml\", \"arm.toml\"]";
            format!("{general}\ntiming.deployment.Sea.tables = [\"arm.toml\"]")
        });
        let list = "timing.tables = [\"timing/*/*.toml\", \"none/*.toml\"]";
        configured(
            list,
            &[("/w/timing/old", "/w/old")],
            "timing.tables = [\"old/p3dx.toml\", \"none/*.toml\"]",
        );
    }

    #[test]
    fn roots_and_generated_packages_follow() {
        let config = "project.root = \"app/robot.mal\"\ngenerate.out = \"app/cpp\"";
        let expected = "project.root = \"apps/r/robot.mal\"\ngenerate.out = \"apps/r/cpp\"";
        configured(config, &[("/w/app", "/w/apps/r")], expected);
        configured(config, &[("/w", "/v")], config);
        configured("generate.out = '../cpp'", &[("/w", "/v/w")], "generate.out = \"../../cpp\"");
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
