//! `textDocument/foldingRange`.

use mauve_ide::{FoldingKind, FoldingRange};
use mauve_syntax::TextSize;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, FoldingRangeKind, FoldingRangeParams};

use crate::snapshot::Snapshot;

/// Returns all folding ranges of a document. The protocol has the limit of a client as a hint, which is not followed.
pub(crate) fn folding_ranges(
    snapshot: &Snapshot,
    params: &FoldingRangeParams,
) -> Result<Option<Vec<lsp_types::FoldingRange>>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let capabilities = snapshot.capabilities;
    let folds = mauve_ide::folding_ranges(&snapshot.db, file);
    let text: &str = file.text(&snapshot.db);
    let line = |offset: TextSize| lines.position(offset).line;
    let mut found: Vec<lsp_types::FoldingRange> = match capabilities.line_folds_only {
        true => whole_lines(text, &folds, line),
        false => {
            let fold = |fold: &FoldingRange| {
                let range = lines.range(fold.range);
                lsp_types::FoldingRange {
                    start_line: range.start.line,
                    start_character: Some(range.start.character),
                    end_line: range.end.line,
                    end_character: Some(range.end.character),
                    kind: kind(fold.kind),
                    collapsed_text: Some(format!("… {} lines …", range.end.line - range.start.line)),
                }
            };
            folds.iter().map(fold).collect()
        }
    };
    if !capabilities.collapsed_texts {
        found.iter_mut().for_each(|fold| fold.collapsed_text = None);
    }
    Ok(Some(found))
}

fn kind(kind: FoldingKind) -> Option<FoldingRangeKind> {
    match kind {
        FoldingKind::Block => None,
        FoldingKind::Comment => Some(FoldingRangeKind::Comment),
        FoldingKind::Imports => Some(FoldingRangeKind::Imports),
        FoldingKind::Region => Some(FoldingRangeKind::Region),
    }
}

/// The folds for a client that hides whole lines and shows the first one. What closes a block stays to be seen, and so does
/// a line in which another fold begins; of those that begin in one line, the greatest is left.
///
/// In place of such a fold, a client shows the text instead of the line: so it begins with it.
fn whole_lines(
    text: &str,
    folds: &[FoldingRange],
    line: impl Fn(TextSize) -> u32,
) -> Vec<lsp_types::FoldingRange> {
    let mut found: Vec<lsp_types::FoldingRange> = Vec::new();
    for fold in folds {
        let (start_line, mut end_line) = (line(fold.range.start()), line(fold.range.end()));
        let inside = text.get(std::ops::Range::<usize>::from(fold.range)).unwrap_or_default();
        let last = inside.rsplit('\n').next().unwrap_or_default();
        let next = folds.get(folds.partition_point(|other| other.range.start() < fold.range.end()));
        let closes = fold.kind == FoldingKind::Block && last.trim().is_empty();
        if closes || next.is_some_and(|next| line(next.range.start()) == end_line) {
            end_line -= 1;
        }
        let is_known = found.last().is_some_and(|known| known.start_line == start_line);
        if start_line < end_line && !is_known {
            let before = text.get(..fold.range.start().into()).unwrap_or_default();
            let first = before.rsplit('\n').next().unwrap_or_default();
            let closing = match fold.kind {
                FoldingKind::Block => {
                    text.get(fold.range.end().into()..).and_then(|rest| rest.chars().next())
                }
                _ => None,
            };
            let closing = closing.map(|closing| format!(" {closing}")).unwrap_or_default();
            let collapsed = format!("{first} … {} lines …{closing}", end_line - start_line);
            found.push(lsp_types::FoldingRange {
                start_line,
                end_line,
                kind: kind(fold.kind),
                collapsed_text: Some(collapsed),
                ..lsp_types::FoldingRange::default()
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_hir::{Database, Workspace};

    fn folds(text: &str) -> Vec<lsp_types::FoldingRange> {
        let db = Database::default();
        let path = std::path::PathBuf::from("/a.mal");
        let workspace = Workspace::of_texts(&db, "/".into(), [(path.clone(), text.to_owned())]);
        let file = workspace.file(&db, &path).unwrap();
        let line = |offset: TextSize| text[..offset.into()].matches('\n').count() as u32;
        whole_lines(text, &mauve_ide::folding_ranges(&db, file), line)
    }

    fn lines(text: &str) -> Vec<(u32, u32)> {
        folds(text).iter().map(|fold| (fold.start_line, fold.end_line)).collect()
    }

    #[test]
    fn what_closes_a_block_stays_to_be_seen() {
        assert_eq!(lines("shell S {\n  a\n}\n"), [(0, 1)]);
        assert_eq!(lines("shell S {\n  property a: int }\n"), [(0, 1)]);
        assert_eq!(lines("shell S {\n}\n"), []);
        assert_eq!(lines("// a\n// b\n// c\n"), [(0, 2)]);
        assert_eq!(lines("include \"a\"\ninclude \"b\" // b\n"), [(0, 1)]);
        let text = "core C(S) {\n  update = { if a then {\n    b;\n  } else {\n    c; } }\n}\n";
        assert_eq!(lines(text), [(0, 4), (1, 4), (3, 4)]);
        // The second line is the end of one and the beginning of another.
        assert_eq!(lines("/* a\nb\nc */ shell S {\n  d\n}\n"), [(0, 1), (2, 3)]);
    }

    #[test]
    fn they_nest_whatever_the_text() {
        for name in ["navigation", "switch", "gmapping"] {
            let path = mauve_tests::models().join(format!("p3dx/components/{name}.mal"));
            let text = std::fs::read_to_string(path).unwrap();
            // Line breaks where there were none, and the other way round.
            for (from, to) in
                [("", ""), ("\n", " "), (" ", "\n"), ("}\n", "} "), ("{", "/*\n*/ {"), (";", "}\n{")]
            {
                let mut text = text.clone();
                for at in (0..text.len()).rev().step_by(7).filter(|_| !from.is_empty()) {
                    if text.get(at..).is_some_and(|rest| rest.starts_with(from)) {
                        text.replace_range(at..at + from.len(), to);
                    }
                }
                let found = lines(&text);
                assert!(!found.is_empty());
                for (index, (start, end)) in found.iter().enumerate() {
                    assert!(start < end && (*end as usize) < text.split('\n').count());
                    for (other, other_end) in &found[index + 1..] {
                        assert!(start < other && (other > end || other_end <= end), "{text}");
                    }
                }
            }
        }
    }
}
