//! Completion of statements and operands of expressions.

use mauve_hir::item_tree::{Direction, FeatureKind, Kind, Name};
use mauve_hir::{Builtin, Operand, Type, VariableKind, VariableOf};
use mauve_syntax::SyntaxKind::{self, *};

use super::documentation::subject;
use super::{Completer, Completion, CompletionKind, Subject};
use crate::position::ends_operand;
use crate::program::{Callable, CursorScope, WantedValue, written_type};

impl<'db> Completer<'_, 'db> {
    pub(super) fn statement(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        if let [IF_KW, .., last] = self.at.before.iter().map(|it| it.kind()).collect::<Vec<_>>().as_slice()
            && ends_operand(*last)
        {
            self.then();
        }
        match kinds {
            [] if path.is_empty() => self.statements(),
            [VAR_KW, _, COLON, ..] => self.variable(kinds, path),
            // A program cannot access the fields of a message.
            _ if !path.is_empty() => {}
            [IF_KW, .., last] if ends_operand(*last) && self.is_condition() => self.then(),
            [.., ELSE_KW] => {
                self.skeleton("if", "if (${1:true}) then {\n\t$0\n} else {\n}");
            }
            _ => self.expression(),
        }
    }

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
        let is_called = self.at.first_argument.is_some();
        for variable in scope.variables().filter(|_| !is_called) {
            if variable.kind == VariableKind::Parameter(Direction::In) {
                continue;
            }
            let item = self.of_variable(variable);
            let name = &variable.name.name;
            let item = match (self.at.right == EQ, variable.kind) {
                (true, _) => item,
                (false, VariableKind::Handler) => {
                    let operation = written_type(variable);
                    let send = scope.built_in(Builtin::Send, Some(&operation));
                    let rest: String =
                        (1..send.parameters.len()).map(|index| format!(", ${index}")).collect();
                    item.snippet(format!("{name} = send({operation}{rest}){end}$0"))
                }
                (false, _) => item.snippet(format!("{name} = $1{end}$0")),
            };
            self.add(item);
        }
        // Only a variable can be assigned.
        if self.at.right == EQ {
            return;
        }
        self.callables(&scope, &WantedValue::default(), true);
        if is_called {
            return;
        }
        self.skeleton("if", "if (${1:true}) then {\n\t$0\n} else {\n}");
        self.skeleton("var", "var ${1:name}: ${2:type};");
        match &scope.visible.result {
            Some(Type::Void) | None => self.skeleton("return", "return;"),
            Some(Type::Bool) => self.skeleton("return", "return ${1:true};"),
            Some(_) => self.skeleton("return", "return ${1:value};"),
        }
    }

    pub(super) fn operands(&mut self, scope: &CursorScope<'db>, expected: &WantedValue) {
        if expected.nothing {
            return;
        }
        if expected.handler {
            for variable in scope.handlers() {
                self.add(self.of_variable(variable).rank(0));
            }
            return;
        }
        // A word with arguments is a call.
        if self.at.first_argument.is_some() && !expected.is_output && expected.feature.is_none() {
            self.callables(scope, expected, false);
            return;
        }
        if let Some(kind) = expected.feature {
            for (name, of, feature) in scope.features(kind) {
                self.add(self.of_feature(name, of, feature).rank(0));
            }
            return;
        }
        let rank_of = |ty: &Type| match &expected.ty {
            None | Some(Type::Unknown) => 1,
            Some(wanted) if ty == wanted => 0,
            _ if expected.takes(ty) => 1,
            _ => 3,
        };
        for variable in scope.variables() {
            if expected.is_output
                && matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In))
            {
                continue;
            }
            let rank = match variable.kind {
                // A handler fits no other type, even if its operation is unknown.
                VariableKind::Handler if variable.ty == Type::Unknown => {
                    rank_of(&Type::Handle(Name::default()))
                }
                _ => rank_of(&variable.ty),
            };
            self.add(self.of_variable(variable).rank(rank));
        }
        if expected.is_output {
            return;
        }
        for (name, (of, feature)) in &scope.visible.features {
            if feature.kind.is_value() && scope.visible.variable(name).is_none() {
                let ty = scope.visible.type_of_name(name).unwrap_or(Type::Unknown);
                self.add(self.of_feature(name, *of, feature).rank(rank_of(&ty)));
            }
        }
        self.literals(expected);
        self.callables(scope, expected, false);
    }

    /// Offers callees: all in a statement, those with a result in an expression.
    fn callables(&mut self, scope: &CursorScope<'db>, expected: &WantedValue, is_statement: bool) {
        let from = self.found.len();
        self.declared(Kind::Codel, &[]);
        let names = mauve_hir::names_of(self.db, self.project);
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
        for (name, of, feature) in scope.features(FeatureKind::Provided) {
            let item = self.of_feature(name, of, feature);
            self.call(item, &scope.operation(of, feature), expected, is_statement);
        }
        let has = |kind| scope.features(kind).next().is_some();
        for builtin in Builtin::ALL {
            let name = builtin.name();
            let takes = self.at.first_argument.as_ref().is_none_or(|first| match builtin.operand() {
                _ if !first.kind().is_word() => true,
                Operand::Handler => scope.handlers().any(|handler| handler.name.name == *first.text()),
                _ => scope.visible.features.get(first.text()).is_some_and(|(_, it)| builtin.takes(it.kind)),
            });
            let makes_sense = takes
                && match builtin.operand() {
                    Operand::Port(kind) => has(kind),
                    Operand::Operation => has(FeatureKind::Required),
                    Operand::Handler => scope.handlers().next().is_some(),
                };
            // An unused status or an unassigned call has no effect.
            let is_idle = is_statement && matches!(builtin, Builtin::Status | Builtin::Send);
            if makes_sense && !is_idle {
                let mut callable = scope.built_in(builtin, None);
                if builtin == Builtin::Collect {
                    callable.parameters.truncate(1);
                }
                let (shown, _) = callable.shown();
                let detail = shown.strip_prefix(name).unwrap_or_default().to_owned();
                let item = Completion::new(CompletionKind::BuiltIn, name).detail(detail);
                self.call(item, &callable, expected, is_statement);
            }
        }
    }

    fn call(
        &mut self,
        mut item: Completion,
        callable: &Callable<'db>,
        expected: &WantedValue,
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

    fn of_variable(&self, variable: &VariableOf) -> Completion {
        let note = match variable.kind {
            VariableKind::Core => "variable of the core",
            VariableKind::Machine => "variable of the state machine",
            VariableKind::Local => "local variable",
            VariableKind::Parameter(Direction::In) => "in parameter",
            VariableKind::Parameter(Direction::Out) => "out parameter",
            VariableKind::Parameter(Direction::InOut) => "inout parameter",
            VariableKind::Handler => "handler",
        };
        Completion::new(CompletionKind::Variable, variable.name.name.as_str())
            .detail(format!(": {}", written_type(variable)))
            .note(note)
            .rank(0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::{Expect, expect};

    fn in_program(statements: &str) -> String {
        format!(
            "
library a {{
  use std_msgs
  codel near(in scan: Float32, in far: double): bool
  codel loop(): void
  codel fill(out scan: Float32, inout count: int): double
  shell S {{
    property reach: double = 1.0
    constant most: int = 3
    input port scan: Float32
    output port out: Float32
    require ask(in what: int, out found: bool): int
    provide go(in to: int): bool
  }}
  core C(S) {{
    var echo: Float32;
    var count: int;
    var far: double;
    handler asking: ask
    provide go(in to: int): bool = {{ return true; }}
    configure = {{ {statements} }}
    update = {{ var later: int; }}
  }}
}}
library b {{ codel distant(): bool }}
"
        )
    }

    fn check(statements: &str, most: u8, expected: Expect) {
        expected.assert_eq(&offered(&in_program(statements), most));
    }

    #[test]
    fn a_handler_of_an_unknown_operation_fits_no_value() {
        let text = "shell S { constantx most: int  require ask(): int }
core C(S) { var far: double; handler asking: ask  update = { far = $0; } }";
        let handler = offered(text, 9).lines().find(|line| line.contains("asking")).map(str::to_owned);
        assert_eq!(handler.as_deref(), Some("3 asking: ask (handler)"));
    }

    #[test]
    fn an_error_elsewhere_in_the_shell_does_not_hide_the_type_of_a_handler() {
        let text = "shell S { constantx most: int  require ask(): int }
core C(S) { handler asking: ask  update = { asking = $0; } }";
        let send = offered(text, 9).lines().find(|line| line.contains("send")).map(str::to_owned);
        assert!(send.unwrap().starts_with("0 send(required operation): handler"));
    }

    #[test]
    fn statements_are_offered() {
        check(
            "var own: bool; $0",
            9,
            expect![[r#"
            0 own: bool (local variable) ⇒ "own = $1;$0"
            0 echo: Float32 (variable of the core) ⇒ "echo = $1;$0"
            0 count: int (variable of the core) ⇒ "count = $1;$0"
            0 far: double (variable of the core) ⇒ "far = $1;$0"
            0 asking: ask (handler) ⇒ "asking = send(ask, $1);$0"
            1 near(in scan: Float32, in far: double): bool ⇒ "near(${1:scan}, ${2:far});$0"
            1 loop(): void ⇒ "loop();$0"
            1 fill(out scan: Float32, inout count: int): double ⇒ "fill(${1:scan}, ${2:count});$0"
            1 go(in to: int): bool ⇒ "go(${1:to});$0"
            1 read(input port, out variable): port status ⇒ "read(${1:port}, ${2:variable});$0"
            1 write(output port, value): void ⇒ "write(${1:port}, ${2:value});$0"
            1 collect(handler): call status ⇒ "collect(${1:handler});$0"
            1 if (if (true) then { } else { }) ⇒ "if (${1:true}) then {\n\t$0\n} else {\n}"
            1 var (var name: type;) ⇒ "var ${1:name}: ${2:type};"
            1 return (return true;) ⇒ "return ${1:true};"
        "#]],
        );
        check(
            "if (true) then { } $0",
            0,
            expect![[r#"
            0 echo: Float32 (variable of the core) ⇒ "echo = $1;$0"
            0 count: int (variable of the core) ⇒ "count = $1;$0"
            0 far: double (variable of the core) ⇒ "far = $1;$0"
            0 asking: ask (handler) ⇒ "asking = send(ask, $1);$0"
        "#]],
        );
        // Existing text is not duplicated.
        check(
            "lo$0();",
            1,
            expect![[r#"
            1 near(in scan: Float32, in far: double): bool
            1 loop(): void
            1 fill(out scan: Float32, inout count: int): double
            1 go(in to: int): bool
            1 read(input port, out variable): port status
            1 write(output port, value): void
            1 collect(handler): call status
        "#]],
        );
    }

    #[test]
    fn values_of_the_expected_type_come_first() {
        check(
            "far = $0;",
            1,
            expect![[r#"
            0 far: double (variable of the core)
            0 reach: double
            1 count: int (variable of the core)
            1 most: int
            1 fill(out scan: Float32, inout count: int): double ⇒ "fill(${1:scan}, ${2:count})$0"
        "#]],
        );
        check(
            "if ($0",
            1,
            expect![[r#"
            1 true
            1 false
            1 near(in scan: Float32, in far: double): bool ⇒ "near(${1:scan}, ${2:far})$0"
            1 go(in to: int): bool ⇒ "go(${1:to})$0"
        "#]],
        );
        check(
            "return $0",
            1,
            expect![[r#"
            1 true
            1 false
            1 near(in scan: Float32, in far: double): bool ⇒ "near(${1:scan}, ${2:far})$0"
            1 go(in to: int): bool ⇒ "go(${1:to})$0"
        "#]],
        );
        check(
            "if (read(scan, echo) == $0",
            1,
            expect![[r#"
            0 new_data
            0 old_data
            0 no_data
            1 read(input port, out variable): port status ⇒ "read(${1:port}, ${2:variable})$0"
            1 status(input port): port status ⇒ "status(${1:port})$0"
        "#]],
        );
    }

    #[test]
    fn the_arguments_of_what_the_language_has() {
        check(
            "read($0",
            9,
            expect![[r#"
            0 scan: Float32
        "#]],
        );
        check(
            "write($0, echo);",
            9,
            expect![[r#"
            0 out: Float32
        "#]],
        );
        check(
            "read(scan, $0",
            9,
            expect![[r#"
            0 echo: Float32 (variable of the core)
            3 count: int (variable of the core)
            3 far: double (variable of the core)
        "#]],
        );
        check(
            "asking = send($0",
            9,
            expect![[r#"
            0 ask(in what: int, out found: bool): int
        "#]],
        );
        check(
            "asking = send(ask, $0",
            1,
            expect![[r#"
            0 count: int (variable of the core)
            0 most: int
        "#]],
        );
        check(
            "if (collect($0",
            9,
            expect![[r#"
            0 asking: ask (handler)
        "#]],
        );
        check(
            "if (collect(asking, $0",
            1,
            expect![[r#"
            0 count: int (variable of the core)
        "#]],
        );
        // There is no further argument.
        check("read(scan, echo, $0", 9, expect![[""]]);
    }

    #[test]
    fn an_output_is_a_variable() {
        check(
            "fill(echo, $0",
            9,
            expect![[r#"
            0 count: int (variable of the core)
            3 echo: Float32 (variable of the core)
            3 far: double (variable of the core)
        "#]],
        );
    }

    #[test]
    fn a_codel_of_a_library_that_is_not_used_brings_its_use() {
        check(
            "dist$0",
            9,
            expect![[r#"
            0 echo: Float32 (variable of the core) ⇒ "echo = $1;$0"
            0 count: int (variable of the core) ⇒ "count = $1;$0"
            0 far: double (variable of the core) ⇒ "far = $1;$0"
            0 asking: ask (handler) ⇒ "asking = send(ask, $1);$0"
            1 near(in scan: Float32, in far: double): bool ⇒ "near(${1:scan}, ${2:far});$0"
            1 loop(): void ⇒ "loop();$0"
            1 fill(out scan: Float32, inout count: int): double ⇒ "fill(${1:scan}, ${2:count});$0"
            1 go(in to: int): bool ⇒ "go(${1:to});$0"
            1 read(input port, out variable): port status ⇒ "read(${1:port}, ${2:variable});$0"
            1 write(output port, value): void ⇒ "write(${1:port}, ${2:value});$0"
            1 collect(handler): call status ⇒ "collect(${1:handler});$0"
            1 if (if (true) then { } else { }) ⇒ "if (${1:true}) then {\n\t$0\n} else {\n}"
            1 var (var name: type;) ⇒ "var ${1:name}: ${2:type};"
            1 return (return true;) ⇒ "return ${1:true};"
            5 distant(): bool (use b) ⇒ "distant();$0" + "\n  use b" at 26
        "#]],
        );
    }

    #[test]
    fn after_an_operand_there_is_nothing_but_then() {
        for statements in ["far = far $0", "echo.$0", "loop() $0", "var x$0"] {
            assert_eq!(labels(&in_program(statements)), [] as [&str; 0], "{statements}");
        }
        assert_eq!(labels(&in_program("if (far > 1.0) $0")), ["then"]);
    }
}
