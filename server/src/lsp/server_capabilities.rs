//! The server's capabilities.

use tower_lsp::lsp_types::*;

use super::capabilities::Capabilities;
use super::commands::COMMANDS;
use super::handlers::code_actions::KINDS;

impl Capabilities {
    /// Returns the server's capabilities for this client.
    pub(crate) fn of_server(self) -> ServerCapabilities {
        let work_done_progress_options = WorkDoneProgressOptions::default();
        ServerCapabilities {
            position_encoding: Some(self.encoding.kind()),
            text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
                open_close: Some(true),
                change: Some(TextDocumentSyncKind::INCREMENTAL),
                // A save includes the text: if the two copies differ, this corrects the server's.
                save: Some(SaveOptions { include_text: Some(true) }.into()),
                ..TextDocumentSyncOptions::default()
            })),
            hover_provider: Some(HoverProviderCapability::Simple(true)),
            completion_provider: Some(CompletionOptions {
                resolve_provider: Some(true),
                // The last characters of `->` and `::`, the dot after an instance, and the quote of an include.
                trigger_characters: Some([".", ":", ">", "\""].map(str::to_owned).into()),
                completion_item: Some(CompletionOptionsCompletionItem { label_details_support: Some(true) }),
                ..CompletionOptions::default()
            }),
            signature_help_provider: Some(SignatureHelpOptions {
                trigger_characters: Some(["(", ","].map(str::to_owned).into()),
                retrigger_characters: Some(vec![")".to_owned()]),
                ..SignatureHelpOptions::default()
            }),
            definition_provider: Some(OneOf::Left(true)),
            declaration_provider: Some(DeclarationCapability::Simple(true)),
            type_definition_provider: Some(TypeDefinitionProviderCapability::Simple(true)),
            implementation_provider: Some(ImplementationProviderCapability::Simple(true)),
            references_provider: Some(OneOf::Left(true)),
            document_highlight_provider: Some(OneOf::Left(true)),
            rename_provider: Some(match self.prepares_rename {
                true => {
                    OneOf::Right(RenameOptions { prepare_provider: Some(true), work_done_progress_options })
                }
                false => OneOf::Left(true),
            }),
            call_hierarchy_provider: Some(CallHierarchyServerCapability::Simple(true)),
            code_action_provider: self.code_actions.then(|| {
                CodeActionProviderCapability::Options(CodeActionOptions {
                    code_action_kinds: Some(KINDS.to_vec()),
                    resolve_provider: Some(true),
                    ..CodeActionOptions::default()
                })
            }),
            code_lens_provider: Some(CodeLensOptions { resolve_provider: Some(false) }),
            document_symbol_provider: Some(OneOf::Left(true)),
            workspace_symbol_provider: Some(OneOf::Left(true)),
            document_link_provider: Some(DocumentLinkOptions {
                resolve_provider: Some(false),
                work_done_progress_options,
            }),
            document_formatting_provider: Some(OneOf::Left(true)),
            document_range_formatting_provider: Some(OneOf::Left(true)),
            document_on_type_formatting_provider: Some(DocumentOnTypeFormattingOptions {
                first_trigger_character: "}".to_owned(),
                more_trigger_character: Some(vec![";".to_owned(), "\n".to_owned()]),
            }),
            folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
            selection_range_provider: Some(SelectionRangeProviderCapability::Simple(true)),
            semantic_tokens_provider: self.tokens.options().map(Into::into),
            diagnostic_provider: self.pull_diagnostics.then(|| {
                DiagnosticServerCapabilities::Options(DiagnosticOptions {
                    identifier: Some("mauve".to_owned()),
                    inter_file_dependencies: true,
                    workspace_diagnostics: self.pull_all_diagnostics,
                    ..DiagnosticOptions::default()
                })
            }),
            execute_command_provider: Some(ExecuteCommandOptions {
                commands: COMMANDS.iter().map(|command| (*command).to_owned()).collect(),
                ..ExecuteCommandOptions::default()
            }),
            inlay_hint_provider: Some(OneOf::Right(InlayHintServerCapabilities::Options(InlayHintOptions {
                resolve_provider: Some(true),
                ..InlayHintOptions::default()
            }))),
            workspace: Some(self.of_workspace()),
            ..ServerCapabilities::default()
        }
    }

    fn of_workspace(self) -> WorkspaceServerCapabilities {
        let filter = |glob: &str, matches: FileOperationPatternKind| FileOperationFilter {
            scheme: Some("file".to_owned()),
            pattern: FileOperationPattern { glob: glob.to_owned(), matches: Some(matches), options: None },
        };
        // Models and `mauve.toml` contain names of these files and folders.
        let files = filter("**/*.{mal,toml}", FileOperationPatternKind::File);
        let folders = filter("**", FileOperationPatternKind::Folder);
        WorkspaceServerCapabilities {
            workspace_folders: Some(WorkspaceFoldersServerCapabilities {
                supported: Some(true),
                change_notifications: Some(OneOf::Left(true)),
            }),
            file_operations: self.will_rename_files.then(|| WorkspaceFileOperationsServerCapabilities {
                will_rename: Some(FileOperationRegistrationOptions { filters: vec![files, folders] }),
                ..WorkspaceFileOperationsServerCapabilities::default()
            }),
        }
    }
}
