//! The client's capabilities, resolved once.

use serde_json::{Value, json};
use tower_lsp::lsp_types::*;

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
        encoding: Encoding,
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
    /// Returns the capabilities of a client; `raw` are its parameters as JSON.
    pub(crate) fn of(params: &InitializeParams, raw: &Value) -> Capabilities {
        let name = params.client_info.as_ref().map_or("", |info| info.name.as_str());
        let tokens = params.capabilities.text_document.as_ref().and_then(|it| it.semantic_tokens.as_ref());
        let encodings = params.capabilities.general.as_ref().and_then(|it| it.position_encodings.as_deref());
        // Serialising plain data never fails.
        let client = serde_json::to_value(&params.capabilities).unwrap_or_default();
        let at = |path: &str| client.pointer(path).filter(|value| !value.is_null());
        let all_symbols = |path: &str| {
            let kinds = [SymbolKind::ENUM_MEMBER, SymbolKind::EVENT, SymbolKind::STRUCT, SymbolKind::OBJECT];
            kinds.into_iter().all(|kind| has(&client, path, json!(kind)))
        };
        let is_true = |value: Option<&Value>| value.and_then(Value::as_bool).unwrap_or(false);
        let draws = |it| has(&client, "/experimental/commands", json!(drawing_command(it)));
        Capabilities {
            change_annotations: at("/workspace/workspaceEdit/changeAnnotationSupport").is_some(),
            code_actions: at("/textDocument/codeAction/codeActionLiteralSupport").is_some(),
            draws: LENS_DRAWINGS.into_iter().all(draws),
            encoding: Encoding::negotiated(encodings),
            keeps_last_line: name == "Neovim",
            // Where the server has diagnostics of the workspace, Neovim (0.12.0) on a refresh asks for these only, and drops
            // what it gets for files that it has shown.
            pull_all_diagnostics: name != "Neovim",
            // lsp-types looks for the refresh under another name than the protocol's.
            pull_diagnostics: at("/textDocument/diagnostic").is_some()
                && is_true(raw.pointer("/capabilities/workspace/diagnostics/refreshSupport")),
            // A client that does not keep `data` cannot resolve the action.
            resolves_edits: is_true(at("/textDocument/codeAction/dataSupport"))
                && has(&client, "/textDocument/codeAction/resolveSupport/properties", json!("edit")),
            symbol_kinds: all_symbols("/textDocument/documentSymbol/symbolKind/valueSet"),
            tokens: Legend::of(tokens, name),
            workspace_symbol_kinds: all_symbols("/workspace/symbol/symbolKind/valueSet"),
            ..Capabilities::with_flags(&client)
        }
    }

    /// Returns whether the client can generate packages.
    pub(crate) fn can_generate(self) -> bool {
        self.creates_files && (self.generates || self.applies_edits)
    }
}
