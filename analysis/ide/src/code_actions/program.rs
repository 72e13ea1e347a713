//! The names, types and order of execution in a core, for refactorings of programs.

use std::cell::OnceCell;

use mauve_hir::item_tree::{Direction, Name, SourceId, TypeRef};
use mauve_hir::{
    Binding, Builtin, Callee, File, Location, ModelDb, Project, Semantics, Type, VariableOf, codel, shell_of,
    type_of,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{NodeOrToken, SyntaxKind, SyntaxNode, TextRange, is_whole};

use crate::occurrences::{Definition, FoundName, Role, in_declaration};

/// Returns the first free name of `wanted`, `wanted2`, `wanted3`, ….
pub(super) fn free_name(wanted: &str, is_free: impl Fn(&str) -> bool) -> String {
    let numbered = (2..).map(|number| format!("{wanted}{number}"));
    std::iter::once(wanted.to_owned()).chain(numbered).find(|name| is_free(name)).unwrap_or_default()
}

/// A complete core in which all names are resolved.
pub(super) struct Programs<'db> {
    pub(super) db: &'db dyn ModelDb,
    pub(super) project: Project<'db>,
    pub(super) semantics: Semantics<'db>,
    names: OnceCell<Vec<FoundName<'db>>>,
}

impl<'db> Programs<'db> {
    /// Returns the programs of the core `node`, or `None` if something in it is incomplete or unresolved.
    pub(super) fn of(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        file: File,
        node: &ast::Core,
    ) -> Option<Programs<'db>> {
        let it = Programs::with_unknown(db, project, file, node)?;
        (!it.semantics.inference.is_unresolved() && is_whole(node.syntax())).then_some(it)
    }

    /// [`Programs::of`] that accepts unresolved names, for actions that fix them.
    pub(super) fn with_unknown(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        file: File,
        node: &ast::Core,
    ) -> Option<Programs<'db>> {
        let semantics = Semantics::at(db, project, file, node.syntax().text_range())?;
        Some(Programs { db, project, semantics, names: OnceCell::new() })
    }

    /// Returns all names in the core.
    pub(super) fn names(&self) -> &[FoundName<'db>] {
        self.names.get_or_init(|| in_declaration(self.db, self.project, self.semantics.core))
    }

    pub(super) fn type_of(&self, expr: &ast::Expr) -> Option<&Type> {
        self.semantics.type_of(bare(expr)?.syntax())
    }

    fn written_type_of(&self, name: &ast::NameRef) -> Option<String> {
        match self.semantics.binding(name)? {
            Binding::Variable(id) => self.written(&self.semantics.inference.variable(id)?.ty, None),
            Binding::Feature(feature) => {
                let declared = feature.data(self.db)?.ty.as_ref();
                self.written(&feature.ty(self.db, self.project), declared.map(|it| it.path.clone()))
            }
        }
    }

    /// Returns the expected type at an expression, as written in this core.
    pub(super) fn expected_type(&self, expr: &SyntaxNode) -> Option<String> {
        let parent = expr.parent()?;
        let other = |binary: &ast::BinaryExpr| {
            [binary.lhs(), binary.rhs()].into_iter().flatten().find(|it| it.syntax() != expr)
        };
        match parent.kind() {
            SyntaxKind::PAREN_EXPR => self.expected_type(&parent),
            SyntaxKind::EXPR_STATEMENT => Some("void".to_owned()),
            SyntaxKind::IF_STATEMENT | SyntaxKind::GUARD => Some("bool".to_owned()),
            SyntaxKind::ASSIGN_STATEMENT => {
                self.written_type_of(&ast::AssignStatement::cast(parent)?.name_ref()?)
            }
            SyntaxKind::INITIALIZER => {
                Some(ast::Var::cast(parent.parent()?)?.ty()?.syntax().text().to_string())
            }
            SyntaxKind::UNARY_EXPR => match ast::UnaryExpr::cast(parent.clone())?.operator()?.text() {
                "!" => Some("bool".to_owned()),
                _ => self.expected_type(&parent),
            },
            SyntaxKind::BINARY_EXPR => {
                let binary = ast::BinaryExpr::cast(parent)?;
                match binary.operator()?.text() {
                    "&&" | "||" => Some("bool".to_owned()),
                    _ => self.written_type(&other(&binary)?),
                }
            }
            SyntaxKind::ARGUMENT_LIST => {
                let index =
                    ast::ArgumentList::cast(parent.clone())?.exprs().position(|it| it.syntax() == expr)?;
                let call = ast::CallExpr::cast(parent.parent()?)?;
                match self.semantics.callee(&call)? {
                    Callee::Codel(of) => {
                        let ty = codel(self.db, of)?.parameters.get(index)?.ty.as_ref()?;
                        let found = type_of(self.db, self.project, of, Some(ty));
                        self.written(&found, Some(ty.path.clone()))
                    }
                    Callee::Builtin(Builtin::Read | Builtin::Write) if index == 1 => {
                        match call.argument_list()?.exprs().next()? {
                            ast::Expr::NameExpr(port) => self.written_type_of(&port.name_ref()?),
                            _ => None,
                        }
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// Returns whether an expression is the name of a port or an operation, which is no value.
    pub(super) fn is_no_value(&self, expr: &ast::Expr) -> bool {
        let Some(ast::Expr::NameExpr(name)) = bare(expr) else { return false };
        let binding = name.name_ref().and_then(|it| self.semantics.binding(&it));
        matches!(binding, Some(Binding::Feature(feature)) if !feature.kind.is_value())
    }

    pub(super) fn written_type(&self, expr: &ast::Expr) -> Option<String> {
        if let Some(ast::Expr::NameExpr(name)) = bare(expr)
            && let Some(written) = name.name_ref().and_then(|it| self.written_type_of(&it))
        {
            return Some(written);
        }
        let ty = self.type_of(expr)?;
        let declared = match bare(expr)? {
            ast::Expr::CallExpr(call) => match self.semantics.callee(&call)? {
                Callee::Codel(of) => codel(self.db, of).and_then(|it| it.result.clone()),
                _ => None,
            },
            _ => None,
        };
        self.written(ty, declared.map(|it| it.path))
    }

    /// Returns the spelling of a type in this core; `declared` is its spelling elsewhere.
    fn written(&self, ty: &Type, declared: Option<Vec<Name>>) -> Option<String> {
        let is_written = |path: Vec<Name>| {
            let it = TypeRef { path, id: SourceId(0) };
            let found = type_of(self.db, self.project, self.semantics.core, Some(&it));
            (found == *ty).then(|| it.to_string())
        };
        let declared = declared.and_then(is_written);
        match ty {
            Type::Void | Type::PortStatus | Type::CallStatus | Type::Handle(_) => None,
            Type::Message(package, name) => declared
                .or_else(|| is_written(vec![name.clone()]))
                .or_else(|| is_written(vec![package.clone(), name.clone()])),
            Type::Unknown => declared,
            known => is_written(vec![known.written()?.as_ref().into()]),
        }
    }

    pub(super) fn is_output(&self, expr: &SyntaxNode) -> bool {
        let output = || {
            let list = ast::ArgumentList::cast(expr.parent()?)?;
            let index = list.exprs().position(|it| it.syntax() == expr)?;
            Some(match self.semantics.callee(&ast::CallExpr::cast(list.syntax().parent()?)?)? {
                Callee::Codel(of) => codel(self.db, of)?.parameters.get(index)?.direction != Direction::In,
                Callee::Builtin(Builtin::Write | Builtin::Send) => false,
                _ => true,
            })
        };
        output().unwrap_or(false)
    }

    /// Returns the variable of a definition, if it belongs to this core.
    pub(super) fn variable(&self, definition: &Definition<'db>) -> Option<&'db VariableOf> {
        let Definition::At(place) = definition else { return None };
        let is_it = |it: &VariableOf| Location::Source(self.semantics.core, it.name.id) == *place;
        self.semantics.inference.variables().map(|(_, it)| it).find(|it| is_it(it))
    }

    pub(super) fn names_in(&self, range: TextRange) -> impl Iterator<Item = &FoundName<'db>> {
        self.names().iter().filter(move |name| range.contains_range(name.range))
    }

    /// Returns whether a call in `node` runs an operation of the same core, which may change its variables.
    pub(super) fn calls_own_operation(&self, node: &SyntaxNode) -> bool {
        calls(node).any(|call| matches!(self.semantics.callee(&call), None | Some(Callee::Operation(_))))
    }

    pub(super) fn fresh(&self, node: &ast::Core, wanted: &str) -> String {
        let tokens = node.syntax().descendants_with_tokens().filter_map(NodeOrToken::into_token);
        let words: Vec<String> =
            tokens.filter(|it| it.kind().is_word()).map(|it| it.text().to_owned()).collect();
        let shell = shell_of(self.db, self.project, self.semantics.core);
        let features = shell.map(|shell| mauve_hir::features_of(self.db, self.project, shell));
        free_name(wanted, |name| {
            !words.iter().any(|word| word == name) && features.is_none_or(|it| it.get(name).is_none())
        })
    }

    /// Returns whether `statement` executes `expr` first, exactly once, so that it can be executed directly before.
    ///
    /// No other call may come before or beside it, it must not depend on a condition, and the variables that it changes must not
    /// be read beside it.
    pub(super) fn comes_first(&self, statement: &SyntaxNode, expr: &ast::Expr) -> bool {
        let range = expr.syntax().text_range();
        // Of an `if`, only the condition: the branches are executed later or not at all.
        let at_once = match ast::IfStatement::cast(statement.clone()) {
            Some(it) => match it.condition() {
                Some(condition) => condition.syntax().clone(),
                None => return false,
            },
            None => statement.clone(),
        };
        if !at_once.text_range().contains_range(range) {
            return false;
        }
        let is_conditional = expr.syntax().ancestors().skip(1).take_while(|it| it != statement).any(|it| {
            let Some(binary) = ast::BinaryExpr::cast(it.clone()) else {
                return it.kind() == SyntaxKind::BLOCK;
            };
            let is_second = binary.rhs().is_some_and(|rhs| rhs.syntax().text_range().contains_range(range));
            let operator = binary.operator().map(|it| it.text().to_owned());
            is_second && matches!(operator.as_deref(), Some("&&" | "||"))
        });
        let beside = calls(&at_once).any(|call| {
            let of = call.syntax().text_range();
            !of.contains_range(range) && !range.contains_range(of)
        });
        !is_conditional && !beside && !self.changes_beside(expr.syntax(), at_once.text_range(), range)
    }

    /// Returns whether `value`, executed at `place`, changes a variable that `statement` reads elsewhere.
    pub(super) fn changes_beside(&self, value: &SyntaxNode, statement: TextRange, place: TextRange) -> bool {
        let changes_anything = self.calls_own_operation(value);
        let changed = self.names_in(value.text_range()).filter(|it| it.role != Role::Read);
        let changed: Vec<_> = changed.collect();
        let mut read = self.names_in(statement).filter(|it| it.role == Role::Read);
        read.any(|other| {
            !place.contains_range(other.range)
                && (changes_anything || changed.iter().any(|it| it.definition == other.definition))
        })
    }
}

pub(super) fn bare(expr: &ast::Expr) -> Option<ast::Expr> {
    match expr {
        ast::Expr::ParenExpr(inner) => bare(&inner.expr()?),
        other => Some(other.clone()),
    }
}

pub(super) fn calls(node: &SyntaxNode) -> impl Iterator<Item = ast::CallExpr> + use<> {
    node.descendants().filter_map(ast::CallExpr::cast)
}

pub(super) fn statement_of(node: &SyntaxNode) -> Option<SyntaxNode> {
    let statement = node.ancestors().find(|it| ast::Statement::can_cast(it.kind()))?;
    (statement.parent()?.kind() == SyntaxKind::BLOCK).then_some(statement)
}
