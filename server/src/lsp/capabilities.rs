//! What the client can do, resolved once, and what the server says that it does.

use serde_json::Value;
use tower_lsp::lsp_types::*;

use super::handlers;
use super::handlers::code_lens::SHOW_REFERENCES;
use super::handlers::execute_command::{COMMANDS, GENERATE};
use super::handlers::semantic_tokens::Legend;
use super::position::Encoding;

/// What matters of the client's capabilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Capabilities {
    /// What columns count.
    pub(crate) encoding: Encoding,
    /// May it be asked to ask for inlay hints again?
    pub(crate) hint_refresh: bool,
    /// Does it show Markdown in a hover?
    pub(crate) markdown: bool,
    /// Does it know a definition with the range that it was asked from?
    pub(crate) definition_links: bool,
    /// And the same of the other places that a name leads to?
    pub(crate) declaration_links: bool,
    pub(crate) type_definition_links: bool,
    pub(crate) implementation_links: bool,
    /// Does it ask what is to be renamed before it asks for another name?
    pub(crate) prepares_rename: bool,
    /// Does it tell before it renames files?
    pub(crate) will_rename_files: bool,
    /// Does it know symbols that stand in symbols?
    pub(crate) nested_symbols: bool,
    /// Does it know all kinds of symbol, in a document and in all of them, or only those of the protocol's first version?
    pub(crate) symbol_kinds: bool,
    pub(crate) workspace_symbol_kinds: bool,
    /// Does it fold whole lines only?
    pub(crate) line_folds_only: bool,
    /// How many folds of a document it takes at most.
    pub(crate) most_folds: Option<u32>,
    /// Does it show a text in place of what is folded?
    pub(crate) collapsed_texts: bool,
    /// Does it show what a link leads to?
    pub(crate) link_tooltips: bool,
    /// Which colours of names it knows.
    pub(crate) tokens: Legend,
    /// May it be asked to ask for them again?
    pub(crate) token_refresh: bool,
    /// Does it show the places that a diagnostic names?
    pub(crate) related: bool,
    /// Does it open the page behind the code of a diagnostic?
    pub(crate) pages: bool,
    /// May it be asked to ask for code lenses again?
    pub(crate) lens_refresh: bool,
    /// Does it have the command `mauve.showReferences`, which shows places? It says so in `experimental.commands`.
    pub(crate) shows_references: bool,
    /// Does it ask what is wrong in open files, and may it be asked to ask again? Then it is not told.
    pub(crate) pull_diagnostics: bool,
    /// Does it ask about all files rightly?
    pub(crate) pull_all_diagnostics: bool,
    /// May it be asked what is set?
    pub(crate) configuration: bool,
    /// Is it to be asked to tell when that changes?
    pub(crate) configuration_registration: bool,
    /// Does it show progress?
    pub(crate) progress: bool,
    /// Does it take changes of texts of a certain version?
    pub(crate) document_changes: bool,
    /// Does it make files that a change says to?
    pub(crate) resource_operations: bool,
    /// And remove them?
    pub(crate) deletes_files: bool,
    /// Does it keep an empty line behind what is put into an empty file?
    pub(crate) keeps_last_line: bool,
    /// May it be told to make a change?
    pub(crate) applies_edits: bool,
    /// Does it have the command `mauve.generateOrocos`? It says so in `experimental.commands`.
    pub(crate) generates: bool,
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
    /// Does it know all kinds of completion, or only those of the protocol's first version?
    pub(crate) completion_kinds: bool,
    /// Does it show Markdown beside a completion?
    pub(crate) completion_markdown: bool,
    /// Does it show Markdown beside a signature?
    pub(crate) signature_markdown: bool,
    /// Does it take the place of a parameter in a signature instead of its text?
    pub(crate) label_offsets: bool,
    /// Does it know actions that are more than commands?
    pub(crate) code_actions: bool,
    /// Does it ask for the edit of an action when the user has chosen it?
    pub(crate) resolves_edits: bool,
    /// Does it show actions that cannot be done, with the reason?
    pub(crate) disabled_actions: bool,
    /// Does it know which action is the one that is meant most likely?
    pub(crate) preferred_actions: bool,
}

impl Capabilities {
    /// Those of a client; `raw` are its parameters as it has sent them.
    pub(crate) fn of(params: &InitializeParams, raw: &Value) -> Capabilities {
        let client = &params.capabilities;
        let name = params.client_info.as_ref().map_or("", |info| info.name.as_str());
        // lsp-types looks for it under another name than the protocol's.
        let refreshes_diagnostics = raw.pointer("/capabilities/workspace/diagnostics/refreshSupport");
        let general = client.general.as_ref();
        let text = client.text_document.as_ref();
        let workspace = client.workspace.as_ref();
        let hover = text.and_then(|it| it.hover.as_ref()?.content_format.as_ref());
        let edit = workspace.and_then(|it| it.workspace_edit.as_ref());
        let completion = text.and_then(|it| it.completion.as_ref()?.completion_item.as_ref());
        let signature = text.and_then(|it| it.signature_help.as_ref()?.signature_information.as_ref());
        let is_markdown = |formats: &Vec<MarkupKind>| formats.contains(&MarkupKind::Markdown);
        let action = text.and_then(|it| it.code_action.as_ref());
        let publish = text.and_then(|it| it.publish_diagnostics.as_ref());
        let commands = client.experimental.as_ref().and_then(|it| it.get("commands")?.as_array());
        let commands: Vec<&str> = commands.into_iter().flatten().filter_map(|it| it.as_str()).collect();
        let folding = text.and_then(|it| it.folding_range.as_ref());
        let operations = edit.and_then(|it| it.resource_operations.as_ref());
        let does = |kind| operations.is_some_and(|kinds| kinds.contains(&kind));
        Capabilities {
            encoding: Encoding::negotiated(general.and_then(|it| it.position_encodings.as_deref())),
            hint_refresh: workspace.and_then(|it| it.inlay_hint.as_ref()?.refresh_support).unwrap_or(false),
            markdown: hover.is_some_and(|formats| formats.contains(&MarkupKind::Markdown)),
            definition_links: text.and_then(|it| it.definition?.link_support).unwrap_or(false),
            declaration_links: text.and_then(|it| it.declaration?.link_support).unwrap_or(false),
            type_definition_links: text.and_then(|it| it.type_definition?.link_support).unwrap_or(false),
            implementation_links: text.and_then(|it| it.implementation?.link_support).unwrap_or(false),
            prepares_rename: text.and_then(|it| it.rename.as_ref()?.prepare_support).unwrap_or(false),
            will_rename_files: workspace
                .and_then(|it| it.file_operations.as_ref()?.will_rename)
                .unwrap_or(false),
            nested_symbols: text
                .and_then(|it| it.document_symbol.as_ref()?.hierarchical_document_symbol_support)
                .unwrap_or(false),
            symbol_kinds: knows_all_symbols(
                text.and_then(|it| it.document_symbol.as_ref()?.symbol_kind.as_ref()),
            ),
            workspace_symbol_kinds: knows_all_symbols(
                workspace.and_then(|it| it.symbol.as_ref()?.symbol_kind.as_ref()),
            ),
            line_folds_only: folding.and_then(|it| it.line_folding_only).unwrap_or(false),
            most_folds: folding.and_then(|it| it.range_limit),
            collapsed_texts: folding
                .and_then(|it| it.folding_range.as_ref()?.collapsed_text)
                .unwrap_or(false),
            link_tooltips: text.and_then(|it| it.document_link.as_ref()?.tooltip_support).unwrap_or(false),
            tokens: Legend::of(text.and_then(|it| it.semantic_tokens.as_ref()), name),
            token_refresh: workspace
                .and_then(|it| it.semantic_tokens.as_ref()?.refresh_support)
                .unwrap_or(false),
            related: publish.and_then(|it| it.related_information).unwrap_or(false),
            pages: publish.and_then(|it| it.code_description_support).unwrap_or(false),
            pull_diagnostics: text.is_some_and(|it| it.diagnostic.is_some())
                && refreshes_diagnostics.and_then(Value::as_bool).unwrap_or(false),
            // Where the server has diagnostics of the workspace, Neovim (0.12.0) on a refresh asks for these only, and drops
            // what it gets for files that it has shown.
            pull_all_diagnostics: name != "Neovim",
            configuration: workspace.and_then(|it| it.configuration).unwrap_or(false),
            configuration_registration: workspace
                .and_then(|it| it.did_change_configuration?.dynamic_registration)
                .unwrap_or(false),
            document_changes: edit.and_then(|it| it.document_changes).unwrap_or(false),
            resource_operations: does(ResourceOperationKind::Create),
            deletes_files: does(ResourceOperationKind::Delete),
            keeps_last_line: name == "Neovim",
            applies_edits: workspace.and_then(|it| it.apply_edit).unwrap_or(false),
            generates: commands.contains(&GENERATE),
            change_annotations: edit.is_some_and(|it| it.change_annotation_support.is_some()),
            snippets: completion.and_then(|it| it.snippet_support).unwrap_or(false),
            insert_replace: completion.and_then(|it| it.insert_replace_support).unwrap_or(false),
            label_details: completion.and_then(|it| it.label_details_support).unwrap_or(false),
            commit_characters: completion.and_then(|it| it.commit_characters_support).unwrap_or(false),
            adjust_indentation: completion
                .and_then(|it| it.insert_text_mode_support.as_ref())
                .is_some_and(|modes| modes.value_set.contains(&InsertTextMode::ADJUST_INDENTATION)),
            completion_kinds: text
                .and_then(|it| it.completion.as_ref()?.completion_item_kind.as_ref()?.value_set.as_deref())
                .is_some_and(|known| known.contains(&CompletionItemKind::TYPE_PARAMETER)),
            completion_markdown: completion
                .and_then(|it| it.documentation_format.as_ref())
                .is_some_and(is_markdown),
            signature_markdown: signature
                .and_then(|it| it.documentation_format.as_ref())
                .is_some_and(is_markdown),
            label_offsets: signature
                .and_then(|it| it.parameter_information.as_ref()?.label_offset_support)
                .unwrap_or(false),
            code_actions: action.is_some_and(|it| it.code_action_literal_support.is_some()),
            // What it does not keep until then cannot be found again.
            resolves_edits: action.is_some_and(|it| {
                let resolved = it.resolve_support.as_ref().map(|it| it.properties.as_slice());
                it.data_support == Some(true) && resolved.is_some_and(|all| all.iter().any(|it| it == "edit"))
            }),
            disabled_actions: action.and_then(|it| it.disabled_support).unwrap_or(false),
            preferred_actions: action.and_then(|it| it.is_preferred_support).unwrap_or(false),
            lens_refresh: workspace.and_then(|it| it.code_lens.as_ref()?.refresh_support).unwrap_or(false),
            shows_references: commands.contains(&SHOW_REFERENCES),
            progress: client.window.as_ref().and_then(|it| it.work_done_progress).unwrap_or(false),
        }
    }

    /// Can it be brought to generate packages?
    pub(crate) fn can_generate(self) -> bool {
        self.resource_operations && (self.generates || self.applies_edits)
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
            declaration_provider: Some(DeclarationCapability::Simple(true)),
            type_definition_provider: Some(TypeDefinitionProviderCapability::Simple(true)),
            implementation_provider: Some(ImplementationProviderCapability::Simple(true)),
            references_provider: Some(OneOf::Left(true)),
            document_highlight_provider: Some(OneOf::Left(true)),
            rename_provider: Some(match self.prepares_rename {
                true => OneOf::Right(RenameOptions {
                    prepare_provider: Some(true),
                    work_done_progress_options: WorkDoneProgressOptions::default(),
                }),
                false => OneOf::Left(true),
            }),
            call_hierarchy_provider: Some(CallHierarchyServerCapability::Simple(true)),
            code_action_provider: self.code_actions.then(|| {
                CodeActionProviderCapability::Options(CodeActionOptions {
                    code_action_kinds: Some(handlers::code_actions::KINDS.to_vec()),
                    resolve_provider: Some(true),
                    ..CodeActionOptions::default()
                })
            }),
            code_lens_provider: Some(CodeLensOptions { resolve_provider: Some(true) }),
            document_symbol_provider: Some(OneOf::Left(true)),
            workspace_symbol_provider: Some(OneOf::Left(true)),
            document_link_provider: Some(DocumentLinkOptions {
                resolve_provider: Some(false),
                work_done_progress_options: WorkDoneProgressOptions::default(),
            }),
            document_formatting_provider: Some(OneOf::Left(true)),
            document_range_formatting_provider: Some(OneOf::Left(true)),
            document_on_type_formatting_provider: Some(DocumentOnTypeFormattingOptions {
                first_trigger_character: "}".to_owned(),
                more_trigger_character: Some(vec![";".to_owned(), "\n".to_owned()]),
            }),
            folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
            selection_range_provider: Some(SelectionRangeProviderCapability::Simple(true)),
            semantic_tokens_provider: self
                .tokens
                .options()
                .map(SemanticTokensServerCapabilities::SemanticTokensOptions),
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
            workspace: Some(WorkspaceServerCapabilities {
                workspace_folders: Some(WorkspaceFoldersServerCapabilities {
                    supported: Some(true),
                    change_notifications: Some(OneOf::Left(true)),
                }),
                file_operations: self.will_rename_files.then(|| WorkspaceFileOperationsServerCapabilities {
                    will_rename: Some(FileOperationRegistrationOptions { filters: renamed_files() }),
                    ..WorkspaceFileOperationsServerCapabilities::default()
                }),
            }),
            ..ServerCapabilities::default()
        }
    }
}

/// The files and folders of which names stand in models and in `mauve.toml`.
fn renamed_files() -> Vec<FileOperationFilter> {
    let filter = |glob: &str, matches: FileOperationPatternKind| FileOperationFilter {
        scheme: Some("file".to_owned()),
        pattern: FileOperationPattern { glob: glob.to_owned(), matches: Some(matches), options: None },
    };
    vec![
        filter("**/*.{mal,toml}", FileOperationPatternKind::File),
        filter("**", FileOperationPatternKind::Folder),
    ]
}

/// Does a client know the kinds of symbol that came after the protocol's first version?
fn knows_all_symbols(known: Option<&SymbolKindCapability>) -> bool {
    let known = known.and_then(|it| it.value_set.as_deref()).unwrap_or_default();
    [SymbolKind::ENUM_MEMBER, SymbolKind::EVENT, SymbolKind::STRUCT, SymbolKind::OBJECT]
        .iter()
        .all(|kind| known.contains(kind))
}
