//! The statement around a location, for fixes that rewrite it.

use super::*;
use mauve_syntax::{SyntaxKind, SyntaxNode, ast, ast::AstNode, significant_tokens, token_at};

/// `target = value;`
pub(super) struct Assignment<'db> {
    /// The text of the target.
    pub(super) target: String,
    /// The text of the value.
    pub(super) value: String,
    at: Location<'db>,
}

impl<'db> Assignment<'db> {
    /// Adds a fix that replaces the assignment, without its `;`.
    pub(super) fn replaced(&self, found: Diagnostic<'db>, text: String) -> Diagnostic<'db> {
        found.fix(format!("Write `{text}`"), self.at.clone(), text)
    }
}

/// Returns the innermost node of this kind around a location.
pub(super) fn ancestor(db: &dyn ModelDb, at: &Location<'_>, kind: SyntaxKind) -> Option<SyntaxNode> {
    let root = parse(db, at.file(db)).syntax();
    let token = token_at(&root, at.range(db).start())?;
    token.parent_ancestors().find(|node| node.kind() == kind)
}

/// Returns the assignment around a location, if it is on one line and has no comment.
pub(super) fn assignment_at<'db>(db: &'db dyn ModelDb, at: &Location<'db>) -> Option<Assignment<'db>> {
    let node = ancestor(db, at, SyntaxKind::ASSIGN_STATEMENT)?;
    let (target, value) = (node.first_child()?, ast::AssignStatement::cast(node.clone())?.expr()?);
    let (start, end) = (target.text_range().start(), value.syntax().text_range().end());
    let text = node.text().to_string();
    if text.contains(['\n', '\r']) || text.contains("/*") || text.contains("//") {
        return None;
    }
    Some(Assignment {
        target: target.text().to_string().trim().to_owned(),
        value: value.syntax().text().to_string().trim().to_owned(),
        at: Location::Range(at.file(db), start.into(), end.into()),
    })
}

/// Returns the location of `==` in the statement `name == value;`.
pub(super) fn comparison_at<'db>(db: &'db dyn ModelDb, at: &Location<'db>) -> Option<Location<'db>> {
    let node = ancestor(db, at, SyntaxKind::EXPR_STATEMENT)?;
    let comparison = node.first_child().filter(|it| it.kind() == SyntaxKind::BINARY_EXPR)?;
    comparison.first_child().filter(|it| it.kind() == SyntaxKind::NAME_EXPR)?;
    let equals = significant_tokens(&comparison).find(|it| it.text() == "==")?;
    let range = equals.text_range();
    Some(Location::Range(at.file(db), range.start().into(), range.end().into()))
}
