//! Statements, and the operands of expressions.

use mauve_model::item_tree::{Direction, FeatureKind, Kind};
use mauve_model::{Type, VariableKind};
use mauve_syntax::SyntaxKind::*;

use super::core::ends_operand;
use super::position::without_path;
use super::{Completer, Completion, CompletionKind, Subject};
use crate::program::{Callable, Expected, Scope, Variable, subject};

/// What the language itself can be asked to do.
const BUILT_IN: [&str; 5] = ["read", "write", "status", "send", "collect"];

impl<'db> Completer<'_, 'db> {
    pub(super) fn statement(&mut self) {
        let (rest, path) = without_path(&self.at.item);
        let kinds: Vec<_> = rest.iter().map(|token| token.kind()).collect();
        if let [IF_KW, .., last] = self.at.before.iter().map(|it| it.kind()).collect::<Vec<_>>().as_slice()
            && ends_operand(*last)
        {
            self.then();
        }
        match kinds.as_slice() {
            [] if path.is_empty() => self.statements(),
            [VAR_KW, _, COLON, ..] => self.variable(&kinds, &path),
            // A program does not look into a message.
            _ if !path.is_empty() => {}
            [IF_KW, .., last] if ends_operand(*last) && self.is_condition() => self.then(),
            [.., ELSE_KW] => {
                self.skeleton("if", "if (${1:true}) then {\n\t$0\n} else {\n}");
            }
            _ => self.expression(),
        }
    }

    /// Is what is typed the condition of an `if`, with all its brackets closed?
    fn is_condition(&self) -> bool {
        let count = |kind| self.at.item.iter().filter(|token| token.kind() == kind).count();
        count(L_PAREN) == count(R_PAREN) && count(THEN_KW) == 0
    }

    fn then(&mut self) {
        self.skeleton("then", "then {\n\t$0\n} else {\n}");
    }

    fn statements(&mut self) {
        let scope = self.scope();
        let is_after_if =
            self.at.closed.as_ref().is_some_and(|it| {
                it.kind() == IF_STATEMENT && !it.children().any(|child| child.kind() == ELSE)
            });
        if is_after_if {
            self.skeleton("else", "else {\n\t$0\n}");
        }
        let end = if self.at.right == SEMICOLON { "" } else { ";" };
        for variable in &scope.variables {
            if variable.kind == VariableKind::Parameter(Direction::In) {
                continue;
            }
            let item = self.of_variable(variable);
            let item = match (self.at.right == EQ, variable.kind) {
                (true, _) => item,
                (false, VariableKind::Handler) => {
                    item.snippet(format!("{} = send({}, $1){end}$0", variable.name, variable.text))
                }
                (false, _) => item.snippet(format!("{} = $1{end}$0", variable.name)),
            };
            self.add(item);
        }
        self.callables(&scope, &Expected::default(), true);
        self.skeleton("if", "if (${1:true}) then {\n\t$0\n} else {\n}");
        self.skeleton("var", "var ${1:name}: ${2:type};");
        match self.returns(scope.result.as_ref()) {
            true => self.skeleton("return", "return $1;"),
            false => self.skeleton("return", "return;"),
        }
    }

    /// What may stand as an operand.
    pub(super) fn operands(&mut self, scope: &Scope<'db>, expected: &Expected) {
        if expected.nothing {
            return;
        }
        if expected.handler {
            for variable in scope.variables.iter().filter(|it| it.kind == VariableKind::Handler) {
                let item = self.of_variable(variable);
                self.add(item.rank(0));
            }
            return;
        }
        if let Some(kind) = expected.feature {
            for (name, (of, feature)) in &scope.features {
                if feature.kind == kind {
                    let item = self.of_feature(name, *of, feature);
                    self.add(item.rank(0));
                }
            }
            return;
        }
        let rank_of = |ty: &Type| match &expected.ty {
            None | Some(Type::Unknown) => 1,
            Some(wanted) if ty == wanted => 0,
            _ if expected.takes(ty) => 1,
            _ => 3,
        };
        for variable in &scope.variables {
            if expected.is_output
                && matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In))
            {
                continue;
            }
            let item = self.of_variable(variable);
            self.add(item.rank(rank_of(&variable.ty)));
        }
        if expected.is_output {
            return;
        }
        for (name, (of, feature)) in &scope.features {
            if feature.kind.is_value() && !scope.variables.iter().any(|variable| variable.name == *name) {
                let ty = scope.type_of_name(name).unwrap_or(Type::Unknown);
                let item = self.of_feature(name, *of, feature);
                self.add(item.rank(rank_of(&ty)));
            }
        }
        self.literals(expected);
        self.callables(scope, expected, false);
    }

    /// What can be called: in a statement everything, in an expression what gives a value.
    fn callables(&mut self, scope: &Scope<'db>, expected: &Expected, is_statement: bool) {
        let from = self.found.len();
        self.declared(Kind::Codel, &[]);
        let names = mauve_model::names_of(self.db, self.project);
        let codels: Vec<Completion> = self.found.drain(from..).collect();
        for item in codels {
            let of = match &item.subject {
                Some(Subject::Declaration { library, name, .. }) => {
                    names.in_library(library.as_ref(), Kind::Codel, name).first()
                }
                _ => None,
            };
            if let Some(callable) = of.and_then(|&of| scope.codel(of)) {
                self.call(item, &callable, expected, is_statement);
            }
        }
        for (name, (of, feature)) in &scope.features {
            if let Some(callable) = scope.operation(name) {
                let item = self.of_feature(name, *of, feature);
                self.call(item, &callable, expected, is_statement);
            }
        }
        let has = |kind| scope.features.values().any(|(_, feature)| feature.kind == kind);
        for name in BUILT_IN {
            let makes_sense = match name {
                "write" => has(FeatureKind::Output),
                "send" => has(FeatureKind::Required),
                "collect" => scope.variables.iter().any(|it| it.kind == VariableKind::Handler),
                _ => has(FeatureKind::Input),
            };
            // A status that nobody looks at means nothing.
            if let Some(mut callable) =
                scope.built_in(name, None).filter(|_| makes_sense && !(is_statement && name == "status"))
            {
                if name == "collect" {
                    callable.parameters.truncate(1);
                }
                let (shown, _) = callable.shown();
                let detail = shown.strip_prefix(name).unwrap_or_default().to_owned();
                let item = Completion::new(CompletionKind::BuiltIn, name).detail(detail);
                self.call(item, &callable, expected, is_statement);
            }
        }
    }

    /// Adds a call: with places for its arguments, where there are none yet.
    fn call(
        &mut self,
        mut item: Completion,
        callable: &Callable<'db>,
        expected: &Expected,
        is_statement: bool,
    ) {
        let is_void = callable.result == Type::Void;
        if is_void && !is_statement {
            return;
        }
        if item.rank < 5 {
            item.rank = match &expected.ty {
                _ if is_statement => 1,
                None | Some(Type::Unknown) => 2,
                Some(_) if expected.takes(&callable.result) => 1,
                Some(Type::Handle(_)) if matches!(callable.result, Type::Handle(_)) => 0,
                Some(_) => 4,
            };
        }
        item.subject = subject(self.db, callable).or(item.subject);
        if self.at.right != L_PAREN {
            let places = callable.parameters.iter().enumerate();
            let places: Vec<String> =
                places.map(|(index, it)| format!("${{{}:{}}}", index + 1, it.name)).collect();
            let end = if is_statement && self.at.right != SEMICOLON { ";" } else { "" };
            item.snippet = Some(format!("{}({}){end}$0", callable.name, places.join(", ")));
        }
        self.add(item);
    }

    /// A variable with its type.
    fn of_variable(&self, variable: &Variable) -> Completion {
        let note = match variable.kind {
            VariableKind::Core => "variable of the core",
            VariableKind::Machine => "variable of the state machine",
            VariableKind::Local => "local variable",
            VariableKind::Parameter(Direction::In) => "in parameter",
            VariableKind::Parameter(Direction::Out) => "out parameter",
            VariableKind::Parameter(Direction::InOut) => "inout parameter",
            VariableKind::Handler => "handler",
        };
        Completion::new(CompletionKind::Variable, variable.name.as_str())
            .detail(format!(": {}", variable.text))
            .note(note)
            .rank(0)
    }
}
