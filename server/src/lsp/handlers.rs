//! A file for each method: from the protocol's words to ours, one question to `mauve-ide`, and back. They run on workers,
//! and an edit ends them.

pub(crate) mod completion;
pub(crate) mod definition;
pub(crate) mod document_symbols;
pub(crate) mod hover;
pub(crate) mod inlay_hints;
pub(crate) mod signature_help;
pub(crate) mod status;
