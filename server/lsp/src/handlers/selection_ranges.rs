//! `textDocument/selectionRange`.

use mauve_syntax::TextRange;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{SelectionRange, SelectionRangeParams};

use crate::position::LineIndex;
use crate::snapshot::Snapshot;

/// So many are given for a position: each stands in the one before, and a client may not read JSON that is much deeper.
const MOST: usize = 60;

/// What belongs together around each position.
pub(crate) fn selection_ranges(
    snapshot: &Snapshot,
    params: &SelectionRangeParams,
) -> Result<Option<Vec<SelectionRange>>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let ranges = params.positions.iter().map(|position| {
        let offset = lines.offset(*position);
        nested(lines, &mauve_ide::selection_ranges(&snapshot.db, file, offset))
    });
    // One for each, or none at all.
    Ok(ranges.collect())
}

fn nested(lines: LineIndex<'_>, ranges: &[TextRange]) -> Option<SelectionRange> {
    let (last, inner) = ranges.split_last()?;
    let mut found: Option<SelectionRange> = None;
    // The least of them, and the file.
    for range in std::iter::once(last).chain(inner.iter().take(MOST - 1).rev()) {
        let range = lines.range(*range);
        found = Some(SelectionRange { range, parent: found.map(Box::new) });
    }
    found
}
