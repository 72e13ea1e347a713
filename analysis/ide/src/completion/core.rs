//! Completion in a core, its state machine and its states: first the operations of the shell that the core lacks.

use std::collections::BTreeSet;

use mauve_hir::Type;
use mauve_hir::item_tree::{FeatureKind, HookKind, MethodKind};
use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::ast::{self, AstNode as _};

use super::{Completer, Completion, CompletionKind, Subject};
use crate::position::ends_operand;
use crate::program::{WantedValue, parameters_text, result_text};

impl Completer<'_, '_> {
    pub(super) fn core_item(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [] if path.is_empty() => self.core_items(),
            [VAR_KW, ..] => self.variable(kinds, path),
            [HANDLER_KW, _, COLON] if path.is_empty() => {
                for (name, of, feature) in self.scope().features(FeatureKind::Required) {
                    self.add(self.of_feature(name, of, feature));
                }
            }
            [PROVIDE_KW] if path.is_empty() => self.provided(""),
            [PROVIDE_KW, _, L_PAREN, ..] => self.signature(kinds, path),
            _ if self.at.may_begin => self.core_items(),
            _ => {}
        }
    }

    /// Completes `var x: T = value` up to the cursor. In a block, a statement may follow.
    pub(super) fn variable(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [VAR_KW, _, COLON] => self.types(path, false),
            [VAR_KW, _, COLON, _, .., _] if path.is_empty() => self.expression(),
            _ => {}
        }
        if self.at.may_begin && path.is_empty() {
            match self.at.list.kind() {
                CORE => self.core_items(),
                STATE_MACHINE => self.state_machine_items(),
                _ => {}
            }
        }
    }

    fn core_items(&mut self) {
        let there = self.keywords_there();
        let behaves = there.contains(HookKind::Update.keyword()) || there.contains("statemachine");
        if !behaves {
            let machine = "statemachine {\n\tinitial state ${1:Idle} {\n\t\trun = {\n\t\t\t$0\n\t\t}\n\t}\n}";
            self.skeleton("statemachine", machine);
            self.skeleton("update", "update = {\n\t$0\n}");
        }
        self.skeleton("var", "var ${1:name}: ${2:type};");
        let others = HookKind::ALL.into_iter().filter(|kind| *kind != HookKind::Update);
        for kind in others.filter(|kind| !there.contains(kind.keyword())) {
            let gives = matches!(kind, HookKind::Configure | HookKind::Start);
            let result = if gives { "\treturn true;\n" } else { "" };
            let keyword = kind.keyword();
            self.skeleton(keyword, &format!("{keyword} = {{\n\t$0\n{result}}}"));
        }
        let scope = self.scope();
        if scope.features(FeatureKind::Required).next().is_some() {
            self.skeleton("handler", "handler ${1:name}: ${2:operation};");
        }
        self.missing_handlers();
        self.provided("provide ");
    }

    /// Offers a handler for each required operation that has none: a program needs it to collect the result.
    fn missing_handlers(&mut self) {
        let handlers = self.at.list.children().filter(|node| node.kind() == HANDLER);
        let known =
            self.others(handlers.filter_map(|it| it.descendants().filter_map(ast::NameRef::cast).last()));
        let scope = self.scope();
        for (name, of, feature) in scope.features(FeatureKind::Required) {
            if known.iter().any(|known| *known == **name) {
                continue;
            }
            let item = self.of_feature(&format!("handler for {name}"), of, feature);
            let item = item.note("no handler yet").rank(0);
            self.add(item.snippet(format!("handler ${{1:{name}_handler}}: {name};")));
        }
    }

    fn provided(&mut self, keyword: &str) {
        let scope = self.scope();
        let is_followed = self.at.right == L_PAREN;
        for (name, of, feature) in scope.features(FeatureKind::Provided) {
            if scope.visible.definer_of(name).is_some() && !is_followed {
                continue;
            }
            let item = self.of_feature(&format!("{keyword}{name}"), of, feature);
            let item = item.note(of.name(self.db).as_str()).rank(0);
            let snippet = format!("{keyword}{name}{} = {{\n\t$0\n}}", item.detail);
            self.add(item.completed(is_followed, snippet));
        }
    }

    pub(super) fn state_machine_item(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [] if path.is_empty() => self.state_machine_items(),
            [VAR_KW, ..] => self.variable(kinds, path),
            [INITIAL_KW] => self.keyword("state"),
            [STATE_KW] | [INITIAL_KW, STATE_KW] => self.missing_states(),
            _ => {}
        }
    }

    fn state_machine_items(&mut self) {
        let mut states = self.at.list.children().filter_map(ast::State::cast);
        if !states.any(|state| state.initial_token().is_some()) {
            self.skeleton("initial state", "initial state ${1:Idle} {\n\trun = {\n\t\t$0\n\t}\n}");
        }
        self.skeleton("state", "state ${1:Name} {\n\trun = {\n\t\t$0\n\t}\n}");
        self.skeleton("var", "var ${1:name}: ${2:type};");
    }

    fn missing_states(&mut self) {
        let targets = self.at.list.descendants().filter_map(ast::Transition::cast);
        let targets = targets.filter_map(|it| Some(it.name_ref()?.syntax().text().to_string()));
        let known: BTreeSet<String> = self.states().into_iter().collect();
        let missing: BTreeSet<String> = targets.filter(|target| !known.contains(target)).collect();
        let is_followed = self.at.right == L_CURLY;
        for name in missing {
            let item = Completion::new(CompletionKind::State, name.as_str()).note("a transition leads to it");
            let skeleton = format!("{name} {{\n\trun = {{\n\t\t$0\n\t}}\n}}");
            self.add(item.completed(is_followed, skeleton));
        }
    }

    fn states(&self) -> Vec<String> {
        let Some(machine) = self.at.around(STATE_MACHINE) else { return Vec::new() };
        self.others(machine.children().filter_map(ast::State::cast).filter_map(|state| state.name()))
    }

    pub(super) fn state_item(&mut self) {
        let kinds = self.at.kinds();
        match kinds.as_slice() {
            [] => {
                // A transition may continue on the next line.
                self.transition_goes_on(&self.at.before);
                self.state_items();
            }
            [TRANSITION_KW, _, .., TO_KW] => self.targets(),
            [TRANSITION_KW, _, IF_KW, ..] => {
                self.expression();
                self.transition_goes_on(&self.at.item);
            }
            [TRANSITION_KW, _] => self.transition_goes_on(&self.at.item),
            _ if self.at.may_begin => self.state_items(),
            _ => {}
        }
        if self.at.may_begin && kinds.first() == Some(&TRANSITION_KW) && kinds.contains(&TO_KW) {
            self.state_items();
        }
    }

    fn transition_goes_on(&mut self, tokens: &[mauve_syntax::SyntaxToken]) {
        let kinds: Vec<_> = tokens.iter().map(mauve_syntax::SyntaxToken::kind).collect();
        match kinds.as_slice() {
            [TRANSITION_KW, _] => {
                self.keyword("to");
                self.skeleton("if", "if ($1) to $0");
            }
            [TRANSITION_KW, _, IF_KW, .., last] if !kinds.contains(&TO_KW) && ends_operand(*last) => {
                self.keyword("to");
            }
            _ => {}
        }
    }

    fn keywords_there(&self) -> BTreeSet<String> {
        let items = self.at.list.children();
        let items = items.filter(|item| matches!(item.kind(), HOOK | METHOD | STATE_MACHINE));
        items.filter_map(|item| Some(item.first_token()?.text().to_owned())).collect()
    }

    fn state_items(&mut self) {
        let there = self.keywords_there();
        for keyword in MethodKind::ALL.map(MethodKind::keyword) {
            if !there.contains(keyword) {
                self.skeleton(keyword, &format!("{keyword} = {{\n\t$0\n}}"));
            }
        }
        self.skeleton("transition", "transition ${1:name} if (${2:true}) to ${3:State}");
    }

    fn targets(&mut self) {
        let own = self.at.around(STATE).and_then(ast::State::cast).and_then(|state| state.name());
        let own = own.map(|name| name.syntax().text().to_string());
        for name in self.states() {
            let is_own = own.as_ref() == Some(&name);
            let item = Completion::new(CompletionKind::State, name.as_str()).rank(u8::from(is_own));
            let item = match self.decl {
                Some(decl) => item.subject(Subject::of(self.db, decl, Some(name.as_str().into()))),
                None => item,
            };
            self.add(item);
        }
    }

    pub(super) fn of_feature(
        &self,
        label: &str,
        of: mauve_hir::Decl<'_>,
        feature: &mauve_hir::item_tree::Feature,
    ) -> Completion {
        let kind = match feature.kind {
            FeatureKind::Constant => CompletionKind::Constant,
            FeatureKind::Property => CompletionKind::Property,
            FeatureKind::Input | FeatureKind::Output => CompletionKind::Port,
            FeatureKind::Required | FeatureKind::Provided => CompletionKind::Operation,
        };
        let parameters = match feature.kind.is_operation() {
            true => parameters_text(&feature.parameters),
            false => String::new(),
        };
        Completion::new(kind, label)
            .detail(format!("{parameters}{}", result_text(feature.ty.as_ref())))
            .subject(Subject::of(self.db, of, Some(feature.name.name.clone())))
    }

    pub(super) fn expression(&mut self) {
        let scope = self.scope();
        if let Some(expected) = self.at.left.as_ref().and_then(|left| scope.expected(left)) {
            self.operands(&scope, &expected);
        }
    }

    pub(super) fn value_of(&mut self, ty: Option<Type>) {
        self.literals(&WantedValue { ty, ..WantedValue::default() });
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::expect;

    const SHELL: &str = "
library a {
  shell S {
    provide go(in to: int, out way: double): bool
    provide halt(): void
    require ask(in what: int): int
    input port scan: int
  }
";

    #[test]
    fn items_of_a_core_that_it_does_not_have_yet() {
        let text = |body: &str| format!("{SHELL}core C(S) {{ {body} }} }}");
        expect![[r#"
            0 handler for ask(in what: int): int (no handler yet) ⇒ "handler ${1:ask_handler}: ask;"
            0 provide go(in to: int, out way: double): bool (S) ⇒ "provide go(in to: int, out way: double): bool = {\n\t$0\n}"
            1 statemachine (statemachine { initial state Idle { run = { } } }) ⇒ "statemachine {\n\tinitial state ${1:Idle} {\n\t\trun = {\n\t\t\t$0\n\t\t}\n\t}\n}"
            1 update (update = { }) ⇒ "update = {\n\t$0\n}"
            1 var (var name: type;) ⇒ "var ${1:name}: ${2:type};"
            1 configure (configure = { return true; }) ⇒ "configure = {\n\t$0\n\treturn true;\n}"
            1 stop (stop = { }) ⇒ "stop = {\n\t$0\n}"
            1 cleanup (cleanup = { }) ⇒ "cleanup = {\n\t$0\n}"
            1 handler (handler name: operation;) ⇒ "handler ${1:name}: ${2:operation};"
        "#]].assert_eq(&offered(&text("provide halt() = { } start = { } $0"), 9));
        assert!(!labels(&text("update = { } $0")).contains(&"statemachine".to_owned()));
        expect![[r#"
            0 go(in to: int, out way: double): bool (S) ⇒ "go(in to: int, out way: double): bool = {\n\t$0\n}"
            0 halt(): void (S) ⇒ "halt(): void = {\n\t$0\n}"
        "#]]
        .assert_eq(&offered(&text("provide $0"), 9));
        expect![[r#"
            1 ask(in what: int): int
        "#]]
        .assert_eq(&offered(&text("handler h: $0"), 9));
    }

    #[test]
    fn states_and_transitions() {
        let text = |body: &str| format!("{SHELL}core C(S) {{ statemachine {{ {body} }} }} }}");
        expect![[r#"
            1 initial state (initial state Idle { run = { } }) ⇒ "initial state ${1:Idle} {\n\trun = {\n\t\t$0\n\t}\n}"
            1 state (state Name { run = { } }) ⇒ "state ${1:Name} {\n\trun = {\n\t\t$0\n\t}\n}"
            1 var (var name: type;) ⇒ "var ${1:name}: ${2:type};"
        "#]].assert_eq(&offered(&text("$0"), 9));
        expect![[r#"
            1 run (run = { }) ⇒ "run = {\n\t$0\n}"
            1 handle (handle = { }) ⇒ "handle = {\n\t$0\n}"
            1 exit (exit = { }) ⇒ "exit = {\n\t$0\n}"
            1 transition (transition name if (true) to State) ⇒ "transition ${1:name} if (${2:true}) to ${3:State}"
        "#]].assert_eq(&offered(&text("initial state A { entry = {} $0 }"), 9));
        expect![[r#"
            0 B
            1 A
        "#]]
        .assert_eq(&offered(&text("initial state A { transition t to $0 } state B { }"), 9));
        expect![[r#"
            1 Gone (a transition leads to it) ⇒ "Gone {\n\trun = {\n\t\t$0\n\t}\n}"
        "#]]
        .assert_eq(&offered(&text("initial state A { transition t to Gone } state $0"), 9));
        assert_eq!(labels(&text("initial state A { transition t $0 }")), ["to", "if"]);
        assert_eq!(
            labels(&text("initial state A { transition t if (status(scan) == new_data) $0 }")),
            ["to"]
        );
        // It may go on in the next line, or be given up.
        assert_eq!(
            labels(&text("initial state A { transition t if (true)\n  $0\n run = { } }")),
            ["to", "entry", "handle", "exit", "transition"]
        );
        assert_eq!(labels(&text("initial $0")), ["state"]);
    }
}
