//! The follow-ups of a syntax error, which are not reported: once the error is corrected, they are gone, or appear.
//!
//! Nothing is analysed because an error is not reported: each of them is still an `ERROR` node in the tree, and the file keeps
//! at least one error.

use mauve_syntax::{
    SyntaxError, SyntaxKind, SyntaxNode, SyntaxToken, TextSize, lex, previous_significant, tokens_at,
};

use super::*;

/// Returns the syntax errors of a file that are not follow-ups: the first of each line, without a `}` or an `else` of a block
/// whose header has an error; where the braces do not match, only the first, because all that is behind it may stand in another
/// block than it seems.
pub(super) fn syntax_errors(db: &dyn ModelDb, file: File) -> Vec<SyntaxError> {
    let parse = parse(db, file);
    if parse.errors().len() < 2 {
        return parse.errors().to_vec();
    }
    let Some(pairs) = matching_braces(file.text(db)) else {
        return parse.errors().iter().take(1).copied().collect();
    };
    let root = parse.syntax();
    let mut lines = FxHashSet::default();
    let errors = parse.errors().iter().filter(|error| {
        let open = block_before(&root, &pairs, error.range.start());
        let is_broken = |open: SyntaxToken| {
            open.parent().is_some_and(|parent| parent.kind() == SyntaxKind::ERROR)
                || lines.contains(&line_of(db, file, open.text_range().start()))
        };
        !open.is_some_and(is_broken) && lines.insert(line_of(db, file, error.range.start()))
    });
    errors.copied().collect()
}

/// Returns the `{` of the block that the `}` at `offset` closes, or that the `else` at `offset` continues.
fn block_before(
    root: &SyntaxNode,
    pairs: &FxHashMap<TextSize, TextSize>,
    offset: TextSize,
) -> Option<SyntaxToken> {
    let token = tokens_at(root, offset).right_biased()?;
    let close = match token.kind() {
        SyntaxKind::R_CURLY => token,
        SyntaxKind::ELSE_KW => previous_significant(&token)?,
        _ => return None,
    };
    tokens_at(root, *pairs.get(&close.text_range().start())?).right_biased()
}

/// Returns the lines of a file that have a reported syntax error.
#[salsa::tracked(returns(ref))]
fn broken_lines(db: &dyn ModelDb, workspace: Workspace, file: File) -> FxHashSet<usize> {
    let found = file_diagnostics(db, workspace, file).iter();
    let errors = found.filter(|it| *it.code == SYNTAX_ERROR);
    errors.map(|it| line_of(db, file, it.at.range(db).start())).collect()
}

/// Removes the diagnostics on lines that have a syntax error.
pub(super) fn remove_on_broken_lines<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    found: &mut Vec<Arc<Diagnostic<'db>>>,
) {
    let broken_in = |file: File| {
        is_model(file.path(db)).then(|| broken_lines(db, workspace, file)).filter(|broken| !broken.is_empty())
    };
    let mut files = FxHashMap::default();
    found.retain(|it| {
        let file = it.at.file(db);
        let broken = *files.entry(file).or_insert_with(|| broken_in(file));
        *it.code == SYNTAX_ERROR
            || broken.is_none_or(|broken| !broken.contains(&line_of(db, file, it.at.range(db).start())))
    });
}

/// Returns the `{` of each `}`; `None` if the braces do not match.
fn matching_braces(text: &str) -> Option<FxHashMap<TextSize, TextSize>> {
    let tokens = lex(text);
    let mut open = Vec::new();
    let mut pairs = FxHashMap::default();
    for index in 0..tokens.len() {
        let start = || TextSize::try_from(tokens.range(index).start).ok();
        match tokens.kind(index) {
            SyntaxKind::L_CURLY => open.push(start()?),
            SyntaxKind::R_CURLY => _ = pairs.insert(start()?, open.pop()?),
            _ => {}
        }
    }
    open.is_empty().then_some(pairs)
}
