//! The server's capabilities, as the protocol writes them: `lsp-types` does not have all of them.

use mauve_projects::json::object;
use serde::Serialize;
use serde_json::json;
use tower_lsp::lsp_types::TextDocumentSyncKind;

use super::capabilities::Capabilities;
use super::commands::COMMANDS;
use super::handlers::code_actions::kinds;

impl Capabilities {
    /// Returns the server's capabilities for this client.
    pub(crate) fn of_server(self) -> impl Serialize {
        object! {
            positionEncoding: self.encoding.kind(),
            textDocumentSync: object! {
                openClose: true,
                change: TextDocumentSyncKind::INCREMENTAL,
                // A save includes the text: if the two copies differ, this corrects the server's.
                save: object! { includeText: true },
            },
            hoverProvider: true,
            completionProvider: object! {
                resolveProvider: true,
                // The last characters of `->` and `::`, the dot after an instance, and the quote of an include.
                triggerCharacters: [".", ":", ">", "\""],
                completionItem: object! { labelDetailsSupport: true },
            },
            signatureHelpProvider: object! { triggerCharacters: ["(", ","], retriggerCharacters: [")"] },
            definitionProvider: true,
            declarationProvider: true,
            typeDefinitionProvider: true,
            implementationProvider: true,
            referencesProvider: true,
            documentHighlightProvider: true,
            renameProvider: match self.prepares_rename {
                true => json!({ "prepareProvider": true }),
                false => true.into(),
            },
            callHierarchyProvider: true,
            typeHierarchyProvider: true,
            [codeActionProvider]: self
                .code_actions
                .then(|| object! { codeActionKinds: kinds(), resolveProvider: true }),
            codeLensProvider: object! { resolveProvider: false },
            documentSymbolProvider: true,
            workspaceSymbolProvider: true,
            documentLinkProvider: object! { resolveProvider: false },
            documentFormattingProvider: true,
            documentRangeFormattingProvider: true,
            documentOnTypeFormattingProvider: object! {
                firstTriggerCharacter: "}",
                moreTriggerCharacter: [";", "\n"],
            },
            foldingRangeProvider: true,
            selectionRangeProvider: true,
            [semanticTokensProvider]: self.tokens.options(),
            [diagnosticProvider]: self.pull_diagnostics.then(|| object! {
                identifier: "mauve",
                interFileDependencies: true,
                workspaceDiagnostics: self.pull_all_diagnostics,
            }),
            executeCommandProvider: object! { commands: COMMANDS },
            inlayHintProvider: object! { resolveProvider: true },
            workspace: object! {
                workspaceFolders: object! { supported: true, changeNotifications: true },
                [fileOperations]: self.will_rename_files.then(|| {
                    let filter = |glob: &'static str, matches: &'static str| object! {
                        scheme: "file",
                        pattern: object! { glob: glob, matches: matches },
                    };
                    // Models and `mauve.toml` contain names of these files and folders.
                    let filters = [filter("**/*.{mal,toml}", "file"), filter("**", "folder")];
                    object! { willRename: object! { filters: filters } }
                }),
            },
        }
    }
}
