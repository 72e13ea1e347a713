//! Completion in a shell.

use mauve_hir::item_tree::FeatureKind;
use mauve_hir::{Type, built_in_type};
use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::keywords::{CallStatus, PortStatus, TruthValue};

use super::{Completer, Completion, CompletionKind};
use crate::program::WantedValue;

impl Completer<'_, '_> {
    pub(super) fn shell_item(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [] if path.is_empty() => self.shell_items(),
            [INPUT_KW | OUTPUT_KW] => self.keyword("port"),
            [REQUIRE_KW | PROVIDE_KW, _, L_PAREN, ..] => self.signature(kinds, path),
            [INPUT_KW | OUTPUT_KW, _, _, COLON] => self.types(path, false),
            [CONSTANT_KW | PROPERTY_KW, _, COLON] => {
                self.types(path, false);
                // Only numbers have an interval; properties are rarely messages.
                let has_interval = self.at.right == L_BRACK;
                let is_number = |name: &str| built_in_type(name).is_some_and(|ty| ty.is_number());
                self.found.retain(|it| {
                    !has_interval || it.kind == CompletionKind::BuiltInType && is_number(&it.label)
                });
                for item in self.found.iter_mut().filter(|item| item.kind == CompletionKind::Message) {
                    item.rank = item.rank.max(2);
                }
            }
            [CONSTANT_KW | PROPERTY_KW, ..] if path.is_empty() => {
                let scope = self.scope();
                match self.at.left.as_ref().and_then(|left| scope.expected(left)) {
                    Some(expected) => self.constants(&expected),
                    None if self.at.may_begin => self.shell_items(),
                    None => {}
                }
            }
            _ if self.at.may_begin => self.shell_items(),
            _ => {}
        }
    }

    fn shell_items(&mut self) {
        self.skeleton("input port", "input port ${1:name}: ${2:type}");
        self.skeleton("output port", "output port ${1:name}: ${2:type}");
        self.skeleton("property", "property ${1:name}: ${2:double}");
        self.skeleton("constant", "constant ${1:name}: ${2:double} = ${3:0.0}");
        self.skeleton("require", "require ${1:name}($2): ${3:void}");
        self.skeleton("provide", "provide ${1:name}($2): ${3:void}");
    }

    fn constants(&mut self, expected: &WantedValue) {
        let scope = self.scope();
        let own = self.at.item.get(1).map(|token| token.text().to_owned());
        for (name, (of, feature)) in &scope.visible.features {
            if feature.kind == FeatureKind::Constant && own.as_deref() != Some(name.as_str()) {
                let ty = scope.visible.type_of_name(name);
                let rank = if ty.is_some_and(|ty| expected.takes(&ty)) { 0 } else { 2 };
                self.add(self.of_feature(name, *of, feature).rank(rank));
            }
        }
        self.literals(expected);
    }

    pub(super) fn literals(&mut self, expected: &WantedValue) {
        let is_known = expected.ty.as_ref().is_some_and(|ty| *ty != Type::Unknown);
        for (words, ty) in [
            (&TruthValue::ALL.map(TruthValue::keyword)[..], Type::Bool),
            (&PortStatus::ALL.map(PortStatus::keyword), Type::PortStatus),
            (&CallStatus::ALL.map(CallStatus::keyword), Type::CallStatus),
        ] {
            let fits = is_known && expected.takes(&ty);
            // A status is usually only compared.
            if fits || ty == Type::Bool && !is_known {
                for word in words {
                    let rank = if !fits { 2 } else { u8::from(ty == Type::Bool) };
                    self.add(Completion::new(CompletionKind::Value, *word).rank(rank));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::expect;

    #[test]
    fn items_of_a_shell() {
        expect![[r#"
            1 input port (input port name: type) ⇒ "input port ${1:name}: ${2:type}"
            1 output port (output port name: type) ⇒ "output port ${1:name}: ${2:type}"
            1 property (property name: double) ⇒ "property ${1:name}: ${2:double}"
            1 constant (constant name: double = 0.0) ⇒ "constant ${1:name}: ${2:double} = ${3:0.0}"
            1 require (require name(): void) ⇒ "require ${1:name}($2): ${3:void}"
            1 provide (provide name(): void) ⇒ "provide ${1:name}($2): ${3:void}"
        "#]]
        .assert_eq(&offered("shell S { pr$0 }", 9));
        assert_eq!(labels("shell S { input $0 }"), ["port"]);
        assert_eq!(labels("shell S { require f(in a: int, $0 }"), ["in", "out", "inout"]);
        assert_eq!(labels("shell S { input port p$0 }"), [] as [&str; 0]);
    }

    #[test]
    fn a_value_may_name_constants() {
        let shell = "shell S { constant low: double = 1.0 constant name: string = \"a\" property p: double ";
        assert_eq!(labels(&format!("{shell}[$0; 3] }}")), ["low", "name", "true", "false"]);
        expect![[r#"
            0 low: double
            2 name: string
        "#]]
        .assert_eq(&offered(&format!("{shell} = $0 }}"), 9));
        assert_eq!(labels("shell S { property on: bool = $0 }"), ["true", "false"]);
    }
}
