//! Hints with the execution times of programs, and the longest period of each state and each transition.

use mauve_hir::item_tree::{HookKind, Kind, Name, SourceId};
use mauve_hir::{
    Decl, Location, ModelDb, ProgramId, Project, core_of, declarations, file_groups, files_in_group,
    node_around, structure_of,
};
use mauve_syntax::SyntaxKind::{HOOK, METHOD, NAME, STATE, STATE_MACHINE, TRANSITION};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Level, Time};
use mauve_wcrt::{TableSet, level_shown, psm_of, tables_for};
use rustc_hash::FxHashMap;

use super::figures::{LastFigures, with_earlier};
use super::label::Texts;
use super::{HintFigure, HintOf, HintPlace, HintSubject, ShownHint, beside, hash_of};
use mauve_diagnostics::figure::{HintStatus, short};

/// Returns the hints of a core in `range`.
pub(super) fn of_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    range: TextRange,
    earlier: Option<&LastFigures>,
) -> Vec<HintOf> {
    let labels = labels_of(db, project, of).as_ref();
    if labels.map_or(earlier.is_none(), Vec::is_empty) {
        return Vec::new();
    }
    let mut found = Vec::new();
    let heads = heads(db, of, range);
    let text = of.file(db).text(db);
    let mut add = |id: SourceId, place: &HintPlace, label: Option<&Label>| {
        let explained_at = Location::Source(of, id).range(db).start();
        let Some(&offset) = heads.get(&explained_at).filter(|it| range.contains_inclusive(**it)) else {
            return;
        };
        let texts = label.map_or_else(Texts::default, |label| label.texts.clone());
        let shown = ShownHint { texts, status: HintStatus::Time, missing: label.map(|_| 0) };
        let subject = HintSubject::Program(place.clone());
        found.extend(with_earlier(shown.at(text, offset, subject, explained_at), earlier));
    };
    match labels {
        Some(labels) => labels.iter().for_each(|label| add(label.id, &label.place, Some(label))),
        None => places_of(db, of).iter().for_each(|(id, place)| add(*id, place, None)),
    }
    found
}

/// Returns the figures in a core, if they are known.
pub(super) fn figures<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<impl Iterator<Item = (HintSubject, HintFigure)> + use<'db>> {
    let labels = labels_of(db, project, of).as_ref()?.iter();
    Some(labels.map(|Label { place, texts, .. }| {
        (HintSubject::Program(place.clone()), HintFigure { texts: texts.clone(), missing: 0 })
    }))
}

/// Returns a hash of the labels in a core.
#[salsa::tracked(returns(copy))]
pub(super) fn hash_of_labels<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> u64 {
    hash_of(labels_of(db, project, of))
}

/// The label of a program, a state or a transition.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
struct Label {
    id: SourceId,
    place: HintPlace,
    texts: Texts,
}

/// Returns the labels of the programs, states and transitions of a core: none for those that take no time, and for programs
/// that are never executed; nothing if a time is unknown.
#[salsa::tracked(returns(ref))]
fn labels_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Vec<Label>> {
    let level = level_shown(db, project);
    let mut all: Vec<&'db LabelTimes> = Vec::new();
    for &component in components_of(db, project, of) {
        for &tables in tables_for(db, project, component) {
            // If one component has no times, the times of another would seem to hold for both; those of other tables likewise.
            all.push(costs_of(db, tables, component, level)?);
        }
    }
    if all.is_empty() {
        return None;
    }
    let label = |(id, place): &(SourceId, HintPlace)| {
        let mut times: Vec<Time> =
            all.iter().map(|costs| costs.times.get(place).copied()).collect::<Option<_>>()?;
        times.sort_unstable();
        let is_assumed = all.iter().any(|costs| costs.assumed);
        let (least, greatest) = (*times.first()?, *times.last().filter(|time| **time > Time::ZERO)?);
        let texts = texts_of(least, greatest, place, is_assumed);
        Some(Label { id: *id, place: place.clone(), texts })
    };
    Some(places_of(db, of).iter().filter_map(label).collect())
}

/// Returns the texts for the times of all components and tables. Assumed times are always marked.
fn texts_of(least: Time, greatest: Time, place: &HintPlace, is_assumed: bool) -> Texts {
    let longest = short(greatest);
    let figure = match place {
        HintPlace::State(_) | HintPlace::Transition(_) => format!("≤ {longest}"),
        HintPlace::Program(_) if least == greatest => longest,
        HintPlace::Program(_) => format!("{} to {longest}", short(least)),
    };
    let after = match place {
        HintPlace::State(_) | HintPlace::Transition(_) => " per period",
        HintPlace::Program(_) => "",
    };
    let assumed = if is_assumed { " · assumed" } else { "" };
    Texts::of([format!("{figure}{after}{assumed}"), format!("{figure}{assumed}")])
}

/// Returns what the labels of a core are about. A query of its own: most edits of a program do not change it, and build no label.
#[salsa::tracked(returns(ref))]
fn places_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<(SourceId, HintPlace)> {
    let Some(core) = structure_of(db, of) else { return Vec::new() };
    let updates = core.hooks.iter().filter(|(kind, _)| *kind == HookKind::Update);
    let mut places: Vec<(SourceId, HintPlace)> =
        updates.map(|(_, id)| (*id, HintPlace::Program(ProgramId::UPDATE))).collect();
    for state in core.states() {
        let name = &state.name.name;
        places.push((state.name.id, HintPlace::State(name.clone())));
        let method = |kind| HintPlace::Program(ProgramId::Method { state: name.clone(), kind });
        places.extend(state.methods.iter().map(|&(kind, id)| (id, method(kind))));
        places.extend(state.transitions.iter().map(|transition| {
            let of = (name.clone(), transition.name.name.clone());
            (transition.name.id, HintPlace::Transition(of))
        }));
    }
    places
}

#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct LabelTimes {
    /// The time of each program that some period executes and that takes time, and the longest period that begins in a state or
    /// ends with a transition.
    times: FxHashMap<HintPlace, Time>,
    assumed: bool,
}

#[salsa::tracked(returns(as_ref))]
fn costs_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
) -> Option<LabelTimes> {
    let psm = psm_of(db, tables, component, level).as_ref().ok()?;
    let mut costs = LabelTimes { assumed: !psm.assumed.is_empty(), ..LabelTimes::default() };
    // If two states have one name, the first counts.
    let mut numbers: FxHashMap<&Name, usize> = FxHashMap::default();
    for (number, name) in psm.states.iter().enumerate() {
        numbers.entry(name).or_insert(number);
    }
    let programs = psm.edges.executed().filter_map(|index| psm.programs.get(index));
    for (program, time) in programs.filter(|(_, time)| *time > Time::ZERO) {
        costs.times.entry(HintPlace::Program(program.clone())).or_insert(*time);
    }
    for (time, described) in psm.longest_times().zip(&psm.edges.all) {
        let (Some(time), source) = (time, described.source) else { continue };
        let Some(state) = psm.states.get(source).filter(|state| numbers.get(state) == Some(&source)) else {
            continue;
        };
        let transition = described.transition.as_ref();
        let transition = transition.map(|it| HintPlace::Transition((state.clone(), it.clone())));
        for place in [HintPlace::State(state.clone())].into_iter().chain(transition) {
            let known = costs.times.entry(place).or_default();
            *known = (*known).max(time);
        }
    }
    Some(costs)
}

pub(crate) fn components_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> &'db [Decl<'db>] {
    components_by_core(db, project).get(&of).map_or(&[], Vec::as_slice)
}

#[salsa::tracked(returns(ref))]
fn components_by_core<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> FxHashMap<Decl<'db>, Vec<Decl<'db>>> {
    let mut found: FxHashMap<Decl<'db>, Vec<Decl<'db>>> = FxHashMap::default();
    for group in file_groups(db, project) {
        for &(component, core) in cores_in_group(db, project, group) {
            found.entry(core).or_default().push(component);
        }
    }
    found
}

/// Returns the components in a group of files with their cores.
#[salsa::tracked(returns(ref))]
fn cores_in_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    group: u32,
) -> Vec<(Decl<'db>, Decl<'db>)> {
    let all = files_in_group(db, project, group).iter().flat_map(|&file| &declarations(db, file).all);
    let components = all.filter(|decl| decl.kind(db) == Kind::Component);
    components.filter_map(|&it| Some((it, core_of(db, project, it)?))).collect()
}

/// Returns the offsets of the hints of a core's programs, states and transitions in `range`, by the start of their names or
/// keywords: at the end of the line with the item, or with its first brace if it has several lines. Visits the core once, because finding a node
/// takes long in a large tree.
fn heads(db: &dyn ModelDb, of: Decl<'_>, range: TextRange) -> FxHashMap<TextSize, TextSize> {
    let mut heads = FxHashMap::default();
    let core = node_around(db, of.file(db), Location::name_of(of).range(db));
    let text = of.file(db).text(db);
    let mut lists = Vec::from_iter(core);
    while let Some(list) = lists.pop() {
        for node in list.children().filter(|it| it.text_range().intersect(range).is_some()) {
            if matches!(node.kind(), STATE_MACHINE | STATE) {
                lists.push(node.clone());
            }
            let begins = match node.kind() {
                HOOK | METHOD => node.first_token().map(|keyword| keyword.text_range()),
                STATE | TRANSITION => node.children().find(|it| it.kind() == NAME).map(|it| it.text_range()),
                _ => None,
            };
            let Some(begins) = begins else { continue };
            heads.extend(beside(text, &node).map(|offset| (begins.start(), offset)));
        }
    }
    heads
}
