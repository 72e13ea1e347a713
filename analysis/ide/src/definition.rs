//! Go to definition.

use std::path::PathBuf;

use mauve_hir::{Decl, File, Location, ModelDb, Project, declaration_map, project_files};
use mauve_syntax::ast::AstNode as _;
use mauve_syntax::{TextRange, TextSize};

use crate::occurrences::{
    Definition, FoundName, OccurrenceRole, each_once, in_declaration, libraries, names_at,
};

/// A name and its definitions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Navigation {
    /// The name at the cursor.
    pub origin: TextRange,
    /// Its declarations: several for the blocks of a library, and for a key of a table with several meanings.
    pub targets: Vec<Target>,
    /// Files other than models and tables: message files, and sources of codels, which may not exist yet.
    pub files: Vec<PathBuf>,
}

/// A declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Its file.
    pub file: File,
    /// Its full range.
    pub range: TextRange,
    /// The range of its name.
    pub name: TextRange,
}

impl Target {
    /// Returns a name as a target.
    pub(crate) fn of_name(file: File, name: TextRange) -> Target {
        Target { file, range: name, name }
    }
}

/// Returns the definitions of the name at `offset`.
pub fn definition(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Option<Navigation> {
    definition_of(db, project, &names_at(db, project, file, offset))
}

/// Returns the locations of the definitions of these names; for an operation that a core calls, the executed definition.
pub(crate) fn definition_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    names: &[FoundName<'db>],
) -> Option<Navigation> {
    let targets = |name: &FoundName<'db>| {
        let of_call = name.of.filter(|_| name.role == OccurrenceRole::Call);
        let executed = of_call.and_then(|of| {
            let mut names = in_declaration(db, project, of).into_iter();
            names.find(|it| it.role == OccurrenceRole::Definition && it.definition == name.definition)
        });
        match executed {
            Some(it) => vec![Target::of_name(it.file, it.range)],
            None => targets(db, project, &name.definition),
        }
    };
    destination(names, targets, |_| None)
}

pub(crate) fn destination<'db>(
    names: &[FoundName<'db>],
    targets: impl Fn(&FoundName<'db>) -> Vec<Target>,
    file: impl Fn(&FoundName<'db>) -> Option<PathBuf>,
) -> Option<Navigation> {
    let first = names.first()?;
    let targets = each_once(names.iter().flat_map(targets));
    let files = each_once(names.iter().filter_map(file));
    let is_empty = targets.is_empty() && files.is_empty();
    (!is_empty).then_some(Navigation { origin: first.range, targets, files })
}

pub(crate) fn targets(db: &dyn ModelDb, project: Project<'_>, definition: &Definition<'_>) -> Vec<Target> {
    match definition {
        Definition::Declaration(decl) => of_declaration(db, *decl).into_iter().collect(),
        Definition::At(place) => vec![Target::of_name(place.file(db), place.range(db))],
        Definition::File(file) => vec![Target::of_name(*file, TextRange::empty(0.into()))],
        Definition::Library(library) => {
            let of_file = |&file: &File| {
                let blocks =
                    libraries(db, file).into_iter().filter(|(_, name)| name.text() == library.as_str());
                blocks.map(move |(block, name)| Target {
                    file,
                    range: block.syntax().text_range(),
                    name: name.text_range(),
                })
            };
            project_files(db, project).iter().flat_map(of_file).collect()
        }
        Definition::Package(_) | Definition::Message(..) | Definition::Type(_) => Vec::new(),
    }
}

pub(crate) fn of_declaration(db: &dyn ModelDb, decl: Decl<'_>) -> Option<Target> {
    let file = decl.file(db);
    let name = Location::name_of(decl).range(db);
    Some(Target { file, range: declaration_map(db, decl)?.range, name })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use expect_test::{Expect, expect};

    /// What is under the cursor, and where it leads: file, line and text of each target.
    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let mut shown = String::new();
        if let Some(found) = definition(&db, project_of(&db, workspace, file), file, offset) {
            shown += &format!("{}\n", &file.text(&db)[found.origin]);
            for target in found.targets {
                let text = target.file.text(&db);
                let line = text[..target.name.start().into()].matches('\n').count() + 1;
                let all = text[target.range].lines().next().unwrap_or("");
                let path = target.file.path(&db).display();
                shown += &format!("-> {path}:{line} {} | {all}\n", &text[target.name]);
            }
        }
        expected.assert_eq(&shown);
    }

    /// A project over several files with a cursor in place of `from`, the `nth` of them in its file.
    fn at(path: &str, from: &str, to: &str, expected: Expect) {
        let mut files = mauve_tests::fixture(ROBOT);
        let (_, text) = files.iter_mut().find(|(known, _)| known == path).unwrap();
        assert!(text.contains(from), "{from}");
        *text = text.replacen(from, to, 1);
        let fixture: Vec<String> = files.iter().map(|(path, text)| format!("//- {path}\n{text}")).collect();
        check(&fixture.concat(), expected);
    }

    #[test]
    fn ports_of_topics_and_instances_of_hosts() {
        let robot = "use std_msgs
shell S { output port state: String }
core C(S) { update = { } }
component Driver(S, C)
architecture A { instance left: Driver }
deployment D { architecture A  activity left { priority = 1  period = 100 } }
//- /mauve.toml
[ros2]
topics = { \"left.sta$1te\" = \"/state\" }
[host.eyes]
activities = [\"le$2ft\"]
";
        let at = |mark: &str| {
            let text = robot.replace(mark, "$0");
            ["$1", "$2"].iter().fold(text, |text, mark| text.replace(mark, ""))
        };
        check(
            &at("$1"),
            expect![[r#"
                state
                -> /model.mal:2 state | state
            "#]],
        );
        check(
            &at("$2"),
            expect![[r#"
                left
                -> /model.mal:5 left | left
            "#]],
        );
    }

    const ROBOT: &str = r#"
//- /robot.mal
include "parts.mal"
use parts
architecture Base { instance laser: parts.Laser }
architecture A {
  import Base
  instance map: Mapper
  connection laser.scan -> map.scan
  operation map.clear -> laser.wipe
  property laser.rate = 5
}
deployment D {
  architecture A
  activity laser { priority = 1 period = 100 }
  activity map { priority = 2 period = 100 }
  property map.size = 3
}
//- /parts.mal
library parts {
  // Takes a picture.
  codel shoot(out n: int): int
  shell Sensor { property rate: int }
  shell LaserShell extends Sensor { output port scan: int  require wipe(): int }
  shell MapShell { input port scan: int  provide clear(): int  property size: int }
  core LaserCore(LaserShell) {
    var n: int = 0;
    statemachine {
      var k: int = 0;
      initial state Idle { run = { shoot(n); write(scan, n + k + rate); }  transition go if (n > 0) to Busy }
      state Busy { transition back to Idle }
    }
  }
  core MapCore(MapShell) {
    var v: int;
    provide clear(): int = { var v: int = 1; v = 2; return v; }
    update = { read(scan, v); if (v > 0) then { clear(); } else { v = size; } }
  }
  component Laser(LaserShell, LaserCore)
  component Mapper(MapShell, MapCore)
}
//- /mauve.toml
[project]
root = "robot.mal"
[timing]
tables = ["times.toml"]
//- /times.toml
[codel]
"parts.shoot" = 3
[program]
"Laser/Idle.run" = 4
"#;

    #[test]
    fn a_variable_hides_the_operation_of_its_name() {
        check(
            "
shell S { provide park(): int }
core C(S) {
  var park: int = 0
  provide park(): int = { return 1; }
  update = { pa$0rk(); }
}",
            expect![[r#"
                park
                -> /model.mal:3 park | park
            "#]],
        );
    }

    #[test]
    fn types_over_files_and_libraries() {
        at(
            "/robot.mal",
            "map: Mapper",
            "map: Map$0per",
            expect![[r#"
            Mapper
            -> /parts.mal:21 Mapper | component Mapper(MapShell, MapCore)
        "#]],
        );
        at(
            "/robot.mal",
            "parts.Laser",
            "parts.$0Laser",
            expect![[r#"
                Laser
                -> /parts.mal:20 Laser | component Laser(LaserShell, LaserCore)
            "#]],
        );
        at(
            "/robot.mal",
            "parts.Laser",
            "par$0ts.Laser",
            expect![[r#"
                parts
                -> /parts.mal:1 parts | library parts {
            "#]],
        );
        at(
            "/robot.mal",
            "use parts",
            "use parts$0",
            expect![[r#"
            parts
            -> /parts.mal:1 parts | library parts {
        "#]],
        );
        at(
            "/robot.mal",
            "import Base",
            "import $0Base",
            expect![[r#"
            Base
            -> /robot.mal:3 Base | architecture Base { instance laser: parts.Laser }
        "#]],
        );
        at(
            "/robot.mal",
            "  architecture A\n",
            "  architecture A$0\n",
            expect![[r#"
            A
            -> /robot.mal:4 A | architecture A {
        "#]],
        );
        at(
            "/parts.mal",
            "extends Sensor",
            "extends Sen$0sor",
            expect![[r#"
            Sensor
            -> /parts.mal:4 Sensor | shell Sensor { property rate: int }
        "#]],
        );
        at(
            "/parts.mal",
            "LaserCore(LaserShell)",
            "LaserCore(L$0aserShell)",
            expect![[r#"
            LaserShell
            -> /parts.mal:5 LaserShell | shell LaserShell extends Sensor { output port scan: int  require wipe(): int }
        "#]],
        );
        at(
            "/parts.mal",
            "Laser(LaserShell, LaserCore)",
            "Laser(LaserShell, LaserCore$0)",
            expect![[r#"
            LaserCore
            -> /parts.mal:7 LaserCore | core LaserCore(LaserShell) {
        "#]],
        );
    }

    #[test]
    fn definitions_of_included_files() {
        at(
            "/robot.mal",
            "parts.mal",
            "par$0ts.mal",
            expect![[r#"
                parts.mal
                -> /parts.mal:1  | 
            "#]],
        );
        at(
            "/mauve.toml",
            "robot.mal",
            "robot$0.mal",
            expect![[r#"
                robot.mal
                -> /robot.mal:1  | 
            "#]],
        );
    }

    #[test]
    fn instances_and_their_features() {
        at(
            "/robot.mal",
            "activity laser",
            "activity las$0er",
            expect![[r#"
            laser
            -> /robot.mal:3 laser | laser
        "#]],
        );
        at(
            "/robot.mal",
            "laser.scan ->",
            "laser.$0scan ->",
            expect![[r#"
            scan
            -> /parts.mal:5 scan | scan
        "#]],
        );
        at(
            "/robot.mal",
            "-> map.scan",
            "-> $0map.scan",
            expect![[r#"
            map
            -> /robot.mal:6 map | map
        "#]],
        );
        at(
            "/robot.mal",
            "map.clear ->",
            "map.clear$0 ->",
            expect![[r#"
            clear
            -> /parts.mal:6 clear | clear
        "#]],
        );
        at(
            "/robot.mal",
            "laser.rate",
            "laser.r$0ate",
            expect![[r#"
            rate
            -> /parts.mal:4 rate | rate
        "#]],
        );
        at(
            "/robot.mal",
            "map.size",
            "map.si$0ze",
            expect![[r#"
            size
            -> /parts.mal:6 size | size
        "#]],
        );
    }

    #[test]
    fn names_in_programs() {
        at(
            "/parts.mal",
            "shoot(n);",
            "sho$0ot(n);",
            expect![[r#"
            shoot
            -> /parts.mal:3 shoot | codel shoot(out n: int): int
        "#]],
        );
        at(
            "/parts.mal",
            "shoot(n);",
            "shoot($0n);",
            expect![[r#"
            n
            -> /parts.mal:8 n | n
        "#]],
        );
        at(
            "/parts.mal",
            "n + k + rate",
            "n + $0k + rate",
            expect![[r#"
            k
            -> /parts.mal:10 k | k
        "#]],
        );
        at(
            "/parts.mal",
            "n + k + rate",
            "n + k + ra$0te",
            expect![[r#"
            rate
            -> /parts.mal:4 rate | rate
        "#]],
        );
        at(
            "/parts.mal",
            "write(scan",
            "write(sc$0an",
            expect![[r#"
            scan
            -> /parts.mal:5 scan | scan
        "#]],
        );
        at(
            "/parts.mal",
            "to Busy",
            "to Bu$0sy",
            expect![[r#"
            Busy
            -> /parts.mal:12 Busy | Busy
        "#]],
        );
        at(
            "/parts.mal",
            "clear(); }",
            "cle$0ar(); }",
            expect![[r#"
            clear
            -> /parts.mal:17 clear | clear
        "#]],
        );
        at(
            "/parts.mal",
            "provide clear(): int =",
            "provide cl$0ear(): int =",
            expect![[r#"
            clear
            -> /parts.mal:6 clear | clear
        "#]],
        );
        // The nearest of two variables of one name.
        at(
            "/parts.mal",
            "v = 2",
            "v$0 = 2",
            expect![[r#"
            v
            -> /parts.mal:17 v | v
        "#]],
        );
        at(
            "/parts.mal",
            "v = size",
            "v$0 = size",
            expect![[r#"
            v
            -> /parts.mal:16 v | v
        "#]],
        );
        at(
            "/parts.mal",
            "v = size",
            "v = si$0ze",
            expect![[r#"
            size
            -> /parts.mal:6 size | size
        "#]],
        );
    }

    #[test]
    fn ports_and_variables_of_one_name_are_told_apart() {
        const SHELL: &str = "shell S { output port out: int  require far(): int }\n";
        // The port of a built-in function is not the variable of its name; its value is.
        let program = "core C(S) { var out: int = 0; update = { write(out, out); } }";
        check(
            &format!("{SHELL}{}", program.replace("write(out", "write($0out")),
            expect![[r#"
            out
            -> /model.mal:1 out | out
        "#]],
        );
        check(
            &format!("{SHELL}{}", program.replace(", out)", ", $0out)")),
            expect![[r#"
            out
            -> /model.mal:2 out | out
        "#]],
        );
        check(&format!("{SHELL}{}", program.replace("write(", "wri$0te(")), expect![[r#""#]]);
        // Hooks see the core's variables, programs of the machine its own.
        let program = "core C(S) { var v: int; handler h: far start = { v = 1; collect(h); }\n\
                       statemachine { var v: int; initial state A { run = { v = 2; } } } }";
        check(
            &format!("{SHELL}{}", program.replace("v = 1", "$0v = 1")),
            expect![[r#"
            v
            -> /model.mal:2 v | v
        "#]],
        );
        check(
            &format!("{SHELL}{}", program.replace("v = 2", "$0v = 2")),
            expect![[r#"
            v
            -> /model.mal:3 v | v
        "#]],
        );
        check(
            &format!("{SHELL}{}", program.replace("(h)", "($0h)")),
            expect![[r#"
            h
            -> /model.mal:2 h | h
        "#]],
        );
    }

    #[test]
    fn keys_of_timing_tables() {
        at(
            "/times.toml",
            "parts.shoot",
            "parts.sh$0oot",
            expect![[r#"
                shoot
                -> /parts.mal:3 shoot | codel shoot(out n: int): int
            "#]],
        );
        at(
            "/times.toml",
            "Idle.run",
            "Idle.r$0un",
            expect![[r#"
                run
                -> /parts.mal:11 run | run
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check("architecture A { instance pilot: $0", expect![[r#""#]]);
        check(
            "codel f(): int core C(S) { update = { if (f$0( }",
            expect![[r#"
            f
            -> /model.mal:1 f | codel f(): int
        "#]],
        );
        check("$0", expect![[r#""#]]);
    }
}
