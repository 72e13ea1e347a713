//! What a call takes, while its arguments are typed.

use mauve_model::{File, ModelDb, Workspace, is_model, parse};
use mauve_syntax::SyntaxKind::{BLOCK_COMMENT, LINE_COMMENT};
use mauve_syntax::{TextRange, TextSize};

use crate::completion::decl_at;
use crate::completion::position::{Position, call_around, token_before};
use crate::completion::{Subject, documentation};
use crate::program::{Scope, subject};
use crate::project::projects_with;

/// What a call takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature {
    /// `astar(in origin: PoseStamped, out route: Path): bool`
    pub label: String,
    /// Where its parameters stand in that, in bytes.
    pub parameters: Vec<TextRange>,
    /// Which of them is being typed, from 0; as many as there are, or more: none.
    pub active: usize,
    /// How it is declared, and the comment above that, in Markdown.
    pub documentation: Option<String>,
}

/// What the innermost call around `offset` takes, in each way in which the projects that have the file understand it.
///
/// ```
/// use mauve_model::{Database, Workspace};
/// let db = Database::default();
/// let text = "codel f(in a: int, out b: bool): void core C(S) { update = { f(1, ".to_owned();
/// let offset = (text.len() as u32).into();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, std::path::Path::new("/a.mal")).expect("it is there");
/// let found = mauve_ide::signature_help(&db, &[workspace], file, offset);
/// assert_eq!(found[0].label, "f(in a: int, out b: bool): void");
/// assert_eq!(found[0].active, 1);
/// ```
pub fn signature_help(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
) -> Vec<Signature> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let root = parse(db, file).syntax();
    let offset = offset.min(root.text_range().end());
    let mut around = root.token_at_offset(offset).filter(|token| token.text_range().start() < offset);
    let Some(token) = around.next() else { return Vec::new() };
    let ends = token.text_range().end() <= offset;
    match token.kind() {
        LINE_COMMENT => return Vec::new(),
        BLOCK_COMMENT if !ends || !token.text().ends_with("*/") => return Vec::new(),
        _ => {}
    }
    let left = std::iter::successors(Some(token), token_before).find(|token| !token.kind().is_trivia());
    let Some(left) = left else { return Vec::new() };
    let Some(call) = call_around(&left) else { return Vec::new() };
    let at = Position::in_any_token(&root, offset);
    let mut found: Vec<Signature> = Vec::new();
    for project in projects_with(db, workspaces, file) {
        let decl = decl_at(db, file, call.callee.text_range());
        let Some(callable) = Scope::at(db, project, decl, &at).called(&call) else { continue };
        let (label, places) = callable.shown();
        let range = |(start, end): (usize, usize)| TextRange::new((start as u32).into(), (end as u32).into());
        let about: Option<Subject> = subject(db, &callable);
        let signature = Signature {
            label,
            parameters: places.into_iter().map(range).collect(),
            active: call.index,
            documentation: about.and_then(|about| documentation(db, workspaces, &about)),
        };
        if !found.contains(&signature) {
            found.push(signature);
        }
    }
    found
}
