//! What the client can do, resolved once, and what the server says that it does.

use tower_lsp::lsp_types::{
    ClientCapabilities, CompletionOptions, CompletionOptionsCompletionItem, HoverProviderCapability,
    InlayHintOptions, InlayHintServerCapabilities, InsertTextMode, MarkupKind, OneOf, ResourceOperationKind,
    SaveOptions, ServerCapabilities, SignatureHelpOptions, TextDocumentSyncCapability, TextDocumentSyncKind,
    TextDocumentSyncOptions, TextDocumentSyncSaveOptions, WorkspaceFoldersServerCapabilities,
    WorkspaceServerCapabilities,
};

use super::position::Encoding;

/// What matters of the client's capabilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Capabilities {
    /// What columns count.
    pub(crate) encoding: Encoding,
    /// May it be asked to ask for inlay hints again?
    pub(crate) hint_refresh: bool,
    /// Does it show Markdown in a hover?
    pub(crate) markdown: bool,
    /// Does it know a definition with the range that it was asked from?
    pub(crate) definition_links: bool,
    /// Does it know symbols that stand in symbols?
    pub(crate) nested_symbols: bool,
    /// Does it show the places that a diagnostic names?
    pub(crate) related: bool,
    /// Does it open the page behind the code of a diagnostic?
    pub(crate) pages: bool,
    /// Does it show progress?
    pub(crate) progress: bool,
    /// Does it take changes of texts of a certain version?
    pub(crate) document_changes: bool,
    /// Does it make, and move, files that a change says to?
    pub(crate) resource_operations: bool,
    /// Does it show groups of changes?
    pub(crate) change_annotations: bool,
    /// Does it know text with places to fill in?
    pub(crate) snippets: bool,
    /// Does it know a completion that inserts, or replaces the rest of the word?
    pub(crate) insert_replace: bool,
    /// Does it show more beside the label of a completion?
    pub(crate) label_details: bool,
    /// Does it choose a completion when certain characters are typed?
    pub(crate) commit_characters: bool,
    /// Does it indent the lines of a completion as the line in which it stands?
    pub(crate) adjust_indentation: bool,
    /// Does it show Markdown beside a completion?
    pub(crate) completion_markdown: bool,
    /// Does it show Markdown beside a signature?
    pub(crate) signature_markdown: bool,
    /// Does it take the place of a parameter in a signature instead of its text?
    pub(crate) label_offsets: bool,
}

impl Capabilities {
    /// Those of a client.
    pub(crate) fn of(client: &ClientCapabilities) -> Capabilities {
        let general = client.general.as_ref();
        let text = client.text_document.as_ref();
        let workspace = client.workspace.as_ref();
        let hover = text.and_then(|it| it.hover.as_ref()?.content_format.as_ref());
        let edit = workspace.and_then(|it| it.workspace_edit.as_ref());
        let completion = text.and_then(|it| it.completion.as_ref()?.completion_item.as_ref());
        let signature = text.and_then(|it| it.signature_help.as_ref()?.signature_information.as_ref());
        let is_markdown = |formats: &Vec<MarkupKind>| formats.contains(&MarkupKind::Markdown);
        let publish = text.and_then(|it| it.publish_diagnostics.as_ref());
        Capabilities {
            encoding: Encoding::negotiated(general.and_then(|it| it.position_encodings.as_deref())),
            hint_refresh: workspace.and_then(|it| it.inlay_hint.as_ref()?.refresh_support).unwrap_or(false),
            markdown: hover.is_some_and(|formats| formats.contains(&MarkupKind::Markdown)),
            definition_links: text.and_then(|it| it.definition?.link_support).unwrap_or(false),
            nested_symbols: text
                .and_then(|it| it.document_symbol.as_ref()?.hierarchical_document_symbol_support)
                .unwrap_or(false),
            related: publish.and_then(|it| it.related_information).unwrap_or(false),
            pages: publish.and_then(|it| it.code_description_support).unwrap_or(false),
            document_changes: edit.and_then(|it| it.document_changes).unwrap_or(false),
            resource_operations: edit
                .and_then(|it| it.resource_operations.as_ref())
                .is_some_and(|kinds| kinds.contains(&ResourceOperationKind::Create)),
            change_annotations: edit.is_some_and(|it| it.change_annotation_support.is_some()),
            snippets: completion.and_then(|it| it.snippet_support).unwrap_or(false),
            insert_replace: completion.and_then(|it| it.insert_replace_support).unwrap_or(false),
            label_details: completion.and_then(|it| it.label_details_support).unwrap_or(false),
            commit_characters: completion.and_then(|it| it.commit_characters_support).unwrap_or(false),
            adjust_indentation: completion
                .and_then(|it| it.insert_text_mode_support.as_ref())
                .is_some_and(|modes| modes.value_set.contains(&InsertTextMode::ADJUST_INDENTATION)),
            completion_markdown: completion
                .and_then(|it| it.documentation_format.as_ref())
                .is_some_and(is_markdown),
            signature_markdown: signature
                .and_then(|it| it.documentation_format.as_ref())
                .is_some_and(is_markdown),
            label_offsets: signature
                .and_then(|it| it.parameter_information.as_ref()?.label_offset_support)
                .unwrap_or(false),
            progress: client.window.as_ref().and_then(|it| it.work_done_progress).unwrap_or(false),
        }
    }

    /// What the server does for such a client.
    pub(crate) fn of_server(self) -> ServerCapabilities {
        ServerCapabilities {
            position_encoding: Some(self.encoding.kind()),
            text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
                open_close: Some(true),
                change: Some(TextDocumentSyncKind::INCREMENTAL),
                // The text comes with it: were the two copies ever to differ, they would not for longer than this.
                save: Some(TextDocumentSyncSaveOptions::SaveOptions(SaveOptions {
                    include_text: Some(true),
                })),
                ..TextDocumentSyncOptions::default()
            })),
            hover_provider: Some(HoverProviderCapability::Simple(true)),
            completion_provider: Some(CompletionOptions {
                resolve_provider: Some(true),
                // The end of `->` and of `::`, what stands behind an instance, and the path of an include.
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
            document_symbol_provider: Some(OneOf::Left(true)),
            inlay_hint_provider: Some(OneOf::Right(InlayHintServerCapabilities::Options(InlayHintOptions {
                resolve_provider: Some(true),
                ..InlayHintOptions::default()
            }))),
            workspace: Some(WorkspaceServerCapabilities {
                workspace_folders: Some(WorkspaceFoldersServerCapabilities {
                    supported: Some(true),
                    change_notifications: Some(OneOf::Left(true)),
                }),
                file_operations: None,
            }),
            ..ServerCapabilities::default()
        }
    }
}
