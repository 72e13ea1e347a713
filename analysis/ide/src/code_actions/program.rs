//! The types in a core, and free names, for actions that declare something.

use mauve_hir::item_tree::{Direction, Name, SourceId, TypeRef};
use mauve_hir::{Binding, Builtin, Callee, ModelDb, Project, Semantics, Type, codel, type_of};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxKind, SyntaxNode};

/// Returns the first free name of `wanted`, `wanted2`, `wanted3`, ….
pub(super) fn free_name(wanted: &str, is_free: impl Fn(&str) -> bool) -> String {
    let numbered = (2..).map(|number| format!("{wanted}{number}"));
    std::iter::once(wanted.to_owned()).chain(numbered).find(|name| is_free(name)).unwrap_or_default()
}

/// A core, and the meaning of what stands in it.
pub(super) struct CorePrograms<'db> {
    pub(super) db: &'db dyn ModelDb,
    pub(super) project: Project<'db>,
    pub(super) semantics: Semantics<'db>,
}

impl<'db> CorePrograms<'db> {
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
            SyntaxKind::UNARY_EXPR => match ast::UnaryExpr::cast(parent.clone())?.own_token()?.text() {
                "!" => Some("bool".to_owned()),
                _ => self.expected_type(&parent),
            },
            SyntaxKind::BINARY_EXPR => {
                let binary = ast::BinaryExpr::cast(parent)?;
                match binary.own_token()?.text() {
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
}

pub(super) fn bare(expr: &ast::Expr) -> Option<ast::Expr> {
    match expr {
        ast::Expr::ParenExpr(inner) => bare(&inner.expr()?),
        other => Some(other.clone()),
    }
}
