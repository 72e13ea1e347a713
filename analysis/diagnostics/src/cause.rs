//! Diagnostics with one cause are one mistake: one of them is reported.

use super::*;

/// The mistake behind a diagnostic, if several diagnostics can follow from it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(crate) enum Cause {
    /// The project does not include this file, which declares a name.
    NotIncluded(File),
    /// The library (`None`: outside libraries) does not use this one, which declares a name.
    NotUsed(Option<Name>, Name),
    /// A library has this name in several letter cases; in lower case.
    LetterCase(String),
    /// The architecture has no instance of this name.
    NoInstance(Name, Name),
    /// The times of this table overload CPUs.
    Overload(File),
}

/// The message at the location of a follow-up.
pub(super) const FOLLOWS: &str = "this follows from the same mistake";

/// Of more follow-ups, the locations are not shown.
const MOST_RELATED: usize = 3;

/// Keeps, of all diagnostics with one cause, the most severe and first one. Its fix
/// corrects them all.
pub(super) fn one_for_each_cause<'db>(
    db: &'db dyn ModelDb,
    found: Vec<Arc<Diagnostic<'db>>>,
) -> Vec<Arc<Diagnostic<'db>>> {
    if found.iter().all(|it| it.cause.is_none()) {
        return found;
    }
    let position = |it: &Diagnostic<'db>| (it.at.file(db).path(db).clone(), it.at.range(db).start());
    let (mut with_cause, mut kept): (Vec<_>, Vec<_>) = found.into_iter().partition(|it| it.cause.is_some());
    with_cause.sort_by_cached_key(|it| (it.code.severity, position(it)));
    let mut first: FxHashMap<Cause, usize> = FxHashMap::default();
    let mut folded: Vec<Arc<Diagnostic<'db>>> = Vec::new();
    for diagnostic in with_cause {
        let Some(cause) = diagnostic.cause.clone() else { continue };
        let index = *first.entry(cause).or_insert(folded.len());
        let Some(earlier) = folded.get_mut(index) else {
            folded.push(diagnostic);
            continue;
        };
        let earlier = Arc::make_mut(earlier);
        if earlier.related.len() < MOST_RELATED {
            match diagnostic.cause {
                // It is where the first one is, or near it, and names what follows.
                Some(Cause::LetterCase(_) | Cause::Overload(_)) => {
                    earlier.related.extend(diagnostic.related.iter().cloned())
                }
                _ => earlier.related.push((diagnostic.at.clone(), FOLLOWS.to_owned())),
            }
        }
        // One `use` or `include` is enough, but each name has to be changed.
        if !matches!(earlier.cause, Some(Cause::NoInstance(..))) {
            continue;
        }
        for fix in &mut earlier.fixes {
            let same = diagnostic.fixes.iter().filter(|it| it.title == fix.title).flat_map(|it| &it.edits);
            let new: Vec<_> = same.filter(|edit| !fix.edits.contains(edit)).cloned().collect();
            fix.edits.extend(new);
        }
    }
    kept.extend(folded);
    kept
}
