//! The hints of a declaration, without the figures of earlier texts.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ModelDb, Project};

use super::{HintOf, HintOptions, connections, deployment, hash_of, programs, values};

/// Returns the hints of an architecture or a deployment. salsa keeps them: an edit of another file that changes none of them does
/// not build them again.
#[salsa::tracked(returns(ref))]
pub(super) fn of_declaration<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
    options: HintOptions,
) -> Box<[HintOf]> {
    let mut found = Vec::new();
    if decl.kind(db) == Kind::Deployment {
        deployment::of_deployment(db, project, decl, options, &mut found);
    }
    if decl.kind(db) == Kind::Architecture && options.response_times {
        connections::of_connections(db, project, decl, &mut found);
    }
    if options.values {
        values::of_values(db, project, decl, &mut found);
    }
    found.into_boxed_slice()
}

/// Returns a value that changes whenever the subject or the label of a hint of a declaration changes.
pub(super) fn hash_of_declaration(
    db: &dyn ModelDb,
    project: Project<'_>,
    decl: Decl<'_>,
    options: HintOptions,
) -> u64 {
    match decl.kind(db) {
        Kind::Core if options.program_times => programs::hash_of_labels(db, project, decl),
        Kind::Architecture | Kind::Deployment => {
            let found = of_declaration(db, project, decl, options).iter();
            let shown =
                found.map(|HintOf { hint, subject, .. }| (subject, &hint.label, &hint.labels, hint.status));
            hash_of(shown.collect::<Vec<_>>())
        }
        _ => 0,
    }
}
