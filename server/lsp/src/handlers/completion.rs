//! `textDocument/completion` and `completionItem/resolve`.

use mauve_hir::Project;
use mauve_ide::{Completion, CompletionKind, Subject};
use serde::Deserialize as _;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    CompletionItem, CompletionItemKind, CompletionItemLabelDetails, CompletionList, CompletionParams,
    CompletionResponse, CompletionTextEdit, Documentation, InsertReplaceEdit, InsertTextFormat,
    InsertTextMode, MarkupContent, MarkupKind, TextEdit,
};

use crate::plain_text::plain_text;
use crate::position::LineIndex;
use crate::snapshot::Snapshot;
use crate::to_proto::text_edits;

/// Returns the completions at a position. Their documentation is computed when the client resolves an item.
pub(crate) fn completion(
    snapshot: &Snapshot,
    params: &CompletionParams,
) -> Result<Option<CompletionResponse>> {
    let at = &params.text_document_position;
    let (file, lines, offset) = snapshot.at(at)?;
    // `>` is also an operator: it triggers completion only as the end of `->`.
    let trigger = params.context.as_ref().and_then(|context| context.trigger_character.as_deref());
    let before = file.text(&snapshot.db).get(..offset.into()).unwrap_or_default();
    if trigger == Some(">") && !before.ends_with("->") {
        return Ok(None);
    }
    let db = &snapshot.db;
    // A file that no root includes is its own root.
    let own = || snapshot.workspace(file).map(|workspace| Project::new(db, workspace, file));
    let found = snapshot.project(file).or_else(own);
    let found = found.map(|project| mauve_ide::completions(db, project, file, offset)).unwrap_or_default();
    let item = |it| item(snapshot, file, lines, offset, it);
    Ok(Some(CompletionResponse::List(CompletionList {
        is_incomplete: found.incomplete,
        items: found.items.into_iter().enumerate().map(item).collect(),
    })))
}

fn item(
    snapshot: &Snapshot,
    file: mauve_hir::File,
    lines: LineIndex<'_>,
    offset: mauve_syntax::TextSize,
    (index, found): (usize, Completion),
) -> CompletionItem {
    let capabilities = snapshot.capabilities;
    let (text, format) = match found.snippet.filter(|_| capabilities.snippets) {
        Some(snippet) => (snippet, Some(InsertTextFormat::SNIPPET)),
        None => (found.insert, None),
    };
    let many_lines = text.contains('\n');
    let whole = lines.range(found.replaced);
    let edit = if capabilities.insert_replace {
        let mut insert = whole;
        insert.end = lines.position(offset);
        CompletionTextEdit::InsertAndReplace(InsertReplaceEdit { new_text: text, insert, replace: whole })
    } else {
        CompletionTextEdit::Edit(TextEdit::new(whole, text))
    };
    let some = |text: String| (!text.is_empty()).then_some(text);
    let details = CompletionItemLabelDetails {
        detail: some(found.detail.clone()),
        description: some(found.note.clone()),
    };
    let detail = match (found.detail.trim_start_matches(": "), found.note.as_str()) {
        (detail, "") => detail.to_owned(),
        ("", note) => note.to_owned(),
        (detail, note) => format!("{detail} · {note}"),
    };
    let has_details = details.detail.is_some() || details.description.is_some();
    // The client shows this text above the documentation, which says the same.
    let is_repeated = capabilities.label_details && found.subject.is_some();
    let commits =
        capabilities.commit_characters && found.kind == CompletionKind::Instance && format.is_none();
    CompletionItem {
        label: found.label,
        label_details: (capabilities.label_details && has_details).then_some(details),
        kind: Some(kind(found.kind, capabilities.completion_kinds)),
        detail: some(detail).filter(|_| !is_repeated),
        // Items are sorted by relevance, then by the order of the text.
        sort_text: Some(format!("{}{index:04}", found.rank)),
        filter_text: found.filter,
        insert_text_format: format,
        insert_text_mode: (many_lines && capabilities.adjust_indentation)
            .then_some(InsertTextMode::ADJUST_INDENTATION),
        text_edit: Some(edit),
        additional_text_edits: (!found.more.is_empty()).then(|| text_edits(snapshot, file, &found.more)),
        commit_characters: commits.then(|| vec![".".to_owned()]),
        // What the item refers to: the client keeps it.
        data: found.subject.and_then(|subject| serde_json::to_value(subject).ok()),
        ..CompletionItem::default()
    }
}

/// Resolves an item: adds its documentation. The item is identified by names, since positions change while the user
/// types.
pub(crate) fn resolve(snapshot: &Snapshot, item: &CompletionItem) -> Result<CompletionItem> {
    let mut item = item.clone();
    let subject = item.data.as_ref().and_then(|data| Subject::deserialize(data).ok());
    let mut workspaces = snapshot.workspaces.iter();
    let found = subject.and_then(|subject| {
        workspaces.find_map(|&workspace| mauve_ide::documentation(&snapshot.db, workspace, &subject))
    });
    item.documentation = found
        .map(|text| documentation(snapshot.capabilities.completion_markdown, text))
        .or(item.documentation);
    Ok(item)
}

/// Returns Markdown, or its text for a client that shows no Markdown.
pub(super) fn documentation(markdown: bool, text: String) -> Documentation {
    match markdown {
        true => Documentation::MarkupContent(MarkupContent { kind: MarkupKind::Markdown, value: text }),
        false => Documentation::String(plain_text(&text)),
    }
}

/// Returns the kind in the protocol; a kind of the first version if the client does not support `all`.
fn kind(kind: CompletionKind, all: bool) -> CompletionItemKind {
    use CompletionKind::*;
    match kind {
        BuiltInType | Message if !all => CompletionItemKind::CLASS,
        Constant | State if !all => CompletionItemKind::VALUE,
        Keyword => CompletionItemKind::KEYWORD,
        Skeleton => CompletionItemKind::SNIPPET,
        BuiltInType => CompletionItemKind::TYPE_PARAMETER,
        Message => CompletionItemKind::STRUCT,
        Library => CompletionItemKind::MODULE,
        Codel | BuiltIn => CompletionItemKind::FUNCTION,
        Shell => CompletionItemKind::INTERFACE,
        Core | Component | Architecture => CompletionItemKind::CLASS,
        Property | Key => CompletionItemKind::PROPERTY,
        Constant => CompletionItemKind::CONSTANT,
        Port => CompletionItemKind::FIELD,
        Operation => CompletionItemKind::METHOD,
        Variable | Instance => CompletionItemKind::VARIABLE,
        Value => CompletionItemKind::VALUE,
        State => CompletionItemKind::ENUM_MEMBER,
        File => CompletionItemKind::FILE,
    }
}
