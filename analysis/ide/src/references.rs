//! References of a definition in all models, timing tables and configurations, and highlights in one file.

use mauve_hir::{File, ModelDb, Project, Workspace, config_file, is_model, project_files, projects};
use mauve_syntax::{TextRange, TextSize};
use mauve_wcrt::input_files;
use rustc_hash::FxHashSet;

use crate::occurrences::{Definition, FoundName, OccurrenceRole, grouped, names_at, names_of_definition};
use crate::project::projects_with;

/// A reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// The file.
    pub file: File,
    /// The name, without quotes.
    pub range: TextRange,
    /// The access.
    pub access: Access,
}

/// How a reference accesses the definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// It reads the value, or calls the operation or codel.
    Read,
    /// It declares or assigns it; also an `inout` argument.
    Write,
    /// It only mentions the name.
    Mention,
}

/// Returns all references of the definition at `offset` in every project that has it, by file and location, each once. Without
/// `declaration`, omits declarations.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "shell S { } core C(S) { } component P(S, C)".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = mauve_ide::references(&db, &[workspace], file, 6.into(), true);
/// assert_eq!(found.iter().map(|it| u32::from(it.range.start())).collect::<Vec<_>>(), [6, 19, 38]);
/// ```
pub fn references(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
    declaration: bool,
) -> Vec<Reference> {
    let projects = projects_with(db, workspaces, file);
    let found = occurrences(db, workspaces, &names(db, &projects, file, offset));
    let shown = found.iter().filter(|(_, it)| declaration || it.role != OccurrenceRole::Declaration);
    merged(shown.map(|(_, it)| it))
}

/// Returns the names at `offset` in each project.
pub(crate) fn names<'db>(
    db: &'db dyn ModelDb,
    projects: &[Project<'db>],
    file: File,
    offset: TextSize,
) -> Vec<(Project<'db>, FoundName<'db>)> {
    let names = |project| names_at(db, project, file, offset).into_iter().map(move |name| (project, name));
    projects.iter().copied().flat_map(names).collect()
}

/// Returns the references in `file` of the definition at `offset`.
pub fn highlights(db: &dyn ModelDb, project: Project<'_>, file: File, offset: TextSize) -> Vec<Reference> {
    let names = names_at(db, project, file, offset).into_iter();
    let mut all: Vec<FoundName<'_>> =
        names.flat_map(|name| names_of_definition(db, project, file, &name.definition)).collect();
    all.sort_by_key(|it| it.range.start());
    merged(&all)
}

/// Removes duplicates; a location is a write if any project writes there.
fn merged<'a, 'db: 'a>(all: impl IntoIterator<Item = &'a FoundName<'db>>) -> Vec<Reference> {
    let access = |role| match role {
        OccurrenceRole::Declaration
        | OccurrenceRole::Definition
        | OccurrenceRole::Write
        | OccurrenceRole::ReadWrite => Access::Write,
        OccurrenceRole::Read | OccurrenceRole::Call => Access::Read,
        OccurrenceRole::Mention => Access::Mention,
    };
    let places = grouped(all.into_iter().map(|it| ((it.file, it.range), access(it.role))));
    let reference = |((file, range), found): ((File, TextRange), Vec<Access>)| {
        let write = found.iter().find(|it| **it == Access::Write);
        Some(Reference { file, range, access: *write.or(found.first())? })
    };
    places.into_iter().filter_map(reference).collect()
}

/// Returns all references of these definitions, by file and location, each once per project.
pub(crate) fn occurrences<'db>(
    db: &'db dyn ModelDb,
    workspaces: &[Workspace],
    things: &[(Project<'db>, FoundName<'db>)],
) -> Vec<(Project<'db>, FoundName<'db>)> {
    let asked = grouped(things.iter().map(|(project, name)| (&name.definition, *project)));
    let mut found = Vec::new();
    let mut known: FxHashSet<(Project<'db>, FoundName<'db>)> = FxHashSet::default();
    for (definition, asked) in asked {
        let mut open = match (definition, definition.place()) {
            (_, Some(place)) => projects_with(db, workspaces, place.file(db)),
            // A library includes its blocks in files that projects share.
            (Definition::Library(_), _) => asked,
            _ => workspaces.iter().flat_map(|&workspace| projects(db, workspace)).copied().collect(),
        };
        let word = word_of(db, definition);
        let mut opened: FxHashSet<Project<'db>> = open.iter().copied().collect();
        let mut shared: FxHashSet<File> = FxHashSet::default();
        let mut next = 0;
        while let Some(&project) = open.get(next) {
            next += 1;
            let mut of_project = Vec::new();
            // Reads only files that contain the word.
            for file in files_of(db, project) {
                db.unwind_if_revision_cancelled();
                if word.as_ref().is_none_or(|word| file.text(db).contains(word)) {
                    of_project.extend(names_of_definition(db, project, file, definition));
                }
            }
            if matches!(definition, Definition::Library(_)) {
                for file in of_project.iter().map(|it| it.file).filter(|file| is_model(file.path(db))) {
                    if shared.insert(file) {
                        let more = projects_with(db, workspaces, file).into_iter();
                        open.extend(more.filter(|&project| opened.insert(project)));
                    }
                }
            }
            let of_project = of_project.into_iter().map(|it| (project, it));
            found.extend(of_project.filter(|it| known.insert(it.clone())));
        }
    }
    found.sort_by_key(|(_, it)| (it.file.path(db), it.range.start()));
    found
}

pub(crate) fn files_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<File> {
    let workspace = project.workspace(db);
    let mut files = project_files(db, project).clone();
    files.extend(input_files(db, workspace).0);
    files.extend(config_file(db, workspace));
    files
}

/// Returns the spelling of a definition's name, or `None` if it differs between locations.
pub(crate) fn word_of(db: &dyn ModelDb, definition: &Definition<'_>) -> Option<String> {
    match definition {
        Definition::Declaration(decl) => Some(decl.name(db).to_string()),
        Definition::At(place) => {
            let range = std::ops::Range::<usize>::from(place.range(db));
            place.file(db).text(db).get(range).map(str::to_owned)
        }
        Definition::Library(name)
        | Definition::Package(name)
        | Definition::Message(_, name)
        | Definition::Type(name) => Some(name.to_string()),
        Definition::File(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of, with_cursor};
    use expect_test::{Expect, expect};

    /// Each place, with its line's text.
    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let found = references(&db, &[workspace], file, offset, true);
        expected.assert_eq(&shown(&db, &found));
        // What is lit up in one file is what is found there.
        let here: Vec<Reference> = found.into_iter().filter(|it| it.file == file).collect();
        assert_eq!(highlights(&db, project_of(&db, workspace, file), file, offset), here);
    }

    fn shown(db: &dyn ModelDb, found: &[Reference]) -> String {
        let mut shown = String::new();
        for Reference { file, range, access } in found {
            let (text, start) = (file.text(db), usize::from(range.start()));
            let line = text[..start].rfind('\n').map_or(0, |end| end + 1);
            let end = text[start..].find('\n').map_or(text.len(), |length| start + length);
            let path = file.path(db).display();
            shown += &format!(
                "{path} {access:?}: {}«{}»{}\n",
                &text[line..start],
                &text[*range],
                &text[range.end().into()..end]
            );
        }
        shown
    }

    const ROBOT: &str = r#"
//- /one.mal
include "parts.mal"
architecture A { instance laser: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.clear -> laser.wipe }
component Mapper(parts.Map, parts.Map)
deployment D { architecture A activity laser { priority = 1 period = 100 } }
//- /parts.mal
library parts {
  codel shoot(out n: int): int
  shell Laser { property rate: int output port scan: int require wipe(): int }
  shell Map { input port scan: int provide clear(): int }
  core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(wipe); } }
  component Laser(Laser, Laser)
  core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to Idle } var n: int } }
}
//- /two.mal
include "parts.mal"
architecture B { instance laser: parts.Laser property laser.rate = 5 }
//- /mauve.toml
project.roots = ["one.mal", "two.mal"]
timing.tables = ["t.toml"]
chains.c = { from = "laser.scan", to = "map.scan" }
//- /t.toml
[codel.parts]
shoot = 1
[program]
"Mapper/Idle.go.guard" = 3
"Mapper/clear" = 4
[component]
parts.Laser = 9
"#;

    fn at(from: &str, expected: Expect) {
        check(&with_cursor(ROBOT, from), expected);
    }

    #[test]
    fn in_models_tables_and_configurations_of_all_projects() {
        at(
            "codel sh$0oot",
            expect![[r#"
            /parts.mal Write:   codel «shoot»(out n: int): int
            /parts.mal Read:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ «shoot»(n); write(scan, n + rate); h = send(wipe); } }
            /t.toml Mention: «shoot» = 1
        "#]],
        );
        at(
            "component La$0ser",
            expect![[r#"
            /one.mal Mention: architecture A { instance laser: parts.«Laser» instance map: Mapper connection laser.scan -> map.scan operation map.clear -> laser.wipe }
            /parts.mal Write:   component «Laser»(Laser, Laser)
            /t.toml Mention: parts.«Laser» = 9
            /two.mal Mention: architecture B { instance laser: parts.«Laser» property laser.rate = 5 }
        "#]],
        );
        at(
            "property ra$0te",
            expect![[r#"
            /parts.mal Write:   shell Laser { property «rate»: int output port scan: int require wipe(): int }
            /parts.mal Read:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(scan, n + «rate»); h = send(wipe); } }
            /two.mal Write: architecture B { instance laser: parts.Laser property laser.«rate» = 5 }
        "#]],
        );
        at(
            "output port $0scan",
            expect![[r#"
            /mauve.toml Mention: chains.c = { from = "laser.«scan»", to = "map.scan" }
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection laser.«scan» -> map.scan operation map.clear -> laser.wipe }
            /parts.mal Write:   shell Laser { property rate: int output port «scan»: int require wipe(): int }
            /parts.mal Write:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(«scan», n + rate); h = send(wipe); } }
        "#]],
        );
        at(
            "\"Mapper/cle$0ar\"",
            expect![[r#"
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.«clear» -> laser.wipe }
            /parts.mal Write:   shell Map { input port scan: int provide «clear»(): int }
            /parts.mal Write:   core Map(Map) { provide «clear»(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to Idle } var n: int } }
            /parts.mal Read:   core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { «clear»(); } } state Busy { transition go to Idle } var n: int } }
            /t.toml Mention: "Mapper/«clear»" = 4
        "#]],
        );
        at(
            "provide cle$0ar(): int =",
            expect![[r#"
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.«clear» -> laser.wipe }
            /parts.mal Write:   shell Map { input port scan: int provide «clear»(): int }
            /parts.mal Write:   core Map(Map) { provide «clear»(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to Idle } var n: int } }
            /parts.mal Read:   core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { «clear»(); } } state Busy { transition go to Idle } var n: int } }
            /t.toml Mention: "Mapper/«clear»" = 4
        "#]],
        );
        at(
            "require wi$0pe",
            expect![[r#"
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.clear -> laser.«wipe» }
            /parts.mal Write:   shell Laser { property rate: int output port scan: int require «wipe»(): int }
            /parts.mal Mention:   core Laser(Laser) { var n: int handler h: «wipe» update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(wipe); } }
            /parts.mal Read:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(«wipe»); } }
        "#]],
        );
        at(
            "initial state I$0dle",
            expect![[r#"
            /parts.mal Write:   core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state «Idle» { transition go if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to Idle } var n: int } }
            /parts.mal Mention:   core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state Idle { transition go if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to «Idle» } var n: int } }
            /t.toml Mention: "Mapper/«Idle».go.guard" = 3
        "#]],
        );
        at(
            "transition g$0o if",
            expect![[r#"
            /parts.mal Write:   core Map(Map) { provide clear(): int = { return 1; } statemachine { initial state Idle { transition «go» if read(scan, n) == new_data to Busy { clear(); } } state Busy { transition go to Idle } var n: int } }
            /t.toml Mention: "Mapper/Idle.«go».guard" = 3
        "#]],
        );
        at(
            "library par$0ts",
            expect![[r#"
            /one.mal Mention: architecture A { instance laser: «parts».Laser instance map: Mapper connection laser.scan -> map.scan operation map.clear -> laser.wipe }
            /one.mal Mention: component Mapper(«parts».Map, parts.Map)
            /one.mal Mention: component Mapper(parts.Map, «parts».Map)
            /parts.mal Write: library «parts» {
            /t.toml Mention: [codel.«parts»]
            /t.toml Mention: «parts».Laser = 9
            /two.mal Mention: architecture B { instance laser: «parts».Laser property laser.rate = 5 }
        "#]],
        );
        at(
            "include \"pa$0rts.mal",
            expect![[r#"
            /one.mal Mention: include "«parts.mal»"
            /two.mal Mention: include "«parts.mal»"
        "#]],
        );
        at(
            "shoot($0n)",
            expect![[r#"
            /parts.mal Write:   core Laser(Laser) { var «n»: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(wipe); } }
            /parts.mal Write:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(«n»); write(scan, n + rate); h = send(wipe); } }
            /parts.mal Read:   core Laser(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); write(scan, «n» + rate); h = send(wipe); } }
        "#]],
        );
        at(
            "activity las$0er",
            expect![[r#"
            /mauve.toml Mention: chains.c = { from = "«laser».scan", to = "map.scan" }
            /one.mal Write: architecture A { instance «laser»: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.clear -> laser.wipe }
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection «laser».scan -> map.scan operation map.clear -> laser.wipe }
            /one.mal Mention: architecture A { instance laser: parts.Laser instance map: Mapper connection laser.scan -> map.scan operation map.clear -> «laser».wipe }
            /one.mal Mention: deployment D { architecture A activity «laser» { priority = 1 period = 100 } }
        "#]],
        );
    }

    #[test]
    fn without_its_declaration() {
        let Fixture { db, workspace, file, offset } =
            Fixture::new("codel $0f(): int core C(S) { update = { f(); } }");
        let found = references(&db, &[workspace], file, offset, false);
        assert_eq!(shown(&db, &found), "/model.mal Read: codel f(): int core C(S) { update = { «f»(); } }\n");
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            "codel f(): int core C(S) { update = { if (f$0( }",
            expect![[r#"
            /model.mal Write: codel «f»(): int core C(S) { update = { if (f( }
            /model.mal Read: codel f(): int core C(S) { update = { if («f»( }
        "#]],
        );
        check("component $0", expect![[r#""#]]);
        check("$0", expect![[r#""#]]);
    }
}
