//! Completion of the path of an `include`.

use std::path::Path;

use mauve_hir::{File, ModelDb, Workspace, includes, is_model, relative_path};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::{SyntaxNode, TextRange, TextSize, tokens_at};

use super::{Completion, CompletionKind, Completions};
use crate::position::before;

pub(super) fn paths(
    db: &dyn ModelDb,
    workspace: Workspace,
    file: File,
    root: &SyntaxNode,
    offset: TextSize,
) -> Option<Completions> {
    let (replaced, is_quoted) = path_at(root, offset)?;
    let mut found = Completions::default();
    let included: Vec<File> = includes(db, workspace, file).iter().flatten().copied().collect();
    let folder = file.path(db).parent().unwrap_or(Path::new("/"));
    for (path, &other) in workspace.files(db).iter().filter(|(path, _)| is_model(path)) {
        let by_model_path = workspace.model_path(db).iter().find_map(|it| path.strip_prefix(it).ok());
        let is_near = path.starts_with(workspace.folder(db));
        let shown = match by_model_path.filter(|_| !is_near) {
            Some(path) => path.to_path_buf(),
            None => relative_path(folder, path),
        };
        let shown = shown.display().to_string();
        if other == file || found.items.iter().any(|item| item.label == shown) {
            continue;
        }
        let mut item = Completion::new(CompletionKind::File, shown.as_str());
        if !is_quoted {
            item.insert = format!("\"{shown}\"");
        }
        // Paths that are already included come last.
        item.rank = if included.contains(&other) { 3 } else { u8::from(shown.starts_with("..")) };
        item.replaced = replaced;
        found.items.push(item);
    }
    found.items.sort_by_key(|item| item.rank);
    Some(found)
}

fn path_at(root: &SyntaxNode, offset: TextSize) -> Option<(TextRange, bool)> {
    let mut around = tokens_at(root, offset);
    let is_string = |kind| matches!(kind, STRING | UNTERMINATED_STRING);
    let string = around.clone().find(|it| is_string(it.kind()) && it.text_range().start() < offset);
    if let Some(token) = string {
        let is_path = token.parent().is_some_and(|parent| parent.kind() == INCLUDE);
        let range = token.text_range();
        let start = range.start() + TextSize::from(1);
        let end = match token.kind() {
            STRING => range.end() - TextSize::from(1),
            // The rest of the line may be anything.
            _ => offset,
        };
        return (is_path && offset <= end).then(|| (TextRange::new(start, end), true));
    }
    let word = around.clone().find(|it| it.kind().is_word() && it.text_range().start() < offset);
    let range = word.map_or(TextRange::empty(offset), |word| word.text_range());
    if around.clone().any(|it| it.kind().is_comment() && it.text_range().start() < offset) {
        return None;
    }
    let left = around.find_map(|token| before(token, range.start()))?;
    let is_include = left.kind() == INCLUDE_KW && left.parent().is_some_and(|it| it.kind() == INCLUDE);
    is_include.then_some((range, false))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::completion::testing::{labels, offered};
    use expect_test::expect;

    #[test]
    fn models_that_are_not_included_come_first() {
        let files = "\n//- /b.mal\n\n//- /parts/c.mal\n\n//- /other.toml\n\n";
        expect![[r#"
            0 parts/c.mal
            3 b.mal
        "#]]
        .assert_eq(&offered(&format!("//- /a.mal\ninclude \"b.mal\"\ninclude \"$0\"{files}"), 9));
        expect![[r#"
            0 c.mal ⇒ "\"c.mal\""
            1 ../b.mal ⇒ "\"../b.mal\""
        "#]]
        .assert_eq(&offered(&format!("//- /parts/a.mal\ninclude $0{files}"), 9));
        assert_eq!(labels(&format!("//- /a.mal\n// include \"$0{files}")), [] as [&str; 0]);
    }

    #[test]
    fn a_path_is_written_from_the_folder_of_the_file() {
        for (folder, file, expected) in [
            ("/a", "/a/b.mal", "b.mal"),
            ("/a", "/a/b/c.mal", "b/c.mal"),
            ("/a/b", "/a/c/d.mal", "../c/d.mal"),
            ("/", "/x.mal", "x.mal"),
        ] {
            assert_eq!(relative_path(Path::new(folder), Path::new(file)), Path::new(expected));
        }
    }
}
