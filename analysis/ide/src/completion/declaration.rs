//! Completion of declarations in a file and in a library.

use std::collections::{BTreeSet, HashSet};

use mauve_hir::item_tree::{Direction, Kind, Name};
use mauve_hir::{bases_of, catalogue_of, core_of, names_of, shell_of};
use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::ast::{self, AstNode as _};

use super::{Completer, Completion, CompletionKind, may_be};

impl Completer<'_, '_> {
    /// Completes a declaration, or its header before the `{`.
    pub(super) fn declaration(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [] if path.is_empty() => self.declarations(),
            [USE_KW] => self.use_(),
            [CODEL_KW, _, L_PAREN, ..] => self.signature(kinds, path),
            [SHELL_KW, _] => self.keyword("extends"),
            [SHELL_KW, _, EXTENDS_KW] | [SHELL_KW, _, EXTENDS_KW, .., COMMA] => {
                self.declared(Kind::Shell, path)
            }
            [CORE_KW, _, L_PAREN] | [COMPONENT_KW, _, L_PAREN] => self.declared(Kind::Shell, path),
            [COMPONENT_KW, _, L_PAREN, .., COMMA] => self.cores(path),
            _ => {}
        }
        if !self.at.item.is_empty() && self.at.may_begin {
            self.declarations();
        }
    }

    fn declarations(&mut self) {
        if self.at.list.kind() == SOURCE_FILE {
            let word = self.at.word.start();
            let mut earlier = self.at.list.children().filter(|node| node.text_range().end() <= word);
            if earlier.all(|node| matches!(node.kind(), INCLUDE | ERROR)) {
                self.skeleton("include", "include \"$1\"");
            }
            self.skeleton("library", "library ${1:name} {\n\t$0\n}");
        }
        self.missing_parts();
        self.keyword("use");
        for (keyword, snippet) in [
            ("codel", "codel ${1:name}($2): ${3:void}"),
            ("shell", "shell ${1:Name} {\n\t$0\n}"),
            ("core", &core_snippet("${1:Name}", "${2:Shell}")),
            ("component", "component ${1:Name}(${2:Shell}, ${3:Core})"),
            ("architecture", "architecture ${1:Name} {\n\t$0\n}"),
            ("deployment", "deployment ${1:Name} {\n\tarchitecture ${2:Architecture}\n\n\t$0\n}"),
        ] {
            self.skeleton(keyword, snippet);
        }
    }

    /// Offers a component for each core of this library that has none, and a core for each shell that has none.
    fn missing_parts(&mut self) {
        let (db, project) = (self.db, self.project);
        let names = names_of(db, project);
        let own = |kind: Kind| {
            let library = self.library.clone();
            names.of_kind(db, kind).filter(move |it| *it.library(db) == library && !it.name(db).is_empty())
        };
        let components: Vec<_> = names.of_kind(db, Kind::Component).collect();
        let cores: HashSet<_> = components.iter().filter_map(|&it| core_of(db, project, it)).collect();
        let mut used: HashSet<_> = components.iter().filter_map(|&it| shell_of(db, project, it)).collect();
        used.extend(names.of_kind(db, Kind::Core).filter_map(|it| shell_of(db, project, it)));
        used.extend(names.of_kind(db, Kind::Shell).flat_map(|it| bases_of(db, project, it)));
        let mut missing = Vec::new();
        for core in own(Kind::Core).filter(|core| !cores.contains(core)) {
            let Some(shell) = shell_of(db, project, core) else { continue };
            let name = core.name(db).trim_end_matches("Core");
            let text = format!("component {name}({}, {})", shell.name(db), core.name(db));
            missing.push((text.clone(), text, "the core has no component"));
        }
        for shell in own(Kind::Shell).filter(|shell| !used.contains(shell)) {
            let name = format!("{}Core", shell.name(db).trim_end_matches("Shell"));
            let label = format!("core {name}({})", shell.name(db));
            missing.push((label, core_snippet(&name, shell.name(db)), "the shell has no core"));
        }
        for (label, snippet, note) in missing {
            self.add(Completion::new(CompletionKind::Skeleton, label).snippet(snippet).note(note).rank(0));
        }
    }

    fn use_(&mut self) {
        let names = names_of(self.db, self.project);
        let own = self.library.clone();
        let here = self.at.list.children().filter(|node| !node.text_range().contains_range(self.at.word));
        let here: BTreeSet<String> = here
            .filter_map(ast::Use::cast)
            .filter_map(|it| Some(it.name_ref()?.syntax().text().to_string()))
            .collect();
        // A package that another block of the library uses is in scope here too; a repeated `use` is allowed.
        let elsewhere: BTreeSet<&Name> = names.visible(own.as_ref()).filter(|_| own.is_some()).collect();
        let libraries: BTreeSet<&Name> = names.libraries().collect();
        let packages = self.packages();
        let packages = packages.iter().filter(|name| !libraries.contains(name));
        let all = libraries.iter().map(|&name| (name, "library", 0));
        for (name, what, rank) in all.chain(packages.map(|name| (name, "message package", 1))) {
            if Some(name) != own.as_ref() && !here.contains(name.as_str()) {
                let rank = if elsewhere.contains(name) { 2 } else { rank };
                self.add(Completion::new(CompletionKind::Library, name.as_str()).note(what).rank(rank));
            }
        }
        self.add(Completion::new(CompletionKind::Library, "ctypes").note("the scalars of C").rank(2));
    }

    pub(super) fn packages(&self) -> BTreeSet<Name> {
        let workspace = self.project.workspace(self.db);
        let built_in = catalogue_of(self.db, workspace).keys();
        workspace.packages(self.db).keys().chain(built_in).cloned().collect()
    }

    fn cores(&mut self, path: &[&str]) {
        let from = self.found.len();
        self.declared(Kind::Core, path);
        let shell = self.at.item.iter().skip_while(|token| token.kind() != L_PAREN).skip(1);
        let shell: Vec<&str> = shell.take_while(|it| it.kind() != COMMA).map(|it| it.text()).collect();
        let Some(shell) = shell.last().filter(|shell| !shell.is_empty()) else { return };
        for item in self.found.iter_mut().skip(from).filter(|item| item.kind == CompletionKind::Core) {
            let is_for_it = item.detail.trim_matches(['(', ')']).rsplit('.').next() == Some(shell);
            item.rank = if is_for_it { 0 } else { item.rank.max(3) };
        }
    }

    pub(super) fn signature(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        let count = |kind| kinds.iter().filter(|it| **it == kind).count();
        let in_parameters = count(L_PAREN) > count(R_PAREN);
        let parameter = kinds.rsplit(|kind| matches!(kind, L_PAREN | R_PAREN | COMMA)).next();
        match parameter.unwrap_or_default() {
            [] if in_parameters && path.is_empty() => {
                for direction in Direction::ALL {
                    self.keyword(direction.keyword());
                }
            }
            [.., COLON] => self.types(path, !in_parameters),
            _ => {}
        }
    }

    pub(super) fn is_asked_for(&mut self, name: &str) -> bool {
        self.incomplete = true;
        !self.at.prefix.is_empty() && may_be(&self.at.prefix, name)
    }
}

/// Returns a core with one state.
fn core_snippet(name: &str, shell: &str) -> String {
    format!(
        "core {name}({shell}) {{\n\tstatemachine {{\n\t\tinitial state ${{3:Idle}} {{\n\t\t\trun = {{\n\t\t\t\t$0\n\t\t\t}}\n\t\t}}\n\t}}\n}}"
    )
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::expect;

    #[test]
    fn what_is_missing_comes_first() {
        let text = "library a {
  shell Base { }
  shell LaserShell extends Base { }
  shell DriveShell { }
  core LaserCore(LaserShell) { update = { } }
  $0
}";
        expect![[r#"
            0 component Laser(LaserShell, LaserCore) (the core has no component)
            0 core DriveCore(DriveShell) (the shell has no core) ⇒ "core DriveCore(DriveShell) {\n\tstatemachine {\n\t\tinitial state ${3:Idle} {\n\t\t\trun = {\n\t\t\t\t$0\n\t\t\t}\n\t\t}\n\t}\n}"
        "#]].assert_eq(&offered(text, 0));
    }

    #[test]
    fn a_file_begins_with_includes_and_holds_libraries() {
        expect![[r#"
            1 include (include "") ⇒ "include \"$1\""
            1 library (library name { }) ⇒ "library ${1:name} {\n\t$0\n}"
            1 use
            1 codel (codel name(): void) ⇒ "codel ${1:name}($2): ${3:void}"
            1 shell (shell Name { }) ⇒ "shell ${1:Name} {\n\t$0\n}"
            1 core (core Name(Shell) { statemachine { initial state Idle { run = { } } } }) ⇒ "core ${1:Name}(${2:Shell}) {\n\tstatemachine {\n\t\tinitial state ${3:Idle} {\n\t\t\trun = {\n\t\t\t\t$0\n\t\t\t}\n\t\t}\n\t}\n}"
            1 component (component Name(Shell, Core)) ⇒ "component ${1:Name}(${2:Shell}, ${3:Core})"
            1 architecture (architecture Name { }) ⇒ "architecture ${1:Name} {\n\t$0\n}"
            1 deployment (deployment Name { architecture Architecture }) ⇒ "deployment ${1:Name} {\n\tarchitecture ${2:Architecture}\n\n\t$0\n}"
        "#]].assert_eq(&offered("$0", 9));
        assert!(!labels("codel f(): int\n$0").contains(&"include".to_owned()));
        assert!(!labels("library a { $0 }").contains(&"library".to_owned()));
        assert!(labels("library a { use b codel f(): int co$0 }").contains(&"core".to_owned()));
    }

    #[test]
    fn where_a_name_is_to_be_made_up_nothing_is_offered() {
        for text in
            ["shell $0", "codel f$0", "core C$0(S) {}", "component $0", "codel f(in $0)", "codel f()$0"]
        {
            assert_eq!(labels(text), [] as [&str; 0], "{text}");
        }
    }

    #[test]
    fn heads_of_declarations() {
        const SHELLS: &str = "
library a { shell Base {} shell Fast extends Base {} core Slow(Base) {} core Quick(Fast) {} }
library b { shell Far {} }
";
        for (head, expected) in [
            (
                "library c { use a component X($0 }",
                expect![[r#"
                1 Base (a)
                1 Fast (a)
                4 a (library)
                4 b (library)
            "#]],
            ),
            (
                "library c { use a component X(Fast, $0 }",
                expect![[r#"
                0 Quick(Fast) (a)
                3 Slow(Base) (a)
                4 a (library)
            "#]],
            ),
            (
                "library c { use a shell X extends Base, F$0 {} }",
                expect![[r#"
                1 Base (a)
                1 Fast (a)
                4 a (library)
                4 b (library)
                5 Far (use b) + " use b" at 138
            "#]],
            ),
            (
                "library c { shell X extends a.$0 }",
                expect![[r#"
                1 Base (a)
                1 Fast (a)
            "#]],
            ),
            (
                "library c {\n  use a\n  use $0\n}",
                expect![[r#"
                0 b (library)
                2 ctypes (the scalars of C)
            "#]],
            ),
        ] {
            expected.assert_eq(
                &offered(&format!("{SHELLS}{head}"), 5)
                    .lines()
                    .filter(|line| !line.contains("message package"))
                    .map(|line| format!("{line}\n"))
                    .collect::<String>(),
            );
        }
    }
}
