//! The hints of a file.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, declarations, is_model, source_map};
use mauve_syntax::TextRange;

use super::declaration::{hash_of_declaration, of_declaration};
use super::earlier::{EarlierFigures, FigureOwner, of_lost_activities};
use super::figures::{missing_loads, with_earlier};
use super::{HintOf, HintOptions, HintSubject, InlayHint, hash_of, programs};
use crate::occurrences::each_once;
use mauve_diagnostics::figure::{MOST_CHARACTERS, cut};

/// A name before the label of a hint has so many characters at least, unless it is shorter.
const SHORTEST_NAME: usize = 7;

/// Returns the hints in `range`, in text order. Where a figure is unknown, the one among the `earlier` figures is shown, marked
/// as older.
///
/// ```
/// use mauve_ide::{EarlierFigures, HintOptions};
/// use mauve_hir::{Database, Workspace, projects};
/// use mauve_syntax::{TextRange, TextSize};
///
/// let model = "codel plan(): int  shell S { }  core C(S) { update = { plan(); } }  component P(S, C)
///     architecture A { instance pilot: P }
///     deployment D { architecture A
///         activity pilot { priority = 1 period = 100 }
///     }";
/// let db = Database::default();
/// let files = [
///     ("/robot.mal".into(), model.to_owned()),
///     ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
///     ("/times.toml".into(), "codel.plan = 17".to_owned()),
/// ];
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
/// let range = TextRange::up_to(TextSize::of(model));
/// let (options, earlier) = (HintOptions::default(), EarlierFigures::default());
/// let hints = mauve_ide::inlay_hints(&db, projects(&db, workspace)[0], file, range, options, &earlier);
/// assert!(hints.iter().any(|hint| hint.label == "✓ 17 / 100 ms"));
/// ```
pub fn inlay_hints(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    range: TextRange,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> Vec<InlayHint> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let declared = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
    let declared = declared.filter(|(_, map)| map.range.intersect(range).is_some());
    let hints = |(&decl, _)| hints_of(db, project, decl, range, options, earlier);
    let mut found: Vec<HintOf> = declared.flat_map(hints).collect();
    if options.response_times {
        found.extend(of_lost_activities(db, project, file, range, earlier, &found));
    }
    on_lines(found)
}

/// Returns the hints of a file in text order, with names where several are at one position.
pub(super) fn on_lines(mut found: Vec<HintOf>) -> Vec<InlayHint> {
    // Stable: the hints of one position stay in their order.
    found.sort_by_key(|found| found.hint.offset);
    let of_line = found.chunk_by(|one, other| one.hint.offset == other.hint.offset);
    of_line.flat_map(on_one_line).collect()
}

/// Returns the hints of a declaration in `range`.
fn hints_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
    range: TextRange,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> Vec<HintOf> {
    let is_in_range = |found: &&HintOf| range.contains_inclusive(found.hint.offset);
    let earlier = earlier.of(&FigureOwner::of(db, project, decl));
    match decl.kind(db) {
        Kind::Core if options.program_times => programs::of_core(db, project, decl, range, earlier),
        Kind::Architecture | Kind::Deployment => {
            let all = of_declaration(db, project, decl, options).iter().filter(is_in_range);
            let all: Vec<HintOf> = all.cloned().collect();
            let loads = missing_loads(&all, earlier);
            all.into_iter().flat_map(|found| with_earlier(found, earlier)).chain(loads).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns the hints at one position, with the names of their subjects where there are several.
fn on_one_line(found: &[HintOf]) -> Vec<InlayHint> {
    let shown = each_once(found);
    let mut names = shown.iter().filter_map(|found| found.subject.as_ref()?.name());
    let first = names.next();
    let are_several = names.any(|name| Some(name) != first);
    let hint = |found: &HintOf| {
        let mut hint = found.hint.clone();
        if let Some(name) = found.subject.as_ref().and_then(HintSubject::name).filter(|_| are_several) {
            let with_name = |label: &String| with_name(name, label);
            let mut labels: Vec<String> = hint.labels.iter().map(with_name).collect();
            labels.dedup();
            // A shorter form says more than a form without its end.
            if let Some(whole) = labels.iter().position(|label| !label.ends_with('…')) {
                labels.drain(..whole);
            }
            (hint.label, hint.labels) = (with_name(&hint.label), labels.into());
        }
        hint
    };
    shown.into_iter().map(hint).collect()
}

/// Returns the label of a hint after a name. If there is no room for both, the name is cut, or the end of the label.
fn with_name(name: &str, label: &str) -> String {
    let room = MOST_CHARACTERS.saturating_sub(label.chars().count() + ": ".len());
    cut(&format!("{}: {label}", cut(name, room.max(SHORTEST_NAME))), MOST_CHARACTERS)
}

/// Returns a value that changes whenever the label of a hint in a file changes, whatever its position. The labels of cores are
/// not built for it again.
pub fn hash_of_hints(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> u64 {
    let of_declaration = |&decl: &Decl<'_>| {
        let own = hash_of_declaration(db, project, decl, options);
        (own, earlier.hash_of(&FigureOwner::of(db, project, decl)))
    };
    let of_each: Vec<(u64, u64)> = declarations(db, file).all.iter().map(of_declaration).collect();
    hash_of((of_each, earlier.hash_of_lacking(db, project, file)))
}

#[cfg(test)]
mod tests {
    use mauve_diagnostics::figure::HintStatus;

    use super::super::label::Texts;
    use super::*;

    #[test]
    fn a_form_without_its_end_is_left_out_where_a_shorter_one_is_whole() {
        let forms = ["✓ 26 / 100 ms ▰▱▱▱▱▱ 26 %", "✓ 26 / 100 ms ▰▱▱▱▱▱", "✓"];
        let labels = |forms: &[&str]| {
            let of = |name: &str| {
                let texts = Texts::of(forms.iter().map(|it| (*it).to_owned()));
                let hint = InlayHint::new(0.into(), texts, MOST_CHARACTERS, HintStatus::Met, None);
                HintOf { hint, subject: Some(HintSubject::Activity(name.into())), figure: None, room: 0 }
            };
            on_lines(vec![of("planner"), of("a")]).swap_remove(0).labels
        };
        assert_eq!(labels(&forms)[..], ["planner: ✓ 26 / 100 ms ▰▱▱▱▱▱", "planner: ✓"]);
        assert_eq!(labels(&forms[..1])[..], ["planner: ✓ 26 / 100 ms ▰▱▱▱▱▱ 2…"]);
    }
}
