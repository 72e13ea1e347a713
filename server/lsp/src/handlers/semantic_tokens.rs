//! `textDocument/semanticTokens/full`, `…/full/delta` and `…/range`.
//!
//! | names of | type | in a client that does not know it |
//! |---|---|---|
//! | libraries, packages | `namespace` | |
//! | codels | `codel` | `function` |
//! | shells, cores, components | `shell`, `core`, `component` | `interface`, `class`, `class` |
//! | architectures, deployments | `architecture`, `deployment` | `struct` |
//! | instances | `instance` | `variable` |
//! | ports, properties and constants | `port`, `property` | `property` |
//! | operations, handlers | `operation`, `handler` | `method`, `variable` |
//! | states, transitions | `state`, `transition` | `enumMember`, `event` |
//! | variables, parameters | `variable`, `parameter` | |
//! | messages, other types | `struct`, `type` | |
//!
//! `editors/vscode/package.json` and `editors/nvim/lsp/mauve.lua` tell their editors of the types and modifiers that are ours.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;

use mauve_hir::File;
use mauve_ide::{SymbolKind, TokenKind, TokenModifier};
use mauve_syntax::TextRange;
use serde_json::Value;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokens, SemanticTokensDelta,
    SemanticTokensDeltaParams, SemanticTokensEdit, SemanticTokensFullDeltaResult, SemanticTokensFullOptions,
    SemanticTokensLegend, SemanticTokensOptions, SemanticTokensParams, SemanticTokensRangeParams,
    SemanticTokensRangeResult, SemanticTokensResult, Url,
};

use crate::capabilities::Legend;
use crate::position::LineIndex;
use crate::snapshot::Snapshot;

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
    let meanings = snapshot.meanings(file);
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
        mauve_ide::semantic_tokens(&snapshot.db, snapshot.project(file), file, range, legend.with_words);
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

/// The token types: those of the protocol, then those of the language.
const TYPES: &str = "namespace type class interface struct parameter variable property enumMember event function method keyword \
                     comment string number operator codel shell core component architecture deployment instance port operation \
                     handler state transition";

fn types() -> impl Iterator<Item = &'static str> {
    TYPES.split(' ')
}

/// The modifiers, those of the protocol first.
const MODIFIERS: [(TokenModifier, &str); 9] = [
    (TokenModifier::Declaration, "declaration"),
    (TokenModifier::Definition, "definition"),
    (TokenModifier::Readonly, "readonly"),
    (TokenModifier::Modification, "modification"),
    (TokenModifier::DefaultLibrary, "defaultLibrary"),
    (TokenModifier::Input, "input"),
    (TokenModifier::Output, "output"),
    (TokenModifier::Required, "required"),
    (TokenModifier::Provided, "provided"),
];

/// What a token is, by the names that the protocol has for it: the first that the client knows.
fn names_of(kind: TokenKind) -> &'static [&'static str] {
    let kind = match kind {
        TokenKind::Name(kind) => kind,
        TokenKind::Function => return &["function"],
        TokenKind::Field => return &["property"],
        TokenKind::Status => return &["enumMember", "keyword"],
        TokenKind::Keyword => return &["keyword"],
        TokenKind::Comment => return &["comment"],
        TokenKind::String => return &["string"],
        TokenKind::Number => return &["number"],
        TokenKind::Operator => return &["operator"],
    };
    match kind {
        SymbolKind::Library | SymbolKind::Package => &["namespace"],
        SymbolKind::Codel => &["codel", "function"],
        SymbolKind::Shell => &["shell", "interface", "class", "type"],
        SymbolKind::Core => &["core", "class", "type"],
        SymbolKind::Component => &["component", "class", "type"],
        SymbolKind::Architecture => &["architecture", "struct", "class", "type"],
        SymbolKind::Deployment => &["deployment", "struct", "class", "type"],
        SymbolKind::Instance | SymbolKind::Activity => &["instance", "variable"],
        SymbolKind::Port => &["port", "property", "variable"],
        SymbolKind::Property | SymbolKind::Constant => &["property", "variable"],
        SymbolKind::Operation => &["operation", "method", "function"],
        SymbolKind::Hook => &["method", "function"],
        SymbolKind::Handler => &["handler", "variable"],
        SymbolKind::Variable => &["variable"],
        SymbolKind::Parameter => &["parameter", "variable"],
        SymbolKind::State => &["state", "enumMember", "variable"],
        SymbolKind::Transition => &["transition", "event", "variable"],
        SymbolKind::Message => &["struct", "class", "type"],
        SymbolKind::Type => &["type"],
        SymbolKind::File => &[],
    }
}

impl Legend {
    /// What the client of this name knows; nothing, where it does not ask for tokens.
    pub(crate) fn of(client: Option<&Value>, name: &str) -> Legend {
        let Some(client) = client else { return Legend::default() };
        let bits = |known: &mut dyn Iterator<Item = bool>| {
            known.enumerate().map(|(bit, known)| u32::from(known) << bit).sum()
        };
        let knows = |list: &str, name: &str| {
            client[list].as_array().is_some_and(|all| all.iter().any(|it| it == name))
        };
        Legend {
            types: bits(&mut types().map(|name| knows("tokenTypes", name))),
            modifiers: bits(&mut MODIFIERS.iter().map(|(_, name)| knows("tokenModifiers", name))),
            with_words: client["augmentsSyntaxTokens"] == false,
            // On a refresh Neovim (0.12.4) asks for a part and for what has changed at once, and then changes the part as if it
            // were the whole.
            with_range: name != "Neovim",
        }
    }

    /// Returns the server's capabilities for this client.
    pub(crate) fn options(self) -> Option<SemanticTokensOptions> {
        let types = (0..).zip(types()).filter(|(bit, _)| self.types >> bit & 1 == 1);
        let modifiers = (0..).zip(MODIFIERS).filter(|(bit, _)| self.modifiers >> bit & 1 == 1);
        let legend = SemanticTokensLegend {
            token_types: types.map(|(_, name)| SemanticTokenType::new(name)).collect(),
            token_modifiers: modifiers.map(|(_, (_, name))| SemanticTokenModifier::new(name)).collect(),
        };
        (self.types != 0).then_some(SemanticTokensOptions {
            legend,
            range: Some(self.with_range),
            full: Some(SemanticTokensFullOptions::Delta { delta: Some(true) }),
            ..SemanticTokensOptions::default()
        })
    }

    /// The number of a type in the legend.
    fn type_of(self, kind: TokenKind) -> Option<u32> {
        let bits = names_of(kind).iter().filter_map(|name| types().position(|known| known == *name));
        let bit = bits.into_iter().find(|bit| self.types >> bit & 1 == 1)?;
        Some((self.types & ((1 << bit) - 1)).count_ones())
    }

    fn modifiers_of(self, modifiers: mauve_ide::TokenModifiers) -> u32 {
        let known = (0..).zip(MODIFIERS).filter(|(bit, _)| self.modifiers >> bit & 1 == 1);
        let bits = known.enumerate().filter(|(_, (_, (modifier, _)))| modifiers.has(*modifier));
        bits.map(|(number, _)| 1 << number).sum()
    }
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

    fn client(types: &[&str], modifiers: &[&str]) -> Value {
        serde_json::json!({"tokenTypes": types, "tokenModifiers": modifiers})
    }

    #[test]
    fn a_client_is_told_of_nothing_that_it_does_not_know() {
        let legend =
            Legend::of(Some(&client(&["function", "port", "type", "regexp"], &["output", "async"])), "");
        let known = legend.options().unwrap().legend;
        let types: Vec<&str> = known.token_types.iter().map(SemanticTokenType::as_str).collect();
        assert_eq!(types, ["type", "function", "port"]);
        let name = |kind| legend.type_of(TokenKind::Name(kind)).map(|number| types[number as usize]);
        assert_eq!(name(SymbolKind::Codel), Some("function"));
        assert_eq!(name(SymbolKind::Port), Some("port"));
        assert_eq!(name(SymbolKind::Component), Some("type"));
        assert_eq!(name(SymbolKind::Variable), None);
        let modifiers = mauve_ide::TokenModifiers::default()
            .with(TokenModifier::Output)
            .with(TokenModifier::Modification);
        assert_eq!(legend.modifiers_of(modifiers), 1);
        assert_eq!(Legend::of(None, "").options(), None);
    }

    #[test]
    fn every_type_that_is_meant_is_in_the_list() {
        let all = client(&types().collect::<Vec<_>>(), &[]);
        let legend = Legend::of(Some(&all), "");
        for kind in [SymbolKind::Codel, SymbolKind::State, SymbolKind::Transition, SymbolKind::Library] {
            let number = legend.type_of(TokenKind::Name(kind)).unwrap() as usize;
            assert_eq!(types().nth(number).unwrap(), names_of(TokenKind::Name(kind))[0]);
        }
    }
}
