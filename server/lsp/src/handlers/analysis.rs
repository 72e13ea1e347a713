//! `mauve/analysis`: response times as `mauve wcrt --format json` shows them.
//!
//! | parameter | is | if left out |
//! |---|---|---|
//! | `textDocument` | a file: the deployments of its projects | all |
//! | `deployment` | a name, with its library or without | all |
//! | `significance` | a level, a list of levels, or `"all"` | the level that is shown |
//! | `method` | `"psm"` or `"classic"` | `"psm"` |
//!
//! The result is a list, with a document for each deployment in each project that has it.

use mauve_projects::analysis_document::{Deployed, Significance, analysis_document, deployments, levels};
use mauve_timing::{Level, Method};
use mauve_wcrt::Query;
use serde::Deserialize;
use serde_json::Value;
use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::TextDocumentIdentifier;

use super::to_value;
use crate::snapshot::Snapshot;

/// The parameters of `mauve/analysis`.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct AnalysisParams {
    text_document: Option<TextDocumentIdentifier>,
    deployment: Option<String>,
    significance: Option<Levels>,
    method: Option<Method>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(untagged, expecting = "expected a significance between 0 and 1 such as 1e-4, a list, or \"all\"")]
enum Levels {
    All(All),
    One(Level),
    Several(Vec<Level>),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum All {
    All,
}

/// Returns the requested response times.
pub(crate) fn analysis(snapshot: &Snapshot, params: &AnalysisParams) -> Result<Vec<Value>> {
    snapshot.complete()?;
    let db = &snapshot.db;
    let significance = match &params.significance {
        None => None,
        Some(Levels::All(All::All)) => Some(Significance::All),
        Some(Levels::One(level)) => Some(Significance::These(vec![*level])),
        Some(Levels::Several(levels)) if levels.is_empty() => {
            return Err(Error::invalid_params(
                "`significance` is an empty list: omit it, or name a level such as 1e-4",
            ));
        }
        Some(Levels::Several(levels)) => Some(Significance::These(levels.clone())),
    };
    let method = params.method.unwrap_or(Method::Best);
    let file = params.text_document.as_ref().map(|document| snapshot.file(document)).transpose()?;
    let found = deployments(db, &snapshot.workspaces, params.deployment.as_deref());
    let mut found = found.map_err(Error::invalid_params)?;
    found.retain(|(project, _)| {
        file.is_none_or(|(file, _)| mauve_hir::project_files(db, *project).contains(&file))
    });
    let documents = found.into_iter().map(|(project, deployment)| {
        let queries = levels(db, project, deployment, significance.as_ref()).into_iter();
        let queries = queries.map(|level| Query { level, method });
        to_value(&analysis_document(&Deployed::of_model(db, project, deployment, queries)))
    });
    documents.collect()
}
