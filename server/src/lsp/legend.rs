//! The types and modifiers of semantic tokens that a client knows.
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

use mauve_ide::{SymbolKind, TokenKind, TokenModifier};
use tower_lsp::lsp_types::{
    SemanticTokenModifier, SemanticTokenType, SemanticTokensClientCapabilities, SemanticTokensFullOptions,
    SemanticTokensLegend, SemanticTokensOptions,
};

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

/// Those of our types and modifiers that a client knows, each a bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Legend {
    types: u32,
    modifiers: u32,
    /// Has it no colours of its own for what is not a name?
    pub(crate) with_words: bool,
    /// Does it ask about a part of a text rightly?
    with_range: bool,
}

impl Legend {
    /// What the client of this name knows; nothing, where it does not ask for tokens.
    pub(crate) fn of(client: Option<&SemanticTokensClientCapabilities>, name: &str) -> Legend {
        let Some(client) = client else { return Legend::default() };
        let bits = |known: &mut dyn Iterator<Item = bool>| {
            known.enumerate().map(|(bit, known)| u32::from(known) << bit).sum()
        };
        let knows_type = |name: &str| client.token_types.iter().any(|it| it.as_str() == name);
        let knows_modifier =
            |name: &str| client.token_modifiers.contains(&SemanticTokenModifier::from(name.to_owned()));
        Legend {
            types: bits(&mut types().map(knows_type)),
            modifiers: bits(&mut MODIFIERS.iter().map(|(_, name)| knows_modifier(name))),
            with_words: client.augments_syntax_tokens == Some(false),
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
    pub(crate) fn type_of(self, kind: TokenKind) -> Option<u32> {
        let bits = names_of(kind).iter().filter_map(|name| types().position(|known| known == *name));
        let bit = bits.into_iter().find(|bit| self.types >> bit & 1 == 1)?;
        Some((self.types & ((1 << bit) - 1)).count_ones())
    }

    pub(crate) fn modifiers_of(self, modifiers: mauve_ide::TokenModifiers) -> u32 {
        let known = (0..).zip(MODIFIERS).filter(|(bit, _)| self.modifiers >> bit & 1 == 1);
        let bits = known.enumerate().filter(|(_, (_, (modifier, _)))| modifiers.has(*modifier));
        bits.map(|(number, _)| 1 << number).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(types: &[&'static str], modifiers: &[&'static str]) -> SemanticTokensClientCapabilities {
        SemanticTokensClientCapabilities {
            token_types: types.iter().map(|name| SemanticTokenType::new(name)).collect(),
            token_modifiers: modifiers.iter().map(|name| SemanticTokenModifier::new(name)).collect(),
            ..SemanticTokensClientCapabilities::default()
        }
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
