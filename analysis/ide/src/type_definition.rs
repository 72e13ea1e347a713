//! Go to type definition: the message file of a value, the component of an instance, the operation of a handler, the shell of a
//! component or a core, the architecture of a deployment.

use std::path::PathBuf;

use mauve_hir::{File, Location, ModelDb, Project, node_around, package};
use mauve_syntax::SyntaxKind::{RESULT_TYPE, TARGET, TYPE};
use mauve_syntax::TextSize;
use mauve_syntax::ast::{self, AstNode as _};

use crate::definition::{Navigation, destination, targets};
use crate::occurrences::{Definition, FoundName, definition_of_type, names_at};

/// Returns the type definition of the name at `offset`; `None` for built-in types.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "shell S { } core C(S) { } component P(S, C) architecture A { instance pilot: P }".to_owned();
/// let (pilot, component) = (text.find("pilot").unwrap() as u32, text.find("P(").unwrap() as u32);
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = mauve_ide::type_definition(&db, projects(&db, workspace)[0], file, pilot.into()).unwrap();
/// assert_eq!(u32::from(found.targets[0].name.start()), component);
/// ```
pub fn type_definition(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Option<Navigation> {
    let names = names_at(db, project, file, offset);
    let of_type = |name: &FoundName<'_>| {
        type_of(db, project, &name.definition).map_or_else(Vec::new, |ty| targets(db, project, &ty))
    };
    destination(&names, of_type, |name| message_file(db, project, &name.definition))
}

fn message_file(db: &dyn ModelDb, project: Project<'_>, definition: &Definition<'_>) -> Option<PathBuf> {
    let ty = match definition {
        Definition::Message(..) => Some(definition.clone()),
        _ => type_of(db, project, definition),
    };
    let Some(Definition::Message(of, name)) = ty else { return None };
    package(db, project.workspace(db), &of)?.messages.get(&name)?.path.clone()
}

/// Returns the definition of the type that is written behind a declared name; of a component, its shell.
fn type_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    definition: &Definition<'db>,
) -> Option<Definition<'db>> {
    let name = definition.place().filter(|it| matches!(it, Location::Source(..)))?;
    let file = name.file(db);
    let node = node_around(db, file, name.range(db))?;
    let mut parts = node.children().filter(|it| matches!(it.kind(), TYPE | RESULT_TYPE | TARGET));
    let part = parts.next()?;
    let ty = ast::Type::cast(part.clone()).or_else(|| part.children().find_map(ast::Type::cast))?;
    definition_of_type(db, project, file, &ty)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of, shown, with_cursor};
    use expect_test::{Expect, expect};
    use mauve_hir::Workspace;

    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        expected.assert_eq(&shown(&db, type_definition(&db, project_of(&db, workspace, file), file, offset)));
    }

    const ROBOT: &str = r#"
use std_msgs
codel shoot(out n: std_msgs.Int32): int
shell Laser { output port scan: Int32 require wipe(i: String): int }
core Sweep(Laser) { var n: Int32 handler h: wipe update = { /* 🦀 é */ shoot(n); h = send(wipe); } }
component Sick(Laser, Sweep)
architecture A { instance laser: Sick }
deployment D { architecture A activity laser { priority = 1 period = 100 } }
"#;

    fn at(from: &str, expected: Expect) {
        check(&with_cursor(ROBOT, from), expected);
    }

    #[test]
    fn of_everything_that_has_a_type() {
        at(
            "activity las$0er",
            expect![[r#"
            /model.mal:5 Sick | component Sick(Laser, Sweep)
        "#]],
        );
        at("h = $0send", expect![[r#""#]]);
        at(
            "handler $0h",
            expect![[r#"
            /model.mal:3 wipe | wipe
        "#]],
        );
        at(
            "$0h = send",
            expect![[r#"
            /model.mal:3 wipe | wipe
        "#]],
        );
        at(
            "component Si$0ck",
            expect![[r#"
            /model.mal:3 Laser | shell Laser { output port scan: Int32 require wipe(i: String): int }
        "#]],
        );
        at(
            "core Swe$0ep",
            expect![[r#"
            /model.mal:3 Laser | shell Laser { output port scan: Int32 require wipe(i: String): int }
        "#]],
        );
        at(
            "deployment $0D",
            expect![[r#"
            /model.mal:6 A | architecture A { instance laser: Sick }
        "#]],
        );
        // A message that is built in has no file, and `int` is no declaration.
        at("shoot($0n)", expect![[r#""#]]);
        at("codel sh$0oot", expect![[r#""#]]);
    }

    #[test]
    fn the_file_of_a_message() {
        use mauve_hir::Package;
        use std::sync::Arc;
        for from in ["shoot($0n)", "var $0n", "out $0n", "port sc$0an", "std_msgs.In$0t32", "scan: In$0t32"] {
            let cursor = from.replace("$0", "");
            let Fixture { db, workspace, file, offset } = Fixture::new(&ROBOT.replacen(&cursor, from, 1));
            let mut message = mauve_hir::read_message("int32 data");
            message.path = Some("/opt/ros/std_msgs/msg/Int32.msg".into());
            let messages = [("Int32".into(), message)].into();
            let package = Package { name: "std_msgs".into(), messages };
            // The packages are found by whoever reads the disk.
            let installed = Workspace::new(
                &db,
                workspace.folder(&db).clone(),
                workspace.files(&db).clone(),
                Vec::new(),
                Vec::new(),
                Vec::new(),
                Arc::new([("std_msgs".into(), Arc::new(package))].into()),
            );
            let found = type_definition(&db, project_of(&db, installed, file), file, offset).unwrap();
            assert_eq!(found.files, [PathBuf::from("/opt/ros/std_msgs/msg/Int32.msg")], "{from}");
        }
    }

    #[test]
    fn while_the_text_is_broken() {
        check("core $0C(", expect![[r#""#]]);
        check("architecture A { instance $0a: }", expect![[r#""#]]);
        check("$0", expect![[r#""#]]);
    }
}
