//! The statements of a program, as the body of a member function.

use mauve_hir::item_tree::{Expr, SourceId, Statement, Variable};
use mauve_hir::{Builtin, Callee, Type, returns};

use super::expression::{CodeLine, ExpressionWriter};
use super::{Class, Routine, RoutineBody};
use crate::trace::program_key;

/// Returns the head of a program, and the lines between the braces.
pub(super) fn definition<'db>(class: &Class<'_, 'db>, routine: &Routine<'db>) -> (String, Vec<CodeLine>) {
    class.model.db.unwind_if_revision_cancelled();
    let mut writer = ExpressionWriter::new(class);
    let parameters = class.parameters(routine, &mut writer.scope.names);
    let mut texts = Vec::new();
    for parameter in parameters {
        texts.push(parameter.declared);
        writer.locals.extend(parameter.index.map(|index| (index, parameter.name)));
    }
    let head =
        format!("{} {}::{}({})", class.cpp(&routine.result), class.name, routine.function, texts.join(", "));
    let key = program_key(class.model.db, class.component, &routine.program);
    writer.line(format!("MAUVE_TRACE_PROGRAM(getName(), {key});"));
    match &routine.body {
        RoutineBody::Guard(condition) => {
            let value = writer.value(condition, &Type::Bool);
            writer.line(format!("return {};", value.text));
        }
        RoutineBody::Program(program) => {
            writer.statements(&program.statements, &routine.result);
            if routine.result == Type::Bool && !returns(&program.statements) {
                writer.line("return true;");
            }
        }
    }
    (head, writer.lines)
}

impl<'db> ExpressionWriter<'_, '_, 'db> {
    fn statements(&mut self, statements: &'db [Statement], result: &Type) {
        for statement in statements {
            self.statement(statement, result);
        }
    }

    /// Writes the statements of a block, one level deeper. Their declarations end with the block.
    fn block(&mut self, statements: &'db [Statement], result: &Type) {
        self.scope.begin_block();
        self.depth += 1;
        self.statements(statements, result);
        self.depth -= 1;
        self.scope.end_block();
    }

    fn statement(&mut self, statement: &'db Statement, result: &Type) {
        match statement {
            Statement::Variable(variable) => self.local(variable),
            Statement::If { condition, then, otherwise, .. } => {
                let condition = self.expr(condition);
                self.branches("", condition.text, then, otherwise.as_deref(), result);
            }
            Statement::Block(statements) => {
                self.line("{");
                self.block(statements, result);
                self.line("}");
            }
            Statement::Return(_, None) => self.line("return;"),
            Statement::Return(_, Some(value)) => {
                let value = self.value(value, result);
                self.line(format!("return {};", value.text));
            }
            Statement::Assign(target, value) => self.assign(target.id, value),
            Statement::Expr(Expr::Call { callee, arguments, .. }) if self.is_send(callee.id) => {
                self.send(None, arguments);
            }
            Statement::Expr(value) => {
                let code = self.expr(value);
                if matches!(value, Expr::Call { .. }) {
                    self.line(format!("{};", code.text));
                } else {
                    self.line(format!("static_cast<void>({});", code.text));
                }
            }
        }
    }

    /// Writes `if`, and `else if` if no statement is needed between the two.
    fn branches(
        &mut self,
        before: &str,
        condition: String,
        then: &'db [Statement],
        otherwise: Option<&'db [Statement]>,
        result: &Type,
    ) {
        self.line(format!("{before}if ({condition}) {{"));
        self.block(then, result);
        match otherwise {
            None | Some([]) => self.line("}"),
            Some([Statement::If { condition, then, otherwise, .. }]) => {
                self.scope.begin_block();
                let (condition, needed) = self.expr_apart(condition);
                if needed.is_empty() {
                    self.branches("} else ", condition.text, then, otherwise.as_deref(), result);
                } else {
                    self.line("} else {");
                    self.lines.extend(needed);
                    self.depth += 1;
                    self.branches("", condition.text, then, otherwise.as_deref(), result);
                    self.depth -= 1;
                    self.line("}");
                }
                self.scope.end_block();
            }
            Some(otherwise) => {
                self.line("} else {");
                self.block(otherwise, result);
                self.line("}");
            }
        }
    }

    fn local(&mut self, variable: &'db Variable) {
        let Some(index) = self.class.variable_at(variable.name.id) else { return };
        let ty = self.class.type_of_variable(index);
        let value = variable.value.as_ref().map(|value| self.value(value, &ty));
        // The initial value may refer to a variable that the new one hides.
        let name = self.scope.declare(&variable.name.name);
        let cpp = self.class.cpp(&ty);
        match value {
            Some(value) => self.line(format!("{cpp} {name} = {};", value.text)),
            None => self.line(format!("{cpp} {name}{{}};")),
        }
        if !self.class.read.contains(&index) && !matches!(ty, Type::String | Type::Message(..)) {
            self.line(format!("static_cast<void>({name});"));
        }
        self.locals.insert(index, name);
    }

    fn is_send(&self, callee: SourceId) -> bool {
        self.class.inference.callee(callee) == Some(Callee::Builtin(Builtin::Send))
    }

    fn assign(&mut self, target: SourceId, value: &'db Expr) {
        let Some(index) = self.variable(target) else { return };
        if let Expr::Call { callee, arguments, .. } = value
            && self.is_send(callee.id)
        {
            return self.send(Some(index), arguments);
        }
        let name = self.variable_name(index);
        let value = self.value(value, &self.class.type_of_variable(index));
        if value.text == name {
            // Compilers warn of an assignment of a variable to itself.
            self.line(format!("static_cast<void>({name});"));
        } else {
            self.line(format!("{name} = {};", value.text));
        }
    }
}
