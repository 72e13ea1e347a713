//! `textDocument/semanticTokens/full`, `…/full/delta` and `…/range`.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;

use mauve_hir::File;
use mauve_ide::TokenKind;
use mauve_syntax::TextRange;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    SemanticToken, SemanticTokens, SemanticTokensDelta, SemanticTokensDeltaParams, SemanticTokensEdit,
    SemanticTokensFullDeltaResult, SemanticTokensParams, SemanticTokensRangeParams,
    SemanticTokensRangeResult, SemanticTokensResult, Url,
};

use crate::lsp::position::LineIndex;
use crate::lsp::snapshot::Snapshot;

/// All tokens of a document.
pub(crate) fn full(
    snapshot: &Snapshot,
    params: &SemanticTokensParams,
) -> Result<Option<SemanticTokensResult>> {
    let url = &params.text_document.uri;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let data = encoded(snapshot, file, lines, None);
    let result_id = note(snapshot, url, file, Some(&data));
    Ok(Some(SemanticTokensResult::Tokens(SemanticTokens { result_id, data: data.to_vec() })))
}

/// What has changed in the tokens of a document; all of them, where it is not known what the client has.
pub(crate) fn delta(
    snapshot: &Snapshot,
    params: &SemanticTokensDeltaParams,
) -> Result<Option<SemanticTokensFullDeltaResult>> {
    let url = &params.text_document.uri;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let data = encoded(snapshot, file, lines, None);
    let previous = snapshot.tokens.previous(url, &params.previous_result_id);
    let result_id = note(snapshot, url, file, Some(&data));
    Ok(Some(match previous {
        Some(previous) => SemanticTokensFullDeltaResult::TokensDelta(SemanticTokensDelta {
            result_id,
            edits: edits(&previous, &data),
        }),
        None => SemanticTokensFullDeltaResult::Tokens(SemanticTokens { result_id, data: data.to_vec() }),
    }))
}

/// The tokens that touch a range.
pub(crate) fn range(
    snapshot: &Snapshot,
    params: &SemanticTokensRangeParams,
) -> Result<Option<SemanticTokensRangeResult>> {
    let (file, lines) = snapshot.file(&params.text_document)?;
    let range = lines.text_range(params.range);
    let data = encoded(snapshot, file, lines, Some(range)).to_vec();
    note(snapshot, &params.text_document.uri, file, None);
    Ok(Some(SemanticTokensRangeResult::Tokens(SemanticTokens { result_id: None, data })))
}

/// Notes what the client is given of an open document; gives the id of all of its tokens.
fn note(snapshot: &Snapshot, url: &Url, file: File, all: Option<&Arc<[SemanticToken]>>) -> Option<String> {
    let document = snapshot.documents.get(url)?;
    let meanings = mauve_ide::meanings_of_names(&snapshot.db, &snapshot.workspaces, file);
    let id = all.map(|tokens| {
        let mut hasher = DefaultHasher::new();
        for token in tokens.iter() {
            (token.delta_line, token.delta_start, token.length).hash(&mut hasher);
            (token.token_type, token.token_modifiers_bitset).hash(&mut hasher);
        }
        format!("{:016x}", hasher.finish())
    });
    let given = id.clone().zip(all.cloned());
    snapshot.tokens.gave(url, document.version, meanings, given);
    id
}

fn encoded(
    snapshot: &Snapshot,
    file: File,
    lines: LineIndex<'_>,
    range: Option<TextRange>,
) -> Arc<[SemanticToken]> {
    let legend = snapshot.capabilities.tokens;
    let found =
        mauve_ide::semantic_tokens(&snapshot.db, &snapshot.workspaces, file, range, legend.with_words);
    let mut types: HashMap<TokenKind, Option<u32>> = HashMap::new();
    let (mut line, mut column) = (0, 0);
    let tokens = found.iter().filter_map(|token| {
        let token_type = (*types.entry(token.kind).or_insert_with(|| legend.type_of(token.kind)))?;
        let range = lines.range(token.range);
        if range.start.line != line {
            column = 0;
        }
        let encoded = SemanticToken {
            delta_line: range.start.line.saturating_sub(line),
            delta_start: range.start.character.saturating_sub(column),
            length: range.end.character.saturating_sub(range.start.character),
            token_type,
            token_modifiers_bitset: legend.modifiers_of(token.modifiers),
        };
        (line, column) = (range.start.line, range.start.character);
        Some(encoded)
    });
    tokens.collect()
}

/// What makes `new` of `old`: nothing, or one edit between what both begin and end with. It counts numbers, of which a token
/// is five.
fn edits(old: &[SemanticToken], new: &[SemanticToken]) -> Vec<SemanticTokensEdit> {
    let same = |(one, two): &(&SemanticToken, &SemanticToken)| one == two;
    let start = old.iter().zip(new).take_while(same).count();
    let (old, new) = (old.get(start..).unwrap_or_default(), new.get(start..).unwrap_or_default());
    let end = old.iter().rev().zip(new.iter().rev()).take_while(same).count();
    let (deleted, put) = (old.len() - end, new.get(..new.len() - end).unwrap_or_default());
    if deleted == 0 && put.is_empty() {
        return Vec::new();
    }
    vec![SemanticTokensEdit {
        start: start as u32 * 5,
        delete_count: deleted as u32 * 5,
        data: Some(put.to_vec()),
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn token(of: u32) -> SemanticToken {
        SemanticToken { delta_line: of, delta_start: 1, length: 2, token_type: 3, token_modifiers_bitset: 4 }
    }

    #[test]
    fn edits_make_the_new_of_the_old() {
        let of = |letters: &str| letters.bytes().map(|letter| token(letter.into())).collect::<Vec<_>>();
        for old in ["", "a", "abc", "aabbaa", "abcabc"] {
            for new in ["", "a", "b", "abc", "aba", "aa", "aabbbaa", "xabcabc", "abcx"] {
                let edits = edits(&of(old), &of(new));
                let mut made = of(old);
                assert_eq!(edits.is_empty(), old == new);
                for SemanticTokensEdit { start, delete_count, data } in edits {
                    assert_eq!((start % 5, delete_count % 5), (0, 0));
                    let (start, count) = (start as usize / 5, delete_count as usize / 5);
                    made.splice(start..start + count, data.unwrap_or_default());
                }
                assert_eq!(made, of(new), "{old} {new}");
            }
        }
    }
}
