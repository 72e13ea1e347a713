//! `textDocument/signatureHelp`.

use mauve_ide::CallSignature;
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{
    ParameterInformation, ParameterLabel, SignatureHelp, SignatureHelpParams, SignatureInformation,
};

use super::completion::documentation;
use crate::snapshot::Snapshot;

/// What the call around a position takes.
pub(crate) fn signature_help(
    snapshot: &Snapshot,
    params: &SignatureHelpParams,
) -> Result<Option<SignatureHelp>> {
    let (file, _, offset) = snapshot.at(&params.text_document_position_params)?;
    let project = snapshot.project(file);
    let found = project.and_then(|it| mauve_ide::signature_help(&snapshot.db, it, file, offset));
    Ok(found.map(|signature| SignatureHelp {
        active_parameter: Some(signature.active as u32),
        signatures: vec![information(snapshot, signature)],
        active_signature: Some(0),
    }))
}

fn information(snapshot: &Snapshot, signature: CallSignature) -> SignatureInformation {
    let capabilities = snapshot.capabilities;
    // Places in a label are counted as in a text of UTF-16, whatever the encoding of positions is; each from the one before.
    let (mut start, mut count) = (0, 0);
    let mut units = |end: usize| {
        count += signature.label.get(start..end).map_or(0, |text| text.encode_utf16().count() as u32);
        start = end;
        count
    };
    let parameter = |range: &mauve_syntax::TextRange| {
        let range = std::ops::Range::<usize>::from(*range);
        let label = match capabilities.label_offsets {
            true => ParameterLabel::LabelOffsets([units(range.start), units(range.end)]),
            false => ParameterLabel::Simple(signature.label.get(range).unwrap_or_default().to_owned()),
        };
        ParameterInformation { label, documentation: None }
    };
    let parameters = signature.parameters.iter().map(parameter).collect();
    let said = signature.documentation.map(|text| documentation(capabilities.signature_markdown, text));
    SignatureInformation {
        label: signature.label,
        documentation: said,
        parameters: Some(parameters),
        active_parameter: None,
    }
}
