//! The client's capabilities, resolved once.

use serde_json::{Value, json};
use tower_lsp::lsp_types::*;

use mauve_ide::LensDrawing;

use super::commands::{CHOOSE_SIGNIFICANCE, GENERATE, LENS_DRAWINGS, SHOW_REFERENCES, drawing_command};
use super::position::Encoding;

/// Declares [`Capabilities`]: the flags, each with its path in the protocol; whether a list of the client has a value, each with
/// the path of the list; and the fields that are more than that.
macro_rules! capabilities {
    (
        flags: { $($flag:ident: $path:literal,)* }
        listed: { $($(#[$about:meta])* $listed:ident: $list:literal => $value:expr,)* }
        others: { $($(#[$doc:meta])* $field:ident: $type:ty,)* }
    ) => {
        /// The client's capabilities that affect the server.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub(crate) struct Capabilities {
            $(pub(crate) $flag: bool,)*
            $($(#[$about])* pub(crate) $listed: bool,)*
            $($(#[$doc])* pub(crate) $field: $type,)*
        }

        impl Capabilities {
            fn with_flags(client: &Value) -> Capabilities {
                Capabilities {
                    $($flag: client.pointer($path).and_then(Value::as_bool).unwrap_or(false),)*
                    $($listed: has(client, $list, json!($value)),)*
                    ..Capabilities::default()
                }
            }
        }
    };
}

capabilities! {
    flags: {
        applies_edits: "/workspace/applyEdit",
        collapsed_texts: "/textDocument/foldingRange/foldingRange/collapsedText",
        commit_characters: "/textDocument/completion/completionItem/commitCharactersSupport",
        configuration: "/workspace/configuration",
        configuration_registration: "/workspace/didChangeConfiguration/dynamicRegistration",
        declaration_links: "/textDocument/declaration/linkSupport",
        definition_links: "/textDocument/definition/linkSupport",
        disabled_actions: "/textDocument/codeAction/disabledSupport",
        document_changes: "/workspace/workspaceEdit/documentChanges",
        files_registration: "/workspace/didChangeWatchedFiles/dynamicRegistration",
        hint_refresh: "/workspace/inlayHint/refreshSupport",
        implementation_links: "/textDocument/implementation/linkSupport",
        insert_replace: "/textDocument/completion/completionItem/insertReplaceSupport",
        label_details: "/textDocument/completion/completionItem/labelDetailsSupport",
        label_offsets: "/textDocument/signatureHelp/signatureInformation/parameterInformation/labelOffsetSupport",
        lens_refresh: "/workspace/codeLens/refreshSupport",
        line_folds_only: "/textDocument/foldingRange/lineFoldingOnly",
        link_tooltips: "/textDocument/documentLink/tooltipSupport",
        nested_symbols: "/textDocument/documentSymbol/hierarchicalDocumentSymbolSupport",
        pages: "/textDocument/publishDiagnostics/codeDescriptionSupport",
        preferred_actions: "/textDocument/codeAction/isPreferredSupport",
        prepares_rename: "/textDocument/rename/prepareSupport",
        progress: "/window/workDoneProgress",
        related: "/textDocument/publishDiagnostics/relatedInformation",
        snippets: "/textDocument/completion/completionItem/snippetSupport",
        token_refresh: "/workspace/semanticTokens/refreshSupport",
        type_definition_links: "/textDocument/typeDefinition/linkSupport",
        will_rename_files: "/workspace/fileOperations/willRename",
    }
    listed: {
        adjust_indentation: "/textDocument/completion/completionItem/insertTextModeSupport/valueSet"
            => InsertTextMode::ADJUST_INDENTATION,
        /// Whether it implements the command `mauve.chooseSignificance`.
        chooses_significance: "/experimental/commands" => CHOOSE_SIGNIFICANCE,
        /// Whether it supports all kinds of completion, not only those of the protocol's first version.
        completion_kinds: "/textDocument/completion/completionItemKind/valueSet"
            => CompletionItemKind::TYPE_PARAMETER,
        completion_markdown: "/textDocument/completion/completionItem/documentationFormat" => "markdown",
        creates_files: "/workspace/workspaceEdit/resourceOperations" => "create",
        deletes_files: "/workspace/workspaceEdit/resourceOperations" => "delete",
        /// Whether it implements the command `mauve.generateOrocos`.
        generates: "/experimental/commands" => GENERATE,
        /// Whether it shows Markdown in a hover.
        markdown: "/textDocument/hover/contentFormat" => "markdown",
        /// Whether it implements the command `mauve.showReferences`.
        shows_references: "/experimental/commands" => SHOW_REFERENCES,
        signature_markdown: "/textDocument/signatureHelp/signatureInformation/documentationFormat"
            => "markdown",
    }
    others: {
        change_annotations: bool,
        /// Whether it supports code actions that are not commands.
        code_actions: bool,
        /// Whether it implements the commands that show drawings, as listed in `experimental.commands`.
        draws: bool,
        /// Whether it implements the one that shows chains.
        draws_chains: bool,
        /// Whether it implements the one that shows figures beside those with other values.
        draws_what_if: bool,
        /// Whether it breaks lines as if the addresses of links, which it hides, were in sight.
        counts_addresses: bool,
        encoding: Encoding,
        /// Whether it puts the spaces before the hints of a position before the first of them.
        gathers_padding: bool,
        /// Whether it keeps an empty line after text that is inserted into an empty file.
        keeps_last_line: bool,
        /// Whether it requests diagnostics of all files correctly.
        pull_all_diagnostics: bool,
        /// Whether it requests diagnostics, and can be asked to request them again. Then none are published.
        pull_diagnostics: bool,
        /// Whether it requests the edit of an action when the user has chosen it.
        resolves_edits: bool,
        /// Whether it supports all kinds of symbol, not only those of the protocol's first version.
        symbol_kinds: bool,
        tokens: Legend,
        workspace_symbol_kinds: bool,
    }
}

/// Those of our types and modifiers of tokens that a client knows, each a bit. `handlers/semantic_tokens.rs` numbers them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Legend {
    pub(crate) types: u32,
    pub(crate) modifiers: u32,
    /// Has it no colours of its own for what is not a name?
    pub(crate) with_words: bool,
    /// Does it ask about a part of a text rightly?
    pub(crate) with_range: bool,
}

/// Returns whether the list at a path has a value.
fn has(client: &Value, path: &str, value: Value) -> bool {
    client.pointer(path).and_then(Value::as_array).is_some_and(|values| values.contains(&value))
}

impl Capabilities {
    /// Returns the capabilities of the client with these parameters of `initialize`. Each is read by itself.
    pub(crate) fn of(params: &Value) -> Capabilities {
        let name = params.pointer("/clientInfo/name").and_then(Value::as_str).unwrap_or_default();
        let client = &params["capabilities"];
        let at = |path: &str| client.pointer(path).filter(|value| value.is_object());
        let all_symbols = |path: &str| {
            let kinds = [SymbolKind::ENUM_MEMBER, SymbolKind::EVENT, SymbolKind::STRUCT, SymbolKind::OBJECT];
            kinds.into_iter().all(|kind| has(client, path, json!(kind)))
        };
        let is_true = |path: &str| client.pointer(path).and_then(Value::as_bool).unwrap_or(false);
        let knows = |encoding| has(client, "/general/positionEncodings", json!(encoding));
        let draws = |it| has(client, "/experimental/commands", json!(drawing_command(it)));
        Capabilities {
            change_annotations: at("/workspace/workspaceEdit/changeAnnotationSupport").is_some(),
            code_actions: at("/textDocument/codeAction/codeActionLiteralSupport").is_some(),
            draws: LENS_DRAWINGS.into_iter().all(draws),
            draws_chains: draws(LensDrawing::Chains),
            draws_what_if: draws(LensDrawing::WhatIf),
            counts_addresses: name == "Neovim",
            encoding: Encoding::negotiated(knows),
            gathers_padding: name == "helix",
            keeps_last_line: name == "Neovim",
            // Where the server has diagnostics of the workspace, Neovim (0.12.0) on a refresh asks for these only, and drops
            // what it gets for files that it has shown.
            pull_all_diagnostics: name != "Neovim",
            pull_diagnostics: at("/textDocument/diagnostic").is_some()
                && is_true("/workspace/diagnostics/refreshSupport"),
            // A client that does not keep `data` cannot resolve the action.
            resolves_edits: is_true("/textDocument/codeAction/dataSupport")
                && has(client, "/textDocument/codeAction/resolveSupport/properties", json!("edit")),
            symbol_kinds: all_symbols("/textDocument/documentSymbol/symbolKind/valueSet"),
            tokens: Legend::of(at("/textDocument/semanticTokens"), name),
            workspace_symbol_kinds: all_symbols("/workspace/symbol/symbolKind/valueSet"),
            ..Capabilities::with_flags(client)
        }
    }

    /// Returns whether the client can generate packages.
    pub(crate) fn can_generate(self) -> bool {
        self.creates_files && (self.generates || self.applies_edits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All that is read of a client, as a good one says it.
    fn good() -> Value {
        json!({"clientInfo": {"name": "editor"}, "capabilities": {
            "general": {"positionEncodings": ["utf-8", "utf-16"]},
            "window": {"workDoneProgress": true},
            "experimental": {"commands": [GENERATE, CHOOSE_SIGNIFICANCE]},
            "workspace": {
                "applyEdit": true, "configuration": true, "diagnostics": {"refreshSupport": true},
                "didChangeWatchedFiles": {"dynamicRegistration": true},
                "workspaceEdit": {
                    "documentChanges": true, "resourceOperations": ["create", "delete"],
                    "changeAnnotationSupport": {"groupsOnLabel": true},
                },
            },
            "textDocument": {
                "diagnostic": {"dynamicRegistration": true},
                "hover": {"contentFormat": ["markdown", "plaintext"]},
                "documentSymbol": {"symbolKind": {"valueSet": [1, 19, 22, 23, 24]}},
                "codeAction": {
                    "codeActionLiteralSupport": {"codeActionKind": {"valueSet": ["quickfix"]}},
                    "dataSupport": true, "resolveSupport": {"properties": ["edit"]},
                },
                "semanticTokens": {
                    "requests": {"range": true}, "formats": ["relative"], "augmentsSyntaxTokens": false,
                    "tokenTypes": ["class", "type"], "tokenModifiers": ["declaration"],
                },
            },
        }})
    }

    /// The pointers to all values in a value.
    fn pointers(value: &Value, at: &str) -> Vec<String> {
        let below = |(name, value): (String, &Value)| pointers(value, &format!("{at}/{name}"));
        let children: Vec<String> = match value {
            Value::Object(fields) => {
                fields.iter().map(|(name, value)| (name.clone(), value)).flat_map(below).collect()
            }
            Value::Array(values) => {
                values.iter().enumerate().map(|(at, value)| (at.to_string(), value)).flat_map(below).collect()
            }
            _ => Vec::new(),
        };
        children.into_iter().chain((!at.is_empty()).then(|| at.to_owned())).collect()
    }

    #[test]
    fn an_odd_value_is_as_good_as_none() {
        let good = good();
        let all = pointers(&good, "");
        assert!(all.len() > 50);
        for pointer in all {
            let value = good.pointer(&pointer).unwrap();
            let mut without = good.clone();
            *without.pointer_mut(&pointer).unwrap() = Value::Null;
            for odd in [json!(7.5), json!("odd"), json!(["odd", {}]), json!({"odd": [1]})] {
                // An object of another kind is one that says nothing.
                if value.is_object() && odd.is_object() {
                    continue;
                }
                let mut with = good.clone();
                *with.pointer_mut(&pointer).unwrap() = odd.clone();
                let name = pointer == "/clientInfo/name" && odd.is_string();
                assert!(name || Capabilities::of(&with) == Capabilities::of(&without), "{pointer}: {odd}");
            }
        }
        assert_ne!(Capabilities::of(&good), Capabilities::of(&json!({})));
    }
}
