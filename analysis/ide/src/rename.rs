//! Renames a definition in all models, timing tables and configurations that refer to it.
//!
//! Rules alone do not tell whether a name is free: the changed texts are analysed, and every name in them must refer to the same
//! definition as before. If that is unknown, because a text is incomplete or a file is missing, the rename is refused with the
//! location that causes it.

mod check;

use mauve_hir::item_tree::{Data, Kind, NameRef, SourceId, Statement};
use mauve_hir::{
    Builtin, Decl, File, Location, ModelDb, Project, Workspace, data, features_of, flat_of, is_model,
    line_of, names_of,
};
use mauve_syntax::format::Replacement;
use mauve_syntax::keywords::LITERALS;
use mauve_syntax::{TextRange, TextSize};

use crate::change::Change;
use crate::document_symbols::SymbolKind;
use crate::occurrences::{Definition, FoundName, each_once, name_spaces};
use crate::project::projects_with;
use crate::references::{names, occurrences, word_of};

/// A name that can be changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renameable {
    /// Its location.
    pub range: TextRange,
    /// The name.
    pub name: String,
}

/// Returns the name at `offset` if it can be renamed.
///
/// # Errors
///
/// Why it cannot, for the user.
pub fn prepare_rename(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
) -> Result<Renameable, String> {
    let things = names(db, &projects_with(db, workspaces, file), file, offset);
    let (name, word) = the_one(db, &things)?;
    Ok(Renameable { range: name.range, name: word })
}

/// Renames the definition of the name at `offset` everywhere, in every project that has it.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "shell S { } core C(S) { }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let change = mauve_ide::rename(&db, &[workspace], file, 6.into(), "Laser").unwrap();
/// assert_eq!(change.applied(&db, file), "shell Laser { } core C(Laser) { }");
/// assert!(mauve_ide::rename(&db, &[workspace], file, 6.into(), "a b").is_err());
/// ```
///
/// # Errors
///
/// Why it cannot, for the user: the new name is invalid or already used; another name would refer to another definition; or not
/// all references are known.
pub fn rename(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
    new_name: &str,
) -> Result<Change, String> {
    let things = names(db, &projects_with(db, workspaces, file), file, offset);
    let (thing, old_name) = the_one(db, &things)?;
    check_name(thing.kind, new_name)?;
    if new_name == old_name {
        return Ok(Change::default());
    }
    let all = occurrences(db, workspaces, &things);
    let concerned = each_once(things.iter().chain(&all).map(|(project, _)| *project));
    let renaming = Renaming { db, workspaces, thing, old_name: &old_name, new_name, concerned: &concerned };
    concerned.iter().try_for_each(|&project| renaming.check_free(project))?;
    renaming.check_known(&all)?;
    let mut change = Change::default();
    for (_, name) in &all {
        if let Some(problem) = name.file.problem(db) {
            return Err(format!("{} cannot be changed: {}", shown(db, name.file), problem.message()));
        }
        if text_of(db, name.file, name.range) != old_name {
            return Err(format!(
                "{}: refers to it by another name than `{old_name}`",
                renaming.line(name.file, name.range)
            ));
        }
        change.replace(name.file, Replacement { range: name.range, text: new_name.to_owned() });
    }
    for of_file in &mut change.files {
        let is_config = of_file.file.path(db).ends_with(mauve_hir::CONFIG_FILE);
        let place = match is_model(of_file.file.path(db)) {
            true => "models",
            false if is_config => mauve_hir::CONFIG_FILE,
            false => "timing tables",
        };
        of_file.note = Some(format!("Rename `{old_name}` to `{new_name}` in {place}"));
    }
    renaming.check_definitions(&change)?;
    Ok(change)
}

fn the_one<'a, 'db>(
    db: &'db dyn ModelDb,
    things: &'a [(Project<'db>, FoundName<'db>)],
) -> Result<(&'a FoundName<'db>, String), String> {
    let Some((_, first)) = things.first() else {
        return Err("no name here, or its definition is unknown".to_owned());
    };
    let word = text_of(db, first.file, first.range).to_owned();
    if things.iter().any(|(_, other)| other.definition != first.definition) {
        return Err(format!("`{word}` has several definitions here: rename each at its declaration"));
    }
    let refused = match (&first.definition, first.kind) {
        (Definition::Declaration(_) | Definition::Library(_), _) => None,
        (Definition::At(_), SymbolKind::Hook) => Some(format!("`{word}` is a keyword")),
        (Definition::At(_), _) => None,
        (Definition::Package(_), _) => Some(format!("`{word}` is a message package, or `ctypes`")),
        (Definition::Message(package, _), _) => Some(format!("`{word}` is declared by package `{package}`")),
        (Definition::Type(_), _) => Some(format!("type `{word}` is built in, or declared in `mauve.toml`")),
        (Definition::File(_), _) => Some("rename the file itself: its includes are updated".to_owned()),
    };
    match refused {
        Some(why) => Err(why),
        None if word_of(db, &first.definition).as_deref() != Some(&word) => {
            Err(format!("`{word}` is spelt differently at its declaration: rename it there"))
        }
        None => Ok((first, word)),
    }
}

fn check_name(kind: SymbolKind, name: &str) -> Result<(), String> {
    let mut letters = name.chars();
    let begins = letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_');
    if !begins || !letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
        return Err(format!(
            "`{name}` is not a name: a name consists of letters, digits and `_`, and does not begin with a digit"
        ));
    }
    let in_programs = !matches!(
        kind,
        SymbolKind::State
            | SymbolKind::Transition
            | SymbolKind::Instance
            | SymbolKind::Library
            | SymbolKind::Shell
            | SymbolKind::Core
            | SymbolKind::Component
            | SymbolKind::Architecture
            | SymbolKind::Deployment
    );
    if in_programs && LITERALS.contains(&name) {
        return Err(format!("`{name}` is a built-in value"));
    }
    if matches!(kind, SymbolKind::Codel | SymbolKind::Operation) && Builtin::of_name(name).is_some() {
        return Err(format!("`{name}` is a built-in function"));
    }
    Ok(())
}

struct Renaming<'a, 'db> {
    db: &'db dyn ModelDb,
    workspaces: &'a [Workspace],
    thing: &'a FoundName<'db>,
    old_name: &'a str,
    new_name: &'a str,
    concerned: &'a [Project<'db>],
}

impl<'db> Renaming<'_, 'db> {
    /// The declaration outside which the name is not visible, if there is one.
    fn home(&self) -> Option<Decl<'db>> {
        let is_inner = matches!(
            self.thing.kind,
            SymbolKind::Variable
                | SymbolKind::Parameter
                | SymbolKind::Handler
                | SymbolKind::State
                | SymbolKind::Transition
        );
        match self.thing.definition {
            Definition::At(Location::Source(decl, _)) if is_inner => Some(decl),
            _ => None,
        }
    }

    fn line(&self, file: File, range: TextRange) -> String {
        format!("{}, line {}", shown(self.db, file), line_of(self.db, file, range.start()))
    }

    fn check_free(&self, project: Project<'db>) -> Result<(), String> {
        let (db, new) = (self.db, self.new_name);
        let names = names_of(db, project);
        let taken = |what: String, place: &Location<'db>| {
            Err(format!("{what} already exists ({})", self.line(place.file(db), place.range(db))))
        };
        match &self.thing.definition {
            Definition::Declaration(decl) => {
                let (kind, library) = (decl.kind(db), decl.library(db).as_ref());
                match names.in_library(library, kind, &new.into()).first() {
                    Some(other) => taken(format!("{kind} `{new}`"), &Location::name_of(*other)),
                    None => Ok(()),
                }
            }
            Definition::Library(_) if names.has_library(&new.into()) => {
                Err(format!("library `{new}` already exists: the two would be merged"))
            }
            Definition::At(Location::Source(decl, id)) => {
                if let Some(other) = sibling(db, *decl, *id, new) {
                    return taken(format!("`{new}`"), &Location::Source(*decl, other));
                }
                for &other in &names.all {
                    let found = match (decl.kind(db), other.kind(db)) {
                        (Kind::Shell, Kind::Shell) if self.thing.kind != SymbolKind::Parameter => {
                            let features = features_of(db, project, other);
                            let feature = features.get(new).filter(|_| features.shells.contains(decl));
                            feature.and_then(|it| it.name(db))
                        }
                        (Kind::Architecture, Kind::Architecture) => {
                            let flat = flat_of(db, project, other);
                            let instance = flat.instance(new).filter(|_| flat.architectures.contains(decl));
                            instance.and_then(|it| it.declaration(db))
                        }
                        _ => None,
                    };
                    if let Some(place) = found {
                        let kind = other.kind(db);
                        return taken(format!("`{new}` in {kind} `{}`", other.name(db)), &place);
                    }
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

/// Returns the other name that equals `name` in the namespace of the name with this source, if there is one.
fn sibling<'a>(db: &'a dyn ModelDb, of: Decl<'a>, id: SourceId, name: &str) -> Option<SourceId> {
    let data = data(db, of).as_deref()?;
    let names = |space: Vec<(_, &'a NameRef)>| space.into_iter().map(|(_, it)| it).collect();
    let mut spaces: Vec<Vec<&NameRef>> = name_spaces(data).into_iter().map(names).collect();
    if let Data::Core(core) = data {
        let own = |block: &'a [Statement]| block.iter().filter_map(|it| Some(&it.variable()?.name)).collect();
        spaces.extend(core.blocks().map(own));
    }
    let mut own = spaces.into_iter().filter(|names| names.iter().any(|it| it.id == id));
    own.find_map(|names| names.into_iter().find(|it| it.name == name).map(|it| it.id))
}

fn text_of(db: &dyn ModelDb, file: File, range: TextRange) -> &str {
    file.text(db).get(std::ops::Range::<usize>::from(range)).unwrap_or_default()
}

fn shown(db: &dyn ModelDb, file: File) -> String {
    file.path(db).file_name().unwrap_or_default().display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, with_cursor};
    use expect_test::{Expect, expect};

    /// The lines that change, as they are then; or why none does.
    pub(super) fn check(fixture: &str, new_name: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let outcome = match rename(&db, &[workspace], file, offset, new_name) {
            Err(why) => why + "\n",
            Ok(change) => {
                let mut shown = String::new();
                for of_file in &change.files {
                    let path = of_file.file.path(&db).display();
                    let (old, new) = (of_file.file.text(&db), change.applied(&db, of_file.file));
                    for (_, line) in old.lines().zip(new.lines()).filter(|(old, new)| old != new) {
                        shown += &format!("{path}: {line}\n");
                    }
                }
                shown
            }
        };
        expected.assert_eq(&outcome);
    }

    const ROBOT: &str = r#"
//- /one.mal
include "parts.mal"
architecture A { instance laser: parts.Laser
  instance map: Mapper
  connection laser.scan -> map.scan
  operation map.clear -> laser.wipe
}
component Mapper(parts.Map, parts.Map)
deployment D { architecture A activity laser { priority = 1 period = 100 } }
//- /parts.mal
library parts {
  codel shoot(out n: int): int
  shell Base { property rate: int }
  shell Laser extends Base { output port scan: int require wipe(): int }
  shell Map { input port scan: int
    provide clear(): int }
  core Laser(Laser) {
    var n: int
    handler h: wipe
    update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
  }
  component Laser(Laser, Laser)
  core Map(Map) {
    provide clear(): int = { return 1; }
    statemachine {
      initial state Idle { transition go if read(scan, n) == new_data to Busy {
        clear(); } }
      state Busy { transition go to Idle }
      var n: int } }
}
//- /two.mal
include "parts.mal"
architecture B { instance laser: parts.Laser
  property laser.rate = 5 }
//- /mauve.toml
project.roots = ["one.mal", "two.mal"]
timing.tables = ["t.toml"]
clocks.drive.instances = ["map"]
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

    fn robot(from: &str, new_name: &str, expected: Expect) {
        check(&with_cursor(ROBOT, from), new_name, expected);
    }

    #[test]
    fn a_deployment_in_its_sections() {
        check(
            "library l { shell S { }  architecture A { }  deployment Se$0a { architecture A } }\n\
             //- /mauve.toml\n[timing.deployment.Sea]\ntables = []\n[deployment.\"l.Sea\"]\naccept = { }\n",
            "Ocean",
            expect![[r#"
                /mauve.toml: [timing.deployment.Ocean]
                /mauve.toml: [deployment."l.Ocean"]
                /model.mal: library l { shell S { }  architecture A { }  deployment Ocean { architecture A } }
            "#]],
        );
    }

    #[test]
    fn a_state_and_a_codel_of_a_chain() {
        let text = |state: &str, codel: &str| {
            format!(
                "library l {{ codel {codel}(): bool  shell S {{ }}\n\
                 core K(S) {{ statemachine {{ initial state {state} {{ transition on to Go }} }} }} component C(S, K)\n\
                 architecture A {{ instance a: C }} deployment D {{ architecture A activity a {{ priority = 1 period = 1 }} }} }}\n\
                 //- /mauve.toml\n[chains.c]\nfrom = \"l.f\"\nto = \"f\"\nwhile = [\"a.Go\"]\n"
            )
        };
        check(
            &text("G$0o", "f"),
            "Run",
            expect![[r#"
                /mauve.toml: while = ["a.Run"]
                /model.mal: core K(S) { statemachine { initial state Run { transition on to Run } } } component C(S, K)
            "#]],
        );
        check(
            &text("Go", "$0f"),
            "sweep",
            expect![[r#"
                /mauve.toml: from = "l.sweep"
                /mauve.toml: to = "sweep"
                /model.mal: library l { codel sweep(): bool  shell S { }
            "#]],
        );
    }

    #[test]
    fn an_instance_whose_deadline_is_accepted() {
        check(
            "shell S { }\ncore C(S) { }\ncomponent K(S, C)\narchitecture A { instance ma$0p: K }\n\
             deployment Sea { architecture A activity map { priority = 1 } }\n\
             architecture B { instance map: K }\ndeployment Land { architecture B activity map { priority = 1 } }\n\
             //- /mauve.toml\n[deployment.Sea]\naccept = { map = \"by hand\" }\n[deployment.Land.accept]\nmap = \"by hand\"\n",
            "chart",
            expect![[r#"
                /mauve.toml: accept = { chart = "by hand" }
                /model.mal: architecture A { instance chart: K }
                /model.mal: deployment Sea { architecture A activity chart { priority = 1 } }
            "#]],
        );
    }

    #[test]
    fn a_codel_is_renamed_in_all_files() {
        robot(
            "codel sh$0oot",
            "picture",
            expect![[r#"
            /parts.mal:   codel picture(out n: int): int
            /parts.mal:     update = { /* 🦀 é */ picture(n); write(scan, n + rate); h = send(wipe); { var m: int; picture(n); m = n; } }
            /t.toml: picture = 1
        "#]],
        );
        robot(
            "component La$0ser",
            "Lidar",
            expect![[r#"
            /one.mal: architecture A { instance laser: parts.Lidar
            /parts.mal:   component Lidar(Laser, Laser)
            /t.toml: parts.Lidar = 9
            /two.mal: architecture B { instance laser: parts.Lidar
        "#]],
        );
        robot(
            "core Laser(Las$0er)",
            "Lidar",
            expect![[r#"
            /parts.mal:   shell Lidar extends Base { output port scan: int require wipe(): int }
            /parts.mal:   core Laser(Lidar) {
            /parts.mal:   component Laser(Lidar, Laser)
        "#]],
        );
        robot(
            "property ra$0te",
            "pace",
            expect![[r#"
            /parts.mal:   shell Base { property pace: int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(scan, n + pace); h = send(wipe); { var m: int; shoot(n); m = n; } }
            /two.mal:   property laser.pace = 5 }
        "#]],
        );
        robot(
            "output port $0scan",
            "ranges",
            expect![[r#"
            /mauve.toml: chains.c = { from = "laser.ranges", to = "map.scan" }
            /one.mal:   connection laser.ranges -> map.scan
            /parts.mal:   shell Laser extends Base { output port ranges: int require wipe(): int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(ranges, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
        "#]],
        );
        robot(
            "\"Mapper/cle$0ar\"",
            "wipe_out",
            expect![[r#"
            /one.mal:   operation map.wipe_out -> laser.wipe
            /parts.mal:     provide wipe_out(): int }
            /parts.mal:     provide wipe_out(): int = { return 1; }
            /parts.mal:         wipe_out(); } }
            /t.toml: "Mapper/wipe_out" = 4
        "#]],
        );
        robot(
            "require wi$0pe",
            "blank",
            expect![[r#"
            /one.mal:   operation map.clear -> laser.blank
            /parts.mal:   shell Laser extends Base { output port scan: int require blank(): int }
            /parts.mal:     handler h: blank
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(blank); { var m: int; shoot(n); m = n; } }
        "#]],
        );
        robot(
            "initial state I$0dle",
            "Waiting",
            expect![[r#"
            /parts.mal:       initial state Waiting { transition go if read(scan, n) == new_data to Busy {
            /parts.mal:       state Busy { transition go to Waiting }
            /t.toml: "Mapper/Waiting.go.guard" = 3
        "#]],
        );
        robot(
            "transition g$0o if",
            "leave",
            expect![[r#"
            /parts.mal:       initial state Idle { transition leave if read(scan, n) == new_data to Busy {
            /t.toml: "Mapper/Idle.leave.guard" = 3
        "#]],
        );
        robot(
            "library par$0ts",
            "pieces",
            expect![[r#"
            /one.mal: architecture A { instance laser: pieces.Laser
            /one.mal: component Mapper(pieces.Map, pieces.Map)
            /parts.mal: library pieces {
            /t.toml: [codel.pieces]
            /t.toml: pieces.Laser = 9
            /two.mal: architecture B { instance laser: pieces.Laser
        "#]],
        );
        robot(
            "shoot($0n)",
            "k",
            expect![[r#"
            /parts.mal:     var k: int
            /parts.mal:     update = { /* 🦀 é */ shoot(k); write(scan, k + rate); h = send(wipe); { var m: int; shoot(k); m = k; } }
        "#]],
        );
        robot(
            "chains.c = { from = \"laser.scan\", to = \"m$0ap",
            "chart",
            expect![[r#"
            /mauve.toml: clocks.drive.instances = ["chart"]
            /mauve.toml: chains.c = { from = "laser.scan", to = "chart.scan" }
            /one.mal:   instance chart: Mapper
            /one.mal:   connection laser.scan -> chart.scan
            /one.mal:   operation chart.clear -> laser.wipe
        "#]],
        );
    }

    #[test]
    fn names_that_are_taken_are_refused() {
        robot(
            "property ra$0te",
            "scan",
            expect![[r#"
                `scan` in shell `Laser` already exists (parts.mal, line 4)
            "#]],
        );
        robot(
            "output port $0scan",
            "rate",
            expect![[r#"
                `rate` in shell `Laser` already exists (parts.mal, line 3)
            "#]],
        );
        robot(
            "component La$0ser",
            "Mapper",
            expect![[r#"
                t.toml, line 4: `Mapper` would refer to a definition
            "#]],
        );
        robot(
            "core La$0ser",
            "Map",
            expect![[r#"
                core `Map` already exists (parts.mal, line 13)
            "#]],
        );
        robot(
            "initial state I$0dle",
            "Busy",
            expect![[r#"
                `Busy` already exists (parts.mal, line 18)
            "#]],
        );
        robot(
            "instance ma$0p",
            "laser",
            expect![[r#"
                `laser` already exists (one.mal, line 2)
            "#]],
        );
        robot(
            "handler $0h",
            "n",
            expect![[r#"
                `n` already exists (parts.mal, line 8)
            "#]],
        );
        robot(
            "library par$0ts",
            "parts2",
            expect![[r#"
            /one.mal: architecture A { instance laser: parts2.Laser
            /one.mal: component Mapper(parts2.Map, parts2.Map)
            /parts.mal: library parts2 {
            /t.toml: [codel.parts2]
            /t.toml: parts2.Laser = 9
            /two.mal: architecture B { instance laser: parts2.Laser
        "#]],
        );
        check(
            "library l { } library $0m { }",
            "l",
            expect![[r#"
                library `l` already exists: the two would be merged
            "#]],
        );
        // Whatever stands for something else then.
        robot(
            "var $0n: int\n    handler",
            "rate",
            expect![[r#"
                parts.mal, line 10: `rate` would refer to another definition
            "#]],
        );
        robot(
            "var $0n: int\n    handler",
            "m",
            expect![[r#"
                parts.mal, line 10: `n` would refer to another definition
            "#]],
        );
        robot(
            "var $0n: int\n    handler",
            "shoot",
            expect![[r#"
                parts.mal, line 10: `shoot` would refer to another definition
            "#]],
        );
        robot(
            "{ var $0m: int",
            "n",
            expect![[r#"
                parts.mal, line 10: `n` would refer to another definition
            "#]],
        );
        robot(
            "codel sh$0oot",
            "clear",
            expect![[r#"
            /parts.mal:   codel clear(out n: int): int
            /parts.mal:     update = { /* 🦀 é */ clear(n); write(scan, n + rate); h = send(wipe); { var m: int; clear(n); m = n; } }
            /t.toml: clear = 1
        "#]],
        );
        check(
            "codel $0f(): int core C(S) { update = { g(); } }",
            "g",
            expect![[r#"
                model.mal, line 1: `g` would refer to a definition
            "#]],
        );
        check(
            "shell B { property p: int } shell S extends B { property $0q: int } ",
            "p",
            expect![[r#"
                `p` in shell `S` already exists (model.mal, line 1)
            "#]],
        );
        check(
            "architecture A { instance a: P } architecture B { import A instance $0b: P } ",
            "a",
            expect![[r#"
                `a` in architecture `B` already exists (model.mal, line 1)
            "#]],
        );
    }

    #[test]
    fn texts_that_are_no_names_are_refused() {
        let why = |name: &str| {
            let Fixture { db, workspace, file, offset } = Fixture::new("codel $0f(): int");
            rename(&db, &[workspace], file, offset, name).unwrap_err()
        };
        for name in ["", "1a", "a b", "é", "a.b", "a-b", "/*"] {
            let expected =
                "is not a name: a name consists of letters, digits and `_`, and does not begin with a digit";
            assert_eq!(why(name), format!("`{name}` {expected}"));
        }
        for name in ["true", "failure"] {
            assert_eq!(why(name), format!("`{name}` is a built-in value"));
        }
        robot(
            "codel sh$0oot",
            "read",
            expect![[r#"
                `read` is a built-in function
            "#]],
        );
        // Every word may be the name of a state.
        robot(
            "initial state I$0dle",
            "state",
            expect![[r#"
            /parts.mal:       initial state state { transition go if read(scan, n) == new_data to Busy {
            /parts.mal:       state Busy { transition go to state }
            /t.toml: "Mapper/state.go.guard" = 3
        "#]],
        );
        robot(
            "output port $0scan",
            "if",
            expect![[r#"
            /mauve.toml: chains.c = { from = "laser.if", to = "map.scan" }
            /one.mal:   connection laser.if -> map.scan
            /parts.mal:   shell Laser extends Base { output port if: int require wipe(): int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(if, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
        "#]],
        );
    }

    #[test]
    fn what_has_no_name_of_ours() {
        robot(
            "rate: i$0nt",
            "x",
            expect![[r#"
            type `int` is built in, or declared in `mauve.toml`
        "#]],
        );
        robot(
            "upd$0ate =",
            "x",
            expect![[r#"
                no name here, or its definition is unknown
            "#]],
        );
        robot(
            "include \"pa$0rts",
            "x",
            expect![[r#"
                rename the file itself: its includes are updated
            "#]],
        );
        robot(
            "wri$0te(",
            "x",
            expect![[r#"
                no name here, or its definition is unknown
            "#]],
        );
        check(
            "use std_msgs codel f(a: Str$0ing): int",
            "x",
            expect![[r#"
            `String` is declared by package `std_msgs`
        "#]],
        );
        check(
            "use std$0_msgs codel f(a: String): int",
            "x",
            expect![[r#"
            `std_msgs` is a message package, or `ctypes`
        "#]],
        );
    }

    #[test]
    fn a_name_to_be_changed() {
        let Fixture { db, workspace, file, offset } = Fixture::new("/* 🦀 */ codel sho$0ot(): int");
        let found = prepare_rename(&db, &[workspace], file, offset).unwrap();
        assert_eq!((found.name.as_str(), &file.text(&db)[found.range]), ("shoot", "shoot"));
        assert_eq!(rename(&db, &[workspace], file, offset, "shoot"), Ok(Change::default()));
        assert!(prepare_rename(&db, &[workspace], file, 2.into()).is_err());
    }
}
