//! Go to implementation: the cores and components of a shell, the definitions of an operation, the deployments of an architecture,
//! the C++ file of a codel and its entries in timing tables.

use std::path::PathBuf;

use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, bases_of, config_of, core_of, first_target_of, names_of, shell_of,
};
use mauve_syntax::TextSize;
use mauve_wcrt::table_files;

use crate::call_hierarchy::{definitions, providers};
use crate::definition::{Navigation, Target, destination, of_declaration};
use crate::document_symbols::SymbolKind;
use crate::occurrences::{Definition, FoundName, names_at, names_of_definition};

/// Returns the implementations of the name at `offset`. Includes the file of a codel even if it does not exist.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "shell S { } core C(S) { } component P(S, C)".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = mauve_ide::implementation(&db, projects(&db, workspace)[0], file, 6.into()).unwrap();
/// assert_eq!(found.targets.len(), 2);
/// ```
pub fn implementation(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Option<Navigation> {
    let names = names_at(db, project, file, offset);
    let found = |name: &FoundName<'_>| match &name.definition {
        Definition::Declaration(decl) => of_declared(db, project, *decl),
        Definition::At(_) if name.kind == SymbolKind::Operation => {
            let providers = providers(db, project, &name.definition);
            let operations = std::iter::once(&name.definition).chain(providers);
            operations.flat_map(|operation| defined(db, project, operation)).collect()
        }
        _ => Vec::new(),
    };
    destination(&names, found, |name| codel_file(db, project, name.definition.declaration(db, Kind::Codel)?))
}

fn of_declared<'db>(db: &'db dyn ModelDb, project: Project<'db>, decl: Decl<'db>) -> Vec<Target> {
    let implements = |of: Decl<'db>| match (decl.kind(db), of.kind(db)) {
        (Kind::Shell, Kind::Shell) => bases_of(db, project, of).contains(&decl),
        (Kind::Shell, Kind::Core | Kind::Component) => shell_of(db, project, of) == Some(decl),
        (Kind::Component, Kind::Core) => core_of(db, project, decl) == Some(of),
        (Kind::Architecture, Kind::Deployment) => first_target_of(db, project, of) == Some(decl),
        _ => false,
    };
    match decl.kind(db) {
        Kind::Codel => in_tables(db, project, decl),
        _ => {
            let found = names_of(db, project).all.iter().filter(|&&of| implements(of));
            found.filter_map(|&of| of_declaration(db, of)).collect()
        }
    }
}

fn in_tables<'db>(db: &'db dyn ModelDb, project: Project<'db>, codel: Decl<'db>) -> Vec<Target> {
    let codel = Definition::Declaration(codel);
    let files = table_files(db, project.workspace(db)).files.iter();
    let names = files.flat_map(|&file| names_of_definition(db, project, file, &codel));
    names.map(|it| Target::of_name(it.file, it.range)).collect()
}

/// Returns the definitions of an operation in the cores of its shell.
fn defined(db: &dyn ModelDb, project: Project<'_>, operation: &Definition<'_>) -> Vec<Target> {
    let Definition::At(Location::Source(of, _)) = operation else { return Vec::new() };
    let all = definitions(db, project).get(operation).filter(|_| of.kind(db) == Kind::Shell);
    let target = |name: &Location<'_>| Target::of_name(name.file(db), name.range(db));
    all.into_iter().flatten().map(target).collect()
}

/// Returns the path at which the generator places the user's source of a codel: one package per library.
pub fn codel_file(db: &dyn ModelDb, project: Project<'_>, decl: Decl<'_>) -> Option<PathBuf> {
    let library = decl.library(db).as_ref().filter(|_| decl.kind(db) == Kind::Codel)?;
    let workspace = project.workspace(db);
    let out = config_of(db, workspace).out.as_ref().map_or("generated", |(out, _)| out);
    let package = workspace.folder(db).join(out).join(library.as_str());
    Some(mauve_hir::normalised(&package.join("src/codels").join(format!("{}.cpp", decl.name(db)))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of, shown, with_cursor};
    use expect_test::{Expect, expect};

    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        expected.assert_eq(&shown(&db, implementation(&db, project_of(&db, workspace, file), file, offset)));
    }

    const ROBOT: &str = r#"
//- /robot.mal
include "parts.mal"
architecture Base { instance laser: parts.Sick }
architecture A { import Base instance map: Gmapping operation map.clear -> laser.wipe }
component Gmapping(parts.Map, parts.Slam)
deployment D { architecture A activity laser { priority = 1 period = 100 } }
//- /parts.mal
library parts {
  codel shoot(out n: int): int
  shell Sensor { property rate: int }
  shell Laser extends Sensor { require wipe(): int }
  shell Map { provide clear(): int }
  core Sweep(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); h = send(wipe); } }
  component Sick(Laser, Sweep)
  core Slam(Map) { provide clear(): int = { return 1; } update = { clear(); } }
  core Grid(Map) { provide clear(): int = { return 2; } update = { } }
}
//- /mauve.toml
timing.tables = ["t.toml"]
//- /t.toml
[codel]
parts.shoot = 1
"#;

    fn at(from: &str, expected: Expect) {
        check(&with_cursor(ROBOT, from), expected);
    }

    #[test]
    fn of_everything_that_is_made_by_something() {
        at(
            "shell Sen$0sor",
            expect![[r#"
            /parts.mal:4 Laser | shell Laser extends Sensor { require wipe(): int }
        "#]],
        );
        at("Laser, Swe$0ep", expect![[r#""#]]);
        at(
            "shell La$0ser",
            expect![[r#"
            /parts.mal:6 Sweep | core Sweep(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); h = send(wipe); } }
            /parts.mal:7 Sick | component Sick(Laser, Sweep)
        "#]],
        );
        at(
            "instance laser: parts.Si$0ck",
            expect![[r#"
            /parts.mal:6 Sweep | core Sweep(Laser) { var n: int handler h: wipe update = { /* 🦀 é */ shoot(n); h = send(wipe); } }
        "#]],
        );
        at(
            "deployment D { architecture $0A",
            expect![[r#"
            /robot.mal:5 D | deployment D { architecture A activity laser { priority = 1 period = 100 } }
        "#]],
        );
        at(
            "codel sho$0ot",
            expect![[r#"
            /t.toml:2 shoot | shoot
            /generated/parts/src/codels/shoot.cpp
        "#]],
        );
        at(
            "provide cl$0ear(): int }",
            expect![[r#"
            /parts.mal:8 clear | clear
            /parts.mal:9 clear | clear
        "#]],
        );
        // A required operation is done by those that are connected to it.
        at(
            "send(wi$0pe)",
            expect![[r#"
            /parts.mal:8 clear | clear
            /parts.mal:9 clear | clear
        "#]],
        );
        at(
            "map.cle$0ar",
            expect![[r#"
            /parts.mal:8 clear | clear
            /parts.mal:9 clear | clear
        "#]],
        );
    }

    #[test]
    fn where_the_generator_puts_a_codel() {
        check(
            "//- /a.mal\nlibrary l { codel $0f(): int }\n//- /mauve.toml\n[generate]\nout = \"../cpp\"\n",
            expect![[r#"
                /cpp/l/src/codels/f.cpp
            "#]],
        );
        // What stands outside libraries is in no package.
        check("codel $0f(): int", expect![[r#""#]]);
    }

    #[test]
    fn while_the_text_is_broken() {
        check("shell $0S { core C(S) {", expect![[r#""#]]);
        check("$0", expect![[r#""#]]);
    }
}
