//! Converts `update = { … }` to a state machine with one state, and back.
//!
//! Both execute the same: one period of a state machine executes `run`, and without a transition then `handle`
//! (`hir/src/behaviour.rs` lowers `update` to the `run` of a single state). The keys of the program's times in timing tables change
//! as well.

use mauve_hir::item_tree::{Kind, MethodKind};
use mauve_hir::{
    Decl, File, ModelDb, ProgramId, ProgramKey, Project, Workspace, core_of, declaration_at, names_of,
    projects,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{NodeOrToken, SyntaxKind, SyntaxNode, TextRange, is_whole};
use mauve_wcrt::{table, table_files};

use super::{Actions, indentation};
use crate::Change;
use crate::occurrences::each_once;
use crate::project::name_of_root;

const STATE: &str = "Running";

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    let conversion =
        Conversion { db: actions.db, workspaces: actions.workspaces, file: actions.question.file };
    let Some(core) = actions.node::<ast::Core>().filter(|it| is_whole(it.syntax())) else { return };
    let Some(word) = actions.selected_name() else { return };
    let Some(parent) = word.parent() else { return };
    if let Some(hook) = ast::Hook::cast(parent.clone()).filter(|it| it.update_token().as_ref() == Some(&word))
    {
        actions.refactor("Convert to a state machine", |_| conversion.to_machine(&core, &hook));
    }
    if let Some(machine) = ast::StateMachine::cast(parent) {
        actions.refactor("Convert to `update`", |_| conversion.to_update(&core, &machine));
    }
}

/// A conversion in a file, with the workspaces whose timing tables may have a time of the program.
struct Conversion<'a, 'db> {
    db: &'db dyn ModelDb,
    workspaces: &'a [Workspace],
    file: File,
}

impl Conversion<'_, '_> {
    fn to_machine(&self, core: &ast::Core, hook: &ast::Hook) -> Option<Result<Change, String>> {
        let (db, file) = (self.db, self.file);
        if behaviours(core) != 1 {
            return None;
        }
        let (text, block) = (file.text(db), hook.block()?);
        let indent = indentation(text, hook.syntax().text_range().start());
        let head = TextRange::new(hook.syntax().text_range().start(), block.syntax().text_range().start());
        let opening = format!("statemachine {{\n{indent}  initial state {STATE} {{\n{indent}    run = ");
        let comments = comments_in(hook.syntax(), head);
        let mut edits = vec![Replacement { range: head, text: comments + &opening }];
        // The lines of the program move with it.
        for (line, at) in lines_within(text, block.syntax()) {
            if !line.trim().is_empty() {
                edits.push(Replacement { range: TextRange::empty(at), text: "    ".to_owned() });
            }
        }
        let end = TextRange::empty(block.syntax().text_range().end());
        edits.push(Replacement { range: end, text: format!("\n{indent}  }}\n{indent}}}") });
        let keys = self.renamed_keys(
            declaration_at(db, file, core.syntax().text_range())?,
            &ProgramId::UPDATE,
            &ProgramId::Method { state: STATE.into(), kind: MethodKind::Run },
        );
        keys.map(|keys| with_keys(file, edits, keys)).transpose()
    }

    fn to_update(&self, core: &ast::Core, machine: &ast::StateMachine) -> Option<Result<Change, String>> {
        let (db, file) = (self.db, self.file);
        let refused = |why: &str| Some(Err(why.to_owned()));
        let states: Vec<ast::State> = machine.syntax().children().filter_map(ast::State::cast).collect();
        let [state] = states.as_slice() else { return refused("the state machine has several states") };
        if behaviours(core) != 1 || state.initial_token().is_none() {
            return None;
        }
        if machine.state_machine_items().count() > 1 {
            return refused("its variables would become visible in the other programs of the core");
        }
        let mut method = None;
        for item in state.state_items() {
            match item {
                ast::StateItem::Transition(_) => return refused("its state has a transition"),
                ast::StateItem::Method(it) if it.entry_token().is_some() || it.exit_token().is_some() => {
                    return refused("its state has an `entry` or an `exit`");
                }
                ast::StateItem::Method(it) if method.is_none() => method = Some(it),
                ast::StateItem::Method(_) => return refused("its state has two programs"),
            }
        }
        let Some(method) = method else { return refused("its state has no program") };
        let (text, block) = (file.text(db), method.block()?);
        let inside = block.syntax().text_range();
        let all = machine.syntax().text_range();
        let outside = machine.syntax().descendants_with_tokens().filter_map(NodeOrToken::into_token);
        if outside.filter(|it| !inside.contains_range(it.text_range())).any(|it| it.kind().is_comment()) {
            return refused("comments around its program would be removed");
        }
        let head = TextRange::new(all.start(), inside.start());
        let mut edits = vec![Replacement { range: head, text: "update = ".to_owned() }];
        // Its lines go to the left by as much as the last one, the brace, has to.
        let outer = indentation(text, all.start()).len();
        let inner = indentation(text, method.syntax().text_range().start()).len();
        for (line, at) in lines_within(text, block.syntax()) {
            let blanks = line.len() - line.trim_start_matches([' ', '\t']).len();
            let less = inner.saturating_sub(outer).min(blanks);
            if less > 0 {
                let range = TextRange::at(at, (less as u32).into());
                edits.push(Replacement { range, text: String::new() });
            }
        }
        edits.push(Replacement { range: TextRange::new(inside.end(), all.end()), text: String::new() });
        let kind = MethodKind::from_keyword(method.own_token()?.text())?;
        let from = ProgramId::Method { state: state.name()?.syntax().text().to_string().into(), kind };
        let core = declaration_at(db, file, core.syntax().text_range())?;
        let keys = self.renamed_keys(core, &from, &ProgramId::UPDATE);
        keys.map(|keys| with_keys(file, edits, keys)).transpose()
    }

    /// Returns the change that renames the keys of a program of `core` in timing tables.
    ///
    /// # Errors
    ///
    /// Why a time would be dropped, or assigned to another program. Projects share tables: the key must have the same meaning in
    /// every project that reads a table.
    fn renamed_keys(&self, core: Decl<'_>, from: &ProgramId, to: &ProgramId) -> Result<Change, String> {
        let (db, workspaces) = (self.db, self.workspaces);
        let mut change = Change::default();
        let files = workspaces.iter().flat_map(|&it| &table_files(db, it).files);
        for file in each_once(files.copied()) {
            let path = file.path(db).file_name().unwrap_or_default().display().to_string();
            let readers = workspaces.iter().filter(|it| table_files(db, **it).files.contains(&file));
            let readers: Vec<Project<'_>> = readers.flat_map(|&it| projects(db, it)).copied().collect();
            let is_of_core = |project: Project<'_>, it: Decl<'_>| core_of(db, project, it) == Some(core);
            let has_component = |&project: &Project<'_>| {
                names_of(db, project).of_kind(db, Kind::Component).any(|it| is_of_core(project, it))
            };
            if (table(db, file).lost || file.problem(db).is_some()) && readers.iter().any(has_component) {
                return Err(format!("{path} is unreadable, and may contain a time of this program"));
            }
            for entry in &table(db, file).programs {
                let Some(ProgramKey { component, program }) = ProgramKey::parse(&entry.key) else { continue };
                if program != *from && program != *to {
                    continue;
                }
                let (mut is_of_it, mut other) = (false, None);
                for &project in &readers {
                    let names = names_of(db, project);
                    let found = names.by_key(Kind::Component, component);
                    is_of_it |= found.iter().any(|&it| is_of_core(project, it));
                    let is_unsure = found.is_empty()
                        && (names.completeness.is_incomplete() || names.incomplete_file.is_some());
                    if is_unsure || found.iter().any(|&it| !is_of_core(project, it)) {
                        other.get_or_insert(project);
                    }
                }
                if !is_of_it {
                    continue;
                }
                let key = &entry.key;
                if program == *to {
                    return Err(format!("`{key}` already exists in {path}"));
                }
                if let Some(project) = other {
                    let root = name_of_root(db, project, &readers);
                    let what = "the time of another program in the project of";
                    return Err(format!("`{key}` in {path} may be {what} {root}"));
                }
                let from_key = from.to_string();
                // A key with a `/` is quoted; a dotted key or a key with escapes cannot be replaced.
                let written = file.text(db).get(entry.key_span.clone()).unwrap_or_default();
                let inner = written.strip_suffix(['"', '\'']).unwrap_or(written);
                let Some(before) = inner.strip_suffix(&*from_key).filter(|before| before.ends_with('/'))
                else {
                    return Err(format!(
                        "`{key}` is written with dots or escapes in {path}: quote it as one key"
                    ));
                };
                let start = (entry.key_span.start + before.len()) as u32;
                let range = TextRange::at(start.into(), (from_key.len() as u32).into());
                if !change.replace(file, Replacement { range, text: to.to_string() }) {
                    return Err(format!("`{key}` is in {path} twice"));
                }
            }
        }
        Ok(change)
    }
}

fn behaviours(core: &ast::Core) -> usize {
    let is_behaviour = |it: &ast::CoreItem| match it {
        ast::CoreItem::Hook(it) => it.update_token().is_some(),
        ast::CoreItem::StateMachine(_) => true,
        _ => false,
    };
    core.core_items().filter(is_behaviour).count()
}

fn comments_in(node: &SyntaxNode, range: TextRange) -> String {
    let tokens = node.descendants_with_tokens().filter_map(NodeOrToken::into_token);
    let comments: Vec<String> = tokens
        .filter(|it| it.kind().is_comment() && range.contains_range(it.text_range()))
        .map(|it| {
            if it.text().starts_with("//") {
                format!("{}\n", it.text().trim_end())
            } else {
                format!("{} ", it.text())
            }
        })
        .collect();
    comments.concat()
}

/// The lines that begin within `node`, but not within a token that has several.
fn lines_within<'a>(text: &'a str, node: &SyntaxNode) -> Vec<(&'a str, mauve_syntax::TextSize)> {
    let tokens = node.descendants_with_tokens().filter_map(NodeOrToken::into_token);
    let breaks = tokens.filter(|it| it.kind() == SyntaxKind::WHITESPACE && it.text().contains('\n'));
    let mut lines = Vec::new();
    for token in breaks {
        for (at, _) in token.text().match_indices('\n') {
            let start = token.text_range().start() + mauve_syntax::TextSize::new(at as u32 + 1);
            let rest = text.get(usize::from(start)..).unwrap_or_default();
            lines.push((rest.lines().next().unwrap_or_default(), start));
        }
    }
    lines
}

fn with_keys(file: File, edits: Vec<Replacement>, keys: Change) -> Option<Change> {
    let mut change = Change::of(file, edits)?;
    change.join(keys).then_some(change)
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn to_a_state_machine_with_its_keys_in_the_tables() {
        check(
            "codel f(): void\nshell S { }\ncore C(S) {\n  // Each period.\n  $0update = {\n    f();\n    /* two\n lines */\n    f();\n  }\n}\n\
             core D(S) { update = { } }\ncomponent K(S, C)\ncomponent L(S, D)\n\
             //- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n//- /times.toml\n[program]\n\"L/update\" = 2\n\"K/update\" = 3\n",
            "Convert to a state machine",
            expect![[r#"
                --- /model.mal
                  statemachine {
                    initial state Running {
                      run = {
                        f();
                        /* two
                 lines */
                        f();
                      }
                    }
                --- /times.toml
                "K/Running.run" = 3
            "#]],
        );
        check(
            "shell S { }\ncore C(S) { $0update /* 🦀 é */ = { } }\n",
            "Convert to a state machine",
            expect![[r#"
                --- /model.mal
                core C(S) { /* 🦀 é */ statemachine {
                  initial state Running {
                    run = { }
                  }
                } }
            "#]],
        );
        check(
            "shell S { }\ncore C(S) { $0update = { f( } }\n",
            "Convert to",
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "shell S { }\ncore C(S) { $0update = { } statemachine { } }\n",
            "Convert to",
            expect![[r#"
            not offered
        "#]],
        );
    }

    fn back(machine: &str, expected: expect_test::Expect) {
        let text = format!(
            "codel f(): void\nshell S {{ }}\ncore C(S) {{\n  {machine}\n}}\ncomponent K(S, C)\n\
             //- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n//- /times.toml\n[program]\n\"K/A.handle\" = 3\n"
        );
        check(&text, "Convert to `update`", expected);
    }

    #[test]
    fn a_machine_with_one_state_becomes_an_update() {
        back(
            "$0statemachine {\n    initial state A {\n      handle = {\n        f();\n        if true then { return; } else { }\n      }\n    }\n  }",
            expect![[r#"
                --- /model.mal
                  update = {
                    f();
                    if true then { return; } else { }
                --- /times.toml
                "K/update" = 3
            "#]],
        );
        back(
            "$0statemachine { initial state A { run = { } handle = { } } }",
            expect![[r#"
            refused: its state has two programs
        "#]],
        );
        back(
            "$0statemachine { initial state A { run = { } transition again to A } }",
            expect![[r#"
            refused: its state has a transition
        "#]],
        );
        back(
            "$0statemachine { initial state A { run = { } entry = { } } }",
            expect![[r#"
            refused: its state has an `entry` or an `exit`
        "#]],
        );
        back(
            "$0statemachine { var n: int = 0 initial state A { run = { } } }",
            expect![[r#"
                refused: its variables would become visible in the other programs of the core
            "#]],
        );
        back(
            "$0statemachine { /* one */ initial state A { run = { } } }",
            expect![[r#"
                refused: comments around its program would be removed
            "#]],
        );
        back(
            "$0statemachine { initial state A { run = { } } state B { } }",
            expect![[r#"
                refused: the state machine has several states
            "#]],
        );
    }

    /// A machine with one state, that two roots have, with `other` in the second.
    fn shared(other: &str, table: &str, expected: expect_test::Expect) {
        let text = format!(
            "include \"parts.mal\"\ncomponent K(S, C)\n//- /parts.mal\nshell S {{ }}\ncore C(S) {{ statemachine {{ initial state A {{ run = {{ }} }} }} }}\n\
             //- /other.mal\n{other}\n//- /mauve.toml\n[project]\nroots = [\"model.mal\", \"other.mal\"]\n[timing]\ntables = [\"times.toml\"]\n\
             //- /times.toml\n{table}\n"
        );
        check(&text.replacen("statemachine", "$0statemachine", 1), "Convert to `update`", expected);
    }

    #[test]
    fn no_time_is_lost() {
        let key = "[program]\n\"K/A.run\" = 3";
        for other in ["shell T { }", "include \"parts.mal\"\ncomponent K(S, C)"] {
            shared(
                other,
                key,
                expect![[r#"
                    --- /parts.mal
                    core C(S) { update = { } }
                    --- /times.toml
                    "K/update" = 3
                "#]],
            );
        }
        shared(
            "shell T { }\ncore D(T) { statemachine { initial state A { run = { } } } }\ncomponent K(T, D)",
            key,
            expect![[r#"
                refused: `K/A.run` in times.toml may be the time of another program in the project of other.mal
            "#]],
        );
        shared(
            "include \"lost.mal\"",
            key,
            expect![[r#"
                refused: `K/A.run` in times.toml may be the time of another program in the project of other.mal
            "#]],
        );
        shared(
            "shell T { }",
            "[program]\n\"K/A.ru\\u006e\" = 3",
            expect![[r#"
                refused: `K/A.run` is written with dots or escapes in times.toml: quote it as one key
            "#]],
        );
        shared(
            "shell T { }",
            "[program.\"K/A\"]\nrun = 3",
            expect![[r#"
                refused: `K/A.run` is written with dots or escapes in times.toml: quote it as one key
            "#]],
        );
        shared(
            "shell T { }",
            &format!("{key}\n\"K/update\" = 4"),
            expect![[r#"
                refused: `K/update` already exists in times.toml
            "#]],
        );
        shared(
            "shell T { }",
            "[program\n",
            expect![[r#"
                refused: times.toml is unreadable, and may contain a time of this program
            "#]],
        );
    }
}
