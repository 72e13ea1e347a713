//! Completion of types, messages and declarations by name, with the necessary `use`.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{Data, Kind, Name};
use mauve_hir::{
    C_TYPES, Decl, LANGUAGE_TYPES, Package, Type, config_of, data, names_of, package, used_packages,
};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::format::Replacement;
use mauve_syntax::{SyntaxNode, TextRange, TextSize, comments_above, previous_token};

use super::{Completer, Completion, CompletionKind, Subject};
use crate::program::{parameters_text, result_text};

/// The maximal number of offered items that need a `use`.
const MOST_TO_USE: usize = 50;

impl<'db> Completer<'_, 'db> {
    /// Offers types of a value after `path`; for a result, also `void`.
    pub(super) fn types(&mut self, path: &[&str], is_result: bool) {
        let workspace = self.project.workspace(self.db);
        if let Some((of, rest)) = path.split_first() {
            if *of == "ctypes" {
                self.scalars();
            }
            let package = package(self.db, workspace, &(*of).into());
            if let Some(package) = package.filter(|_| rest.is_empty() || rest == ["msg"]) {
                for name in package.messages.keys() {
                    self.add(message(package, name));
                }
            }
            return;
        }
        for (name, _) in LANGUAGE_TYPES.iter().filter(|(_, ty)| is_result || *ty != Type::Void) {
            self.add(Completion::new(CompletionKind::BuiltInType, *name));
        }
        for ty in &config_of(self.db, workspace).types {
            self.add(Completion::new(CompletionKind::BuiltInType, ty.name.as_str()).note(ty.cpp.as_str()));
        }
        let used = used_packages(self.db, self.project).get(&self.library).map_or(&[][..], Vec::as_slice);
        let mut seen: BTreeSet<&Name> = BTreeSet::new();
        for package in used.iter().filter_map(|name| package(self.db, workspace, name)) {
            for name in package.messages.keys() {
                let item = message(package, name);
                // Of two messages of one name, the name resolves to that of the first package.
                let is_hidden = !seen.insert(name);
                let qualified = format!("{}.{name}", package.name);
                self.add(if is_hidden { item.insert(qualified).rank(2) } else { item });
            }
        }
        if used.iter().any(|name| name == "ctypes") || !self.at.prefix.is_empty() {
            self.scalars();
        }
        self.unused_messages(used);
        for name in self.packages() {
            let note = "message package";
            self.add(Completion::new(CompletionKind::Library, name.as_str()).note(note).rank(4));
        }
    }

    fn scalars(&mut self) {
        for (name, _) in &C_TYPES {
            self.add(Completion::new(CompletionKind::BuiltInType, *name).note("ctypes").rank(3));
        }
    }

    /// Offers messages of packages that the library does not use, with the `use`.
    fn unused_messages(&mut self, used: &[Name]) {
        let workspace = self.project.workspace(self.db);
        let mut count = 0;
        for of in self.packages().into_iter().filter(|of| !used.contains(of)) {
            let Some(package) = package(self.db, workspace, &of) else { continue };
            for name in package.messages.keys() {
                if self.is_asked_for(name) && count < MOST_TO_USE {
                    count += 1;
                    let item = message(package, name).rank(5);
                    self.add_using(item, &of);
                }
            }
        }
    }

    /// Offers declarations of this kind after `path`: those in scope, and those that a `use` brings into scope.
    pub(super) fn declared(&mut self, kind: Kind, path: &[&str]) {
        let names = names_of(self.db, self.project);
        let own = self.library.clone();
        if let [of] = path {
            let of = Some(Name::from(*of));
            for decl in names.of_kind(self.db, kind) {
                if *decl.library(self.db) == of {
                    self.add_declared(decl);
                }
            }
            return;
        }
        if !path.is_empty() {
            return;
        }
        let visible: BTreeSet<&Name> = names.visible(own.as_ref()).collect();
        let (mut seen, mut count) = (BTreeSet::new(), 0);
        for decl in names.of_kind(self.db, kind) {
            let (library, name) = (decl.library(self.db), decl.name(self.db));
            // A declaration cannot extend or import itself.
            if name.is_empty() || Some(decl) == self.decl {
                continue;
            }
            let is_own = *library == own;
            if is_own || library.as_ref().is_some_and(|library| visible.contains(library)) {
                let is_hidden =
                    !is_own && (!names.in_library(own.as_ref(), kind, name).is_empty() || !seen.insert(name));
                match is_hidden {
                    // A codel has no qualified name.
                    true if kind == Kind::Codel => {}
                    true => {
                        let qualified = decl.qualified(self.db);
                        self.add(self.of_declaration(decl).insert(qualified).rank(2));
                    }
                    false => self.add_declared(decl),
                }
            } else if let Some(library) = library
                && self.is_asked_for(name)
                && count < MOST_TO_USE
            {
                count += 1;
                let item = self.of_declaration(decl).rank(5);
                self.add_using(item, library);
            }
        }
        if kind != Kind::Codel {
            // Libraries with a declaration of this kind, other than the present declaration.
            let fitting = names.of_kind(self.db, kind).filter(|it| Some(*it) != self.decl);
            let libraries: BTreeSet<&Name> = fitting.filter_map(|it| it.library(self.db).as_ref()).collect();
            for name in libraries.into_iter().filter(|&name| Some(name) != own.as_ref()) {
                let item = Completion::new(CompletionKind::Library, name.as_str()).note("library");
                self.add(item.rank(4));
            }
        }
    }

    fn add_declared(&mut self, decl: Decl<'db>) {
        let item = self.of_declaration(decl);
        if !item.label.is_empty() {
            self.add(item);
        }
    }

    pub(super) fn of_declaration(&self, decl: Decl<'db>) -> Completion {
        let db = self.db;
        let (kind, detail) = match data(db, decl).as_deref() {
            Some(Data::Codel(it)) => {
                let detail =
                    format!("{}{}", parameters_text(&it.parameters), result_text(it.result.as_ref()));
                (CompletionKind::Codel, detail)
            }
            Some(Data::Shell(_)) => (CompletionKind::Shell, String::new()),
            Some(Data::Core(it)) => {
                let shell = it.shell.as_ref();
                (CompletionKind::Core, shell.map_or_else(String::new, |shell| format!("({shell})")))
            }
            Some(Data::Component(it)) => {
                let ends =
                    [&it.shell, &it.core].map(|end| end.as_ref().map_or("?".into(), ToString::to_string));
                (CompletionKind::Component, format!("({})", ends.join(", ")))
            }
            _ => (CompletionKind::Architecture, String::new()),
        };
        let library = decl.library(db).as_ref().filter(|library| Some(*library) != self.library.as_ref());
        Completion::new(kind, decl.name(db).as_str())
            .detail(detail)
            .note(library.map_or("", Name::as_str))
            .subject(Subject::of(db, decl, None))
    }

    pub(super) fn add_using(&mut self, mut item: Completion, of: &str) {
        item.note = format!("use {of}");
        item.more.push(self.use_edit(of));
        self.add(item);
    }

    /// Returns the edit that inserts `use of` after the last `use` of the block around the cursor, or at its beginning.
    fn use_edit(&self, of: &str) -> Replacement {
        let word = self.at.word.start();
        let library = self.at.around(LIBRARY);
        let block = library.clone().or_else(|| self.at.list.ancestors().last());
        let block = block.unwrap_or_else(|| self.at.list.clone());
        let earlier = || block.children().filter(|node| node.text_range().end() <= word);
        let of_kind = |kind| earlier().filter(|node| node.kind() == kind).last();
        if let Some(last) = of_kind(USE).or_else(|| of_kind(INCLUDE)) {
            let text = match line_start(&last) {
                Some(indent) => format!("\n{indent}use {of}"),
                None => format!(" use {of}"),
            };
            return insertion(last.text_range().end(), text);
        }
        let brace = library.and_then(|library| {
            let mut tokens = library.children_with_tokens().filter_map(|it| it.into_token());
            tokens.find(|token| token.kind() == L_CURLY)
        });
        match brace {
            Some(brace) => {
                let indent = line_start(&block).unwrap_or_default();
                insertion(brace.text_range().end(), format!("\n{indent}  use {of}\n"))
            }
            None => {
                let first = block.children().next().map(|node| {
                    let comment = comments_above(&node).last();
                    comment.map_or(node.text_range(), |comment| comment.text_range()).start()
                });
                insertion(first.filter(|first| *first <= word).unwrap_or_default(), format!("use {of}\n"))
            }
        }
    }
}

fn insertion(at: TextSize, text: String) -> Replacement {
    Replacement { range: TextRange::empty(at), text }
}

fn line_start(node: &SyntaxNode) -> Option<String> {
    let Some(before) = previous_token(&node.first_token()?) else { return Some(String::new()) };
    let (_, indent) = before.text().rsplit_once('\n').filter(|_| before.kind() == WHITESPACE)?;
    Some(indent.to_owned())
}

fn message(package: &Package, name: &Name) -> Completion {
    Completion::new(CompletionKind::Message, name.as_str())
        .note(package.name.as_str())
        .subject(Subject::Message { package: package.name.clone(), name: name.clone() })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::expect;

    #[test]
    fn a_message_brings_its_use() {
        let text = "library a {\n  use std_msgs\n\n  shell S {\n    input port p: Twi$0\n  }\n}\n";
        expect![[r#"
            5 Twist (use geometry_msgs) + "\n  use geometry_msgs" at 26
        "#]]
        .assert_eq(
            &offered(text, 9)
                .lines()
                .filter(|line| line.contains("Twist "))
                .map(|line| format!("{line}\n"))
                .collect::<String>(),
        );
        // In a block without a `use`, the new one is the first; a one-line block stays on one line; outside libraries,
        // the new one is the first of the file.
        for (text, expected) in [
            (
                "library a {\n  shell S { input port p: Joy$0 }\n}\n",
                expect![[r#"
                5 Joy (use sensor_msgs) + "\n  use sensor_msgs\n" at 11
            "#]],
            ),
            (
                "library a { use std_msgs shell S { input port p: Joy$0 } }",
                expect![[r#"
                5 Joy (use sensor_msgs) + " use sensor_msgs" at 24
            "#]],
            ),
            (
                "// A robot.\ncodel f(in a: Joy$0): int",
                expect![[r#"
                5 Joy (use sensor_msgs) + "use sensor_msgs\n" at 0
            "#]],
            ),
        ] {
            expected.assert_eq(
                &offered(text, 9)
                    .lines()
                    .filter(|line| line.contains("Joy "))
                    .map(|line| format!("{line}\n"))
                    .collect::<String>(),
            );
        }
    }

    #[test]
    fn types_of_the_language_and_of_mauve_toml() {
        let text = "library a { codel f(): $0 }\n//- /mauve.toml\n[types.Laser]\ncpp = \"laser::Handle*\"\n";
        expect![[r#"
            1 bool
            1 int
            1 double
            1 float
            1 string
            1 void
            1 port_status
            1 call_status
            1 Laser (laser::Handle*)
        "#]]
        .assert_eq(&offered(text, 3));
        assert!(!labels("codel f(in a: $0)").contains(&"void".to_owned()));
    }

    #[test]
    fn libraries_that_have_what_fits() {
        let libraries = "library shells { shell S { } } library cores { core C(S) { } }\n\
             library components { component M(S, C) } library architectures { architecture A { } } library none { }\n";
        let offered = |text: &str| {
            let known = ["shells", "cores", "components", "architectures", "none"];
            let all = labels(&format!("{libraries}{text}"));
            all.into_iter().filter(|label| known.contains(&label.as_str())).collect::<Vec<_>>()
        };
        for (text, expected) in [
            ("library own { shell T extends $0 }", "shells"),
            ("library own { core C($0) { } }", "shells"),
            ("library own { component N($0, C) }", "shells"),
            ("library own { component N(S, $0) }", "cores"),
            ("library own { architecture B { instance m: $0 } }", "components"),
            ("library own { architecture B { import $0 } }", "architectures"),
            ("library own { deployment D { architecture $0 } }", "architectures"),
        ] {
            assert_eq!(offered(text), [expected], "{text}");
        }
    }

    #[test]
    fn behind_a_package_stand_its_messages() {
        for path in ["builtin_interfaces.", "builtin_interfaces::", "builtin_interfaces.msg."] {
            assert_eq!(labels(&format!("codel f(in a: {path}$0): int")), ["Duration", "Time"], "{path}");
        }
    }
}
