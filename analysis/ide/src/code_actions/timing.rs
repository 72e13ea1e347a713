//! Code actions that change the timing of a deployment: priorities, CPU, period, deadline.
//!
//! [`mauve_wcrt::better_timing`] finds the changes. The title of each says the response time of an activity before and after,
//! and how many deadlines are met: `Move detector to CPU 4: ✓ 62 → 40 / 50 ms, 16 of 16 met`. The activity is the one at the
//! cursor. If only another one gains, the title names that one. The analysis computes both times: from the text, and from the text with
//! the change.
//!
//! Those that meet the most deadlines are first. Among these, changes that keep what the model requires are before those that relax
//! it, a later deadline or a longer period, which say so; then the smallest. The first is preferred if it meets all deadlines and
//! relaxes nothing.
//!
//! An action is offered if it meets more deadlines, shortens this response time, or fixes a diagnostic of the activity; one
//! that relaxes something, only if it meets more deadlines; a shorter period is offered while all deadlines are met. A change is
//! dropped if it loses a met deadline in any project with the file, or leaves an activity no slack. The title counts new warnings.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::sync::Arc;

use mauve_diagnostics::{
    Diagnostic, Finding, declaration_diagnostics, shortened, timing_diagnostics, utilisation,
};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, declaration_at, deployment};
use mauve_syntax::TextRange;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_timing::{CpuLoad, Status, Time};
use mauve_wcrt::better_timing::{
    BetterTiming, TimingChange, better_activity, better_priorities, is_no_worse, keeps_slack,
};
use mauve_wcrt::{
    ActivityField, ActivityReport, Deadlines, Query, Report, ResolvedActivity, WhatIfField, facts_if,
    response_times, response_times_if, system_of,
};

use super::{ActionKind, Actions, CodeAction, MOST_CHARACTERS};
use crate::threads::{activities_with_threads, deployments_with_threads};
use crate::what_if::edit_of_fields;
use mauve_diagnostics::figure::changed_figure;

/// Offers the changes of the deployment and of the activity at the cursor, the best first.
pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Rewrite) && !actions.wants(ActionKind::QuickFix) {
        return;
    }
    let Some((deployment, at)) = deployment_and_activity_at(actions) else { return };
    let db = actions.db;
    let Some(project) = actions.project else { return };
    let query = Query::shown(db, project, deployment);
    let now = response_times(db, project, deployment, query);
    let index = at.as_ref().and_then(|(index, ..)| *index);
    let of_activity = index.map(|index| better_activity(db, project, deployment, index, query));
    let diagnostics = at.as_ref().map_or_else(Vec::new, |(.., range)| diagnostics_in(actions, *range));
    let subject = at.map(|(_, name, _)| name);
    let in_order = subject.iter().flat_map(|name| in_order(name, &diagnostics));
    let of_deployment = better_priorities(db, project, deployment, query).iter().cloned();
    let of_activity = of_activity.into_iter().flatten().cloned();
    let mut offers: Vec<BetterTiming> = Vec::new();
    for offer in of_activity.chain(in_order).chain(of_deployment) {
        if !offers.iter().any(|known| is_same(known, &offer)) {
            offers.push(offer);
        }
    }
    let (mut ranked, mut impossible) = (Vec::new(), None);
    for offer in &offers {
        match offer {
            BetterTiming::NoPriorities(names) => impossible = Some(names),
            BetterTiming::Change(change, fields) => {
                let outcome = |project| {
                    outcome_of(db, project, deployment, Query::shown(db, project, deployment), fields.clone())
                };
                // A file may be part of several projects, with other execution times.
                let outcomes: Vec<&ChangeOutcome<'_>> =
                    actions.projects.iter().map(|it| outcome(*it)).collect();
                let outcome = outcome(project);
                let effect = outcome.effect(now, subject.as_deref());
                let title = title_with(change, fields, outcome, &effect);
                if let Some(action) = action(change, title, &effect, &outcomes, &diagnostics) {
                    let rank = Rank {
                        met: Reverse(effect.deadlines.met),
                        relaxes: change.relaxes(),
                        is_partial: !effect.is_complete(),
                        has_warnings: !outcome.new_warnings.is_empty(),
                        place: place_of(change),
                        values: fields.len(),
                        response: effect.subject.map(|it| response(it.then)),
                    };
                    ranked.push((rank, action, fields));
                }
            }
        }
    }
    ranked.sort_by_key(|(rank, ..)| *rank);
    let mut is_solved = false;
    let mut titles = BTreeSet::new();
    for (index, (rank, mut action, fields)) in ranked.into_iter().enumerate() {
        let is_solution = !rank.relaxes && !rank.is_partial;
        is_solved |= is_solution;
        // The first solution; where nothing is to be solved, none.
        action.preferred = index == 0 && is_solution && action.kind == ActionKind::QuickFix;
        // An action is known by its title.
        if titles.insert(action.title.clone()) {
            actions.push(action, || edit_of_fields(db, project, deployment, fields).ok());
        }
    }
    if let Some(names) = impossible.filter(|_| !is_solved) {
        let why = no_priorities(now, names);
        actions.refuse(&why, why.clone());
    }
}

/// The order of the actions: the first of these that differs counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    met: Reverse<usize>,
    relaxes: bool,
    is_partial: bool,
    has_warnings: bool,
    place: u8,
    /// The number of values that change.
    values: usize,
    response: Option<OrderedResponse>,
}

/// Returns the priority that the diagnostics of an activity propose for it.
fn in_order(name: &str, diagnostics: &[Finding<'_>]) -> Option<BetterTiming> {
    let is_it = |it: &&Finding<'_>| it.diagnostic.code.name == "not-deadline-monotonic";
    let [fix] = diagnostics.iter().find(is_it)?.diagnostic.fixes.as_slice() else { return None };
    let [(_, number)] = fix.edits.as_slice() else { return None };
    let fields = vec![WhatIfField {
        instance: name.into(),
        field: ActivityField::Priority,
        value: number.as_str().into(),
    }];
    Some(BetterTiming::Change(TimingChange::Priority(number.parse().ok()?), fields))
}

/// Returns the action of a change, unless it improves nothing, or loses a deadline in one of the projects.
fn action<'db>(
    change: &TimingChange,
    title: String,
    effect: &Effect<'_>,
    outcomes: &[&ChangeOutcome<'db>],
    diagnostics: &[Finding<'db>],
) -> Option<CodeAction<'db>> {
    let is_left = |it: &&Finding<'_>| {
        let key = (it.diagnostic.code.name, it.diagnostic.at.clone());
        outcomes.iter().any(|outcome| outcome.diagnostics.contains(&key))
    };
    let is_shorter = matches!(change, TimingChange::Period { is_longer: false, .. });
    // A shorter period is no remedy: that another diagnostic disappears with it is a coincidence.
    let is_fixed = |it: &&Finding<'_>| !is_shorter && !is_left(it);
    let fixed: Vec<Finding<'_>> = diagnostics.iter().filter(is_fixed).cloned().collect();
    let is_better = match change.relaxes() {
        true => effect.meets_more(),
        false => is_shorter || !fixed.is_empty() || effect.is_better(),
    };
    if !is_better || outcomes.iter().any(|outcome| outcome.loses) {
        return None;
    }
    let kind = if fixed.is_empty() { ActionKind::Rewrite } else { ActionKind::QuickFix };
    Some(CodeAction { fixed, ..CodeAction::new(kind, title) })
}

/// Returns a title with as much of the effects as fits: the remarks always, then the number of met deadlines, then the response
/// time of an activity.
fn title_with(
    change: &TimingChange,
    fields: &[WhatIfField],
    outcome: &ChangeOutcome<'_>,
    effect: &Effect<'_>,
) -> String {
    let named = fields.first().filter(|first| fields.iter().all(|it| it.instance == first.instance));
    let change = title(change, fields);
    let end = format!("{}{}", effect.met(), outcome.remarks());
    let with = |more: &[&str]| {
        let more: Vec<&str> = more.iter().copied().filter(|it| !it.is_empty()).collect();
        if more.is_empty() { change.clone() } else { format!("{change}: {}", more.join(", ")) }
    };
    let figure = effect.figure(named.map(|it| it.instance.as_str()));
    let candidates = [with(&[&figure, &end]), with(&[&end])];
    let fits = candidates.into_iter().find(|it| it.chars().count() <= MOST_CHARACTERS);
    fits.unwrap_or_else(|| {
        let room = MOST_CHARACTERS.saturating_sub(end.chars().count() + ": ".len()).max(MOST_CHARACTERS / 3);
        shortened(&format!("{}: {end}", shortened(&change, room)), MOST_CHARACTERS)
    })
}

/// An activity at the cursor: its index in the system of its deployment, its name, and its range.
type ActivityHere = (Option<usize>, String, TextRange);

/// Returns the deployment and the activity at the cursor: in a model, or in a file of threads.
fn deployment_and_activity_at<'db>(actions: &Actions<'_, 'db>) -> Option<(Decl<'db>, Option<ActivityHere>)> {
    let (db, project) = (actions.db, actions.project?);
    let activities_of = |deployment| &system_of(db, project, deployment).activities;
    if let Some(deployment) = deployment_at(actions) {
        let activity = actions.node::<ast::Activity>();
        let here = activity.and_then(|it| {
            let name = it.name_ref()?;
            let at = Some(name.syntax().text_range());
            let is_it = |of: &ResolvedActivity<'db>| of.at.range_in(db, actions.question.file) == at;
            let index = activities_of(deployment).iter().position(is_it);
            Some((index, name.syntax().text().to_string(), it.syntax().text_range()))
        });
        return Some((deployment, here));
    }
    let (file, at) = (actions.question.file, actions.question.range.start());
    deployments_with_threads(db, &[project], file).into_iter().find_map(|(_, deployment)| {
        let mut all = activities_with_threads(db, project, deployment, file).into_iter();
        let (index, [entry, _]) = all.find(|(_, [entry, _])| entry.contains_inclusive(at))?;
        let name = activities_of(deployment).get(index)?.instance.to_string();
        Some((deployment, Some((Some(index), name, entry))))
    })
}

/// Returns the deployment at the cursor.
pub(super) fn deployment_at<'db>(actions: &Actions<'_, 'db>) -> Option<Decl<'db>> {
    let start = actions.node::<ast::Deployment>()?.syntax().text_range().start();
    let found = declaration_at(actions.db, actions.question.file, TextRange::empty(start))?;
    deployment(actions.db, found).map(|_| found)
}

/// Returns the diagnostics of an activity that another timing may fix.
fn diagnostics_in<'db>(actions: &Actions<'_, 'db>, activity: TextRange) -> Vec<Finding<'db>> {
    const CODES: [&str; 3] = ["deadline-missed", "not-deadline-monotonic", "equal-priorities"];
    if !actions.wants(ActionKind::QuickFix) {
        return Vec::new();
    }
    let is_here = |at: &Location<'db>| activity.contains_range(at.range(actions.db));
    // An overloaded CPU is reported at one activity, and is related to all without a bound.
    let is_it = |diagnostic: &Diagnostic<'db>| {
        let is_related = || diagnostic.related.iter().any(|(at, _)| is_here(at));
        CODES.contains(&diagnostic.code.name)
            && (is_here(&diagnostic.at) || diagnostic.code.name == "deadline-missed" && is_related())
    };
    actions.findings().iter().filter(|it| is_it(&it.diagnostic)).cloned().collect()
}

/// Returns whether two offers set the same values, or are equal.
fn is_same(one: &BetterTiming, other: &BetterTiming) -> bool {
    match (one, other) {
        (BetterTiming::Change(_, one), BetterTiming::Change(_, other)) => {
            one.len() == other.len() && one.iter().all(|field| other.contains(field))
        }
        _ => one == other,
    }
}

/// Returns the place of a change among those with as good an effect, by what it touches.
fn place_of(change: &TimingChange) -> u8 {
    match change {
        TimingChange::Priority(_) => 0,
        TimingChange::Cpu(_) => 1,
        TimingChange::SwapPriorities
        | TimingChange::PrioritiesByDeadline
        | TimingChange::OptimalPriorities => 2,
        TimingChange::Period { .. } => 3,
        TimingChange::Deadline(_) => 4,
    }
}

/// The characters of a name in a title.
const MOST_OF_NAME: usize = 20;

/// Returns what a change does, in words.
fn title(change: &TimingChange, fields: &[WhatIfField]) -> String {
    let mut names = fields.iter().map(|it| shortened(&it.instance, MOST_OF_NAME));
    let name = names.next().unwrap_or_default();
    match change {
        TimingChange::Priority(number) => format!("Give {name} priority {number}"),
        TimingChange::SwapPriorities => {
            format!("Swap the priorities of {name} and {}", names.next().unwrap_or_default())
        }
        TimingChange::PrioritiesByDeadline => "Order priorities by deadline".to_owned(),
        TimingChange::OptimalPriorities => format!("Reorder {} priorities", fields.len()),
        TimingChange::Cpu(cpu) => format!("Move {name} to {cpu}"),
        TimingChange::Deadline(deadline) => format!("Relax the deadline of {name} to {deadline}"),
        TimingChange::Period { is_longer, with_deadline, period } => {
            let verb = if *is_longer { "Relax" } else { "Shorten" };
            let deadline = if *with_deadline { " and deadline" } else { "" };
            format!("{verb} the period{deadline} of {name} to {period}")
        }
    }
}

/// Says why no order of priorities meets every deadline: of these activities, none may have the lowest priority.
fn no_priorities(report: &Report<'_>, names: &[Name]) -> String {
    const WHAT: &str = "No order of priorities meets all deadlines";
    let cpus = report.activities.iter().find(|it| names.contains(&it.instance)).and_then(|it| it.cpus);
    let is_overloaded = |load: &&CpuLoad| {
        cpus.is_some_and(|cpus| load.cpus.meets(cpus)) && load.utilisation.as_f64() > load.cpus.len() as f64
    };
    match report.cpus.iter().find(is_overloaded) {
        Some(load) => format!("{WHAT}: {} is overloaded ({})", load.cpus, utilisation(load)),
        None => format!("{WHAT}: none of {} can be last", names.join(", ")),
    }
}

/// What a change gives.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct ChangeOutcome<'db> {
    then: Report<'db>,
    new_warnings: BTreeSet<&'static str>,
    /// Whether the change loses a met deadline or a bound, or leaves no slack.
    loses: bool,
    /// The diagnostics with the change.
    diagnostics: Vec<(&'static str, Location<'db>)>,
}

/// A real-time activity before and after a change.
#[derive(Clone, Copy)]
struct Changed<'a> {
    now: &'a ActivityReport<'a>,
    then: &'a ActivityReport<'a>,
}

impl Changed<'_> {
    fn becomes_met(self) -> bool {
        self.then.verdict.is_met() && !self.now.verdict.is_met()
    }
}

/// The response time of an activity, ordered: the best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum OrderedResponse {
    Bound(Time),
    Unbounded,
    NotAnalysed,
}

/// The effect of a change on the activity that the title names, and on the number of met deadlines.
struct Effect<'a> {
    subject: Option<Changed<'a>>,
    met_now: usize,
    deadlines: Deadlines,
}

#[salsa::tracked(returns(ref))]
fn outcome_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    fields: Vec<WhatIfField>,
) -> ChangeOutcome<'db> {
    let now = response_times(db, project, of, query);
    let then = response_times_if(db, project, of, query, &fields);
    let key = |it: &Arc<Diagnostic<'db>>| (it.code.name, it.at.clone());
    let before: Vec<_> = declaration_diagnostics(db, project, of).iter().map(key).collect();
    let mut after: Vec<_> =
        timing_diagnostics(db, project, &facts_if(db, project, of, &fields)).iter().map(key).collect();
    let new_warnings = after.iter().filter(|it| !before.contains(it)).map(|(code, _)| *code).collect();
    let late = then.activities.iter().filter(|it| !it.verdict.is_met());
    after.extend(late.filter_map(|it| Some(("deadline-missed", it.at.clone()?))));
    let loses = !is_no_worse(now, &then) || !keeps_slack(now, &then);
    ChangeOutcome { then, new_warnings, loses, diagnostics: after }
}

fn response(activity: &ActivityReport<'_>) -> OrderedResponse {
    match (activity.response, activity.verdict) {
        (Some(response), _) => OrderedResponse::Bound(response),
        (None, Status::Unbounded | Status::NoBound) => OrderedResponse::Unbounded,
        _ => OrderedResponse::NotAnalysed,
    }
}

impl<'db> ChangeOutcome<'db> {
    /// Returns the effect on the activity of this name, or on one that meets its deadline only then. Without a name, or where
    /// nothing changes there, on the activity that needs it most: one that misses its deadline, or that has the least slack.
    fn effect<'a>(&'a self, now: &'a Report<'db>, subject: Option<&str>) -> Effect<'a> {
        let both = now.activities.iter().zip(&self.then.activities);
        let all = both.map(|(now, then)| Changed { now, then });
        let all = all.filter(|it| it.then.verdict != Status::Background);
        let named = all.clone().find(|it| Some(it.now.instance.as_str()) == subject);
        let neediest = |is_it: fn(&Changed<'_>) -> bool| {
            let is_unknown = |it: &Changed<'_>| response(it.now) == OrderedResponse::NotAnalysed;
            let key = |it: &Changed<'_>| (is_unknown(it), it.now.verdict.is_met(), it.now.slack());
            all.clone().filter(is_it).min_by_key(key)
        };
        let gaining = named.filter(|it| it.becomes_met()).or_else(|| neediest(|it| it.becomes_met()));
        let subject = gaining.or(named).or_else(|| neediest(|_| true));
        Effect { subject, met_now: now.deadlines().met, deadlines: self.then.deadlines() }
    }

    fn remarks(&self) -> String {
        let has_assumed = self.then.activities.iter().any(|it| !it.assumed.is_empty());
        let warnings = match self.new_warnings.len() {
            0 => "",
            1 => ", 1 warning",
            _ => ", warnings",
        };
        format!("{}{warnings}", if has_assumed { ", assumed" } else { "" })
    }
}

impl Effect<'_> {
    fn is_better(&self) -> bool {
        self.meets_more() || self.subject.is_some_and(|it| response(it.then) < response(it.now))
    }

    fn meets_more(&self) -> bool {
        self.deadlines.met > self.met_now
    }

    /// Whether every deadline is met then.
    fn is_complete(&self) -> bool {
        self.deadlines.met == self.deadlines.all
    }

    /// Returns `✓ 62 → 40 / 50 ms`, behind the name of the activity unless it is `named`; nothing where nothing changes.
    fn figure(&self, named: Option<&str>) -> String {
        let Some(it) = self.subject else { return String::new() };
        let responses = [it.now, it.then].map(response);
        let changes = responses[0] != responses[1] || it.becomes_met();
        let Some(deadline) =
            it.then.deadline.filter(|_| changes && !responses.contains(&OrderedResponse::NotAnalysed))
        else {
            return String::new();
        };
        let figure = changed_figure((it.now.response, it.then.response), deadline);
        match named == Some(it.now.instance.as_str()) {
            true => figure,
            false => format!("{} {figure}", shortened(&it.now.instance, MOST_OF_NAME)),
        }
    }

    /// Returns `16 of 16 met`; nothing where nothing is known.
    fn met(&self) -> String {
        let Deadlines { met, unknown, all } = self.deadlines;
        match unknown {
            0 => format!("{met} of {all} met"),
            _ if unknown == all => String::new(),
            _ => format!("{met} of {} met, {unknown} unknown", all - unknown),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::PathBuf;

    use super::*;
    use crate::fixture::{Fixture, project_with};
    use crate::{ActionQuestion, Changes, code_actions};
    use expect_test::{Expect, expect};
    use mauve_diagnostics::workspace_diagnostics;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_tests::Random;

    /// The first file of a robot with a component for each instance: `(name, cost)`.
    fn robot(costs: &[(&str, &str)], deployment: &str, config: &str) -> String {
        let mut model = String::from("shell S { }\n");
        let mut architecture = String::from("architecture A {");
        let mut table = String::new();
        for (name, cost) in costs {
            let _ = writeln!(model, "codel {name}_run(): int");
            let _ = writeln!(
                model,
                "core C_{name}(S) {{ update = {{ {name}_run(); }} }}  component K_{name}(S, C_{name})"
            );
            let _ = write!(architecture, " instance {name}: K_{name}");
            let _ = writeln!(table, "codel.{name}_run = {cost}");
        }
        format!(
            "{model}{architecture} }}\n{deployment}\n//- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n[platform]\n\
             rt_throttling = false\n{config}\n//- /times.toml\n{table}"
        )
    }

    /// The figures of a report, without locations.
    fn figures(report: &Report<'_>) -> String {
        let mut out = format!("{:?}\n", report.cpus);
        let mut breakdown = report.breakdown(&|| ());
        for (index, it) in report.activities.iter().enumerate() {
            let activity = (&it.instance, it.priority, it.cpus, it.period, it.deadline);
            let _ = writeln!(
                out,
                "{activity:?} {:?} {:?} {:?} {:?} {:?} {:?}",
                it.own,
                it.first_job,
                it.response,
                it.verdict,
                it.window,
                breakdown.of(index)
            );
        }
        out
    }

    fn codes(db: &Database, workspace: Workspace) -> Vec<&'static str> {
        workspace_diagnostics(db, workspace).iter().map(|it| it.diagnostic.code.name).collect()
    }

    /// A project after an edit.
    struct Edited {
        db: Database,
        workspace: Workspace,
    }

    impl Edited {
        fn new(db: &Database, workspace: Workspace, change: &crate::Change) -> Edited {
            let texts =
                workspace.files(db).iter().map(|(path, file)| (path.clone(), change.applied(db, *file)));
            let texts: Vec<(PathBuf, String)> = texts.collect();
            let db = Database::default();
            let workspace = Workspace::of_texts(&db, "/".into(), texts);
            Edited { db, workspace }
        }

        /// The response times of the deployment `D`.
        fn report(&self) -> &Report<'_> {
            let project = projects(&self.db, self.workspace)[0];
            let deployment = names_of(&self.db, project).anywhere(Kind::Deployment, "D")[0];
            response_times(&self.db, project, deployment, Query::shown(&self.db, project, deployment))
        }
    }

    /// Returns the activity whose figure follows the colon of a title: its name is before the mark, or is the only one of the change.
    fn subject_of(title: &str) -> Option<&str> {
        let (change, effect) = title.split_once(": ").unwrap();
        let (before, _) = effect.split_once(['✓', '!', '✗'])?;
        let named = |from: &str, to: &str| change.split_once(from)?.1.split_once(to).map(|it| it.0);
        Some(match before.trim() {
            "" => named("Give ", " priority ")
                .or_else(|| named("Move ", " to "))
                .or_else(|| named(" of ", " to "))
                .expect(title),
            name => name,
        })
    }

    /// What the title of an action says after its colon and a name, computed from the analyses of the two texts.
    fn effect_of(now: &Report<'_>, then: &Report<'_>, subject: Option<&str>) -> String {
        let figure = subject.map(|subject| {
            let of = |report: &Report<'_>| {
                let it = report.activities.iter().find(|it| it.instance == subject).expect(subject);
                let response = it.response.map_or("unbounded".to_owned(), Time::number);
                (response, it.verdict.is_met(), it.response, it.deadline.unwrap())
            };
            let ((before, ..), (after, is_met, response, deadline)) = (of(now), of(then));
            let is_tight = response.is_some_and(|it| deadline.as_nanos() * 9 < it.as_nanos() * 10);
            let mark = if !is_met { "✗" } else { if is_tight { "!" } else { "✓" } };
            let change = if before == after { String::new() } else { format!("{before} → ") };
            format!("{mark} {change}{after} / {deadline}, ")
        });
        let (mut met, mut unknown, mut all) = (0, 0, 0);
        for it in then.activities.iter().filter(|it| it.deadline.is_some()) {
            all += 1;
            met += usize::from(it.verdict.name() == "met");
            unknown += usize::from(it.verdict.name() == "not-analysed");
        }
        let unknown_too = if unknown > 0 { format!(", {unknown} unknown") } else { String::new() };
        format!("{}{met} of {} met{unknown_too}", figure.unwrap_or_default(), all - unknown)
    }

    /// Returns the titles at the cursor. Each action is applied to the text, which is analysed anew: the title must be right.
    fn offered(fixture: &str) -> Vec<String> {
        titles_at(fixture, true)
    }

    fn titles_at(fixture: &str, is_applied: bool) -> Vec<String> {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let query = Query::shown(&db, project, deployment);
        let index = system_of(&db, project, deployment)
            .activities
            .iter()
            .position(|it| it.at.range(&db).contains_inclusive(offset));
        let mut offers = better_priorities(&db, project, deployment, query).clone();
        let of_activity = index.map(|index| better_activity(&db, project, deployment, index, query));
        offers.extend(of_activity.into_iter().flatten().cloned());
        for offer in offers {
            let BetterTiming::Change(_, fields) = offer else { continue };
            let edited =
                Edited::new(&db, workspace, &edit_of_fields(&db, project, deployment, &fields).unwrap());
            let what_if = response_times_if(&db, project, deployment, query, &fields);
            assert_eq!(figures(edited.report()), figures(&what_if), "{fields:?}\n{fixture}");
        }
        let question = ActionQuestion {
            file,
            range: TextRange::empty(offset),
            diagnostics: &[],
            kinds: &[ActionKind::Rewrite, ActionKind::QuickFix],
            changes: Changes::All,
        };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
        let met =
            |report: &Report<'_>| report.activities.iter().map(|it| it.verdict.is_met()).collect::<Vec<_>>();
        let is_no_worse_than =
            |now: &[bool], then: &[bool]| now.iter().zip(then).all(|(now, then)| !now || *then);
        let now = response_times(&db, project, deployment, query);
        let before = codes(&db, workspace);
        let mut titles = Vec::new();
        assert!(actions.iter().filter(|it| it.preferred).count() <= 1, "{fixture}");
        let mut last = (Reverse(usize::MAX), false);
        // The values of a whole deployment have tests of their own.
        let is_tuned = |it: &CodeAction<'_>| {
            ["Assign", "Balance", "Shorten all"].iter().any(|of| it.title.starts_with(of))
        };
        let is_of_timing =
            |it: &&CodeAction<'_>| !is_tuned(it) && (it.title.contains(" met") || it.disabled.is_some());
        for action in actions.iter().filter(is_of_timing) {
            let title = &action.title;
            if action.disabled.is_some() {
                titles.push(format!("{title} (disabled)"));
                continue;
            }
            // Of those that meet as many deadlines, those that relax something are last. They gain something, and are not preferred.
            let count =
                title.rsplit_once(" met").and_then(|(before, _)| before.rsplit(' ').nth(2)?.parse().ok());
            let relaxes = title.starts_with("Relax");
            assert!(last <= (Reverse(count.unwrap()), relaxes), "{title}");
            last = (Reverse(count.unwrap()), relaxes);
            assert!(!relaxes || !action.preferred, "{title}");
            assert!(title.chars().count() <= MOST_CHARACTERS, "{title}");
            titles
                .push(format!("{title}{}", if action.kind == ActionKind::QuickFix { " (fix)" } else { "" }));
            if !is_applied {
                continue;
            }
            let edited = Edited::new(&db, workspace, action.change.as_ref().unwrap());
            let then = edited.report();
            let (_, effect) = title.split_once(": ").unwrap();
            let effect = effect.find(['✓', '!', '✗']).map_or(effect, |at| &effect[at..]);
            // A shortened name is not looked up.
            let subject = subject_of(title);
            let is_known = subject.is_none_or(|it| !it.contains('…'));
            if is_known {
                let expected = effect_of(now, then, subject);
                assert!(effect.starts_with(&expected), "{title}\n{expected}\n{fixture}");
            }
            let used_up = |report: &Report<'_>| {
                let all = report.activities.iter();
                all.filter(|it| it.response.is_some() && it.response == it.deadline).count()
            };
            assert!(used_up(then) <= used_up(now), "no slack: {title}\n{fixture}");
            assert!(!action.preferred || met(then).iter().all(|it| *it), "{title}\n{fixture}");
            // The action improves something, loses no deadline, and its title names new warnings.
            let is_faster =
                now.activities.iter().zip(&then.activities).any(|(now, then)| {
                    then.response.is_some_and(|it| now.response.is_none_or(|now| it < now))
                });
            let count = |report: &Report<'_>| met(report).iter().filter(|it| **it).count();
            let is_fix = action.kind == ActionKind::QuickFix && !relaxes;
            let is_better =
                count(then) > count(now) || !relaxes && is_faster || is_fix || title.starts_with("Shorten");
            assert!(is_better && is_no_worse_than(&met(now), &met(then)), "{title}\n{fixture}");
            let after = codes(&edited.db, edited.workspace);
            for code in
                ["not-deadline-monotonic", "equal-priorities", "stale-data", "deadline-exceeds-period"]
            {
                let is_new = after.iter().filter(|it| **it == code).count()
                    > before.iter().filter(|it| **it == code).count();
                assert!(!is_new || title.contains("warning"), "{code}: {title}\n{fixture}");
            }
        }
        titles
    }

    fn check(fixture: &str, expected: Expect) {
        expected.assert_eq(&(offered(fixture).join("\n") + "\n"));
    }

    #[test]
    fn priorities_by_deadline() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let deployment = "deployment D { architecture A $0
            activity laser { priority = 9 period = 100 }
            activity pilot { priority = 5 period = 50 deadline = 40 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Give pilot priority 10: ✓ 60 → 20 / 40 ms, 2 of 2 met
                Order priorities by deadline: pilot ✓ 60 → 20 / 40 ms, 2 of 2 met
            "#]],
        );
    }

    #[test]
    fn priorities_are_swapped_where_no_deadline_is_lost() {
        let costs = [("a", "5"), ("b", "10"), ("c", "20")];
        let deployment = "deployment D { architecture A
            activity a { affinity = 1 priority = 3 period = 100 deadline = 50 }
            activity b { priority = 2 period = 100 deadline = 20 }
            activity c { priority = 1 period = 100 deadline = 40 }
        }";
        let at = |name: &str| {
            robot(&costs, &deployment.replace(&format!("activity {name}"), &format!("activity $0{name}")), "")
        };
        // With the priorities of a and c swapped, b would miss its deadline: 30 > 20.
        check(
            &at("c"),
            expect![[r#"
                Order priorities by deadline: c ✓ 35 → 30 / 40 ms, 3 of 3 met
                Shorten the period of c to 40 ms: 3 of 3 met
            "#]],
        );
        check(
            &at("b"),
            expect![[r#"
                Order priorities by deadline: b ✓ 15 → 10 / 20 ms, 3 of 3 met
                Shorten the period of b to 35 ms: 3 of 3 met
                Swap the priorities of b and a: b ✓ 15 → 10 / 20 ms, 3 of 3 met, 1 warning
            "#]],
        );
        check(
            &at("a"),
            expect![[r#"
                Order priorities by deadline: a ✓ 5 → 35 / 50 ms, 3 of 3 met (fix)
                Shorten the period of a to 50 ms: 3 of 3 met
            "#]],
        );
    }

    /// What is offered at `$0` of a file that two projects have, in which other times count.
    fn offered_in_two(deployment: &str, one: [&str; 2], two: [&str; 2]) -> String {
        let shared = "shell S { }\ncomponent Laser(S, C)  component Pilot(S, E)\n\
                      architecture A { instance laser: Laser  instance pilot: Pilot }\n";
        let root = |[laser, pilot]: [&str; 2]| {
            format!(
                "include \"shared.mal\"\ncodel short(): int  codel long(): int\ncore C(S) {{ update = {{ {laser}(); }} }}\n\
                 core E(S) {{ update = {{ {pilot}(); }} }}"
            )
        };
        let fixture = format!(
            "//- /shared.mal\n{shared}{deployment}\n//- /one.mal\n{}\n//- /two.mal\n{}\n//- /mauve.toml\n[project]\n\
             roots = [\"one.mal\", \"two.mal\"]\n[timing]\ntables = [\"times.toml\"]\n[platform]\n\
             rt_throttling = false\ncpus = 2\n//- /times.toml\n[codel]\nshort = 10\nlong = 60\n",
            root(one),
            root(two),
        );
        let Fixture { db, workspace, file, offset } = Fixture::new(&fixture);
        let kinds = &[ActionKind::Rewrite, ActionKind::QuickFix];
        let range = TextRange::empty(offset);
        let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::None };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
        let titles = actions.into_iter().map(|action| action.title).filter(|title| title.contains(" met"));
        titles.map(|title| title + "\n").collect()
    }

    #[test]
    fn nothing_is_offered_that_loses_a_deadline_in_another_project() {
        let deployment = "deployment D { architecture A
            activity $0laser { affinity = 1 priority = 2 period = 100 }
            activity pilot { affinity = 2 priority = 1 period = 100 } }";
        // In the second project, both overload one CPU, and 10 ms are too short.
        assert_eq!(offered_in_two(deployment, ["short", "short"], ["long", "long"]), "");
        let alike = offered_in_two(deployment, ["short", "long"], ["short", "long"]);
        assert!(alike.contains("Shorten the period"), "{alike}");
        // The project that answers misses a deadline, the other one does not.
        let deployment = "deployment D { architecture A
            activity laser { affinity = 1 priority = 2 period = 100 }
            activity $0pilot { affinity = 1 priority = 1 period = 100 deadline = 50 } }";
        expect![[r#"
            Give pilot priority 3: ✓ 70 → 10 / 50 ms, 2 of 2 met
            Move pilot to CPU 2: ✓ 70 → 10 / 50 ms, 2 of 2 met
            Swap the priorities of pilot and laser: pilot ✓ 70 → 10 / 50 ms, 2 of 2 met
            Relax the deadline of pilot to 70.1 ms: ! 70 / 70.1 ms, 2 of 2 met
        "#]]
        .assert_eq(&offered_in_two(deployment, ["long", "short"], ["short", "short"]));
    }

    #[test]
    fn where_no_order_of_priorities_helps_that_is_said() {
        let costs = [("laser", "40"), ("pilot", "20"), ("arm", "1")];
        let deployment = "deployment D { architecture A
            activity arm { priority = 9 period = 10 }
            activity la$0ser { priority = 8 period = 60 }
            activity pilot { priority = 5 period = 60 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                No order of priorities meets all deadlines: CPU 1 is overloaded (110.0 %) (disabled)
            "#]],
        );
    }

    #[test]
    fn a_missed_deadline_has_other_cpus_and_longer_periods() {
        let costs = [("laser", "40"), ("pilot", "20"), ("arm", "30")];
        let deployment = "deployment D { architecture A
            activity laser { priority = 9 affinity = 1 period = 100 deadline = 100 }
            activity arm { priority = 8 affinity = 2 period = 60 deadline = 60 }
            activity $0pilot {
                priority = 5
                affinity = 1
                period = 50
                deadline = 50
            }
        }";
        check(
            &robot(&costs, deployment, "cpus = 3"),
            expect![[r#"
                Give pilot priority 10: ✓ 60 → 20 / 50 ms, 3 of 3 met (fix)
                Move pilot to CPU 3: ✓ 60 → 20 / 50 ms, 3 of 3 met (fix)
                Swap the priorities of pilot and laser: pilot ✓ 60 → 20 / 50 ms, 3 of 3 met (fix)
                Relax the period and deadline of pilot to 60.1 ms: ! 60 / 60.1 ms, 3 of 3 met (fix)
            "#]],
        );
    }

    #[test]
    fn activities_without_a_figure_are_counted_apart() {
        let costs = [("laser", "40"), ("pilot", "20"), ("camera", "1")];
        let deployment = "deployment D { architecture A
            activity camera { priority = 9 affinity = 4 period = 100 }
            activity laser { priority = 9 affinity = 1 period = 50 }
            activity $0pilot { priority = 5 affinity = 1 period = 50 }
        }";
        let fixture = robot(&costs, deployment, "cpus = 3").replace("codel.camera_run = 1\n", "");
        check(
            &fixture,
            expect![[r#"
                Move pilot to CPU 2: ✓ unbounded → 20 / 50 ms, 2 of 2 met, 1 unknown (fix)
                Relax the period of pilot to 100.1 ms: 2 of 2 met, 1 unknown (fix)
            "#]],
        );
    }

    #[test]
    fn while_all_is_well_the_shortest_period_is_offered() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let deployment = "deployment D { architecture A
            activity $0laser { priority = 9 period = 100 }
            activity pilot { priority = 5 period = 200 deadline = 150 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Shorten the period of laser to 47 ms: 2 of 2 met
            "#]],
        );
        let deployment = "deployment D { architecture A
            activity laser { priority = 9 period = 100 }
            activity $0pilot { priority = 5 period = 200 deadline = 150 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Shorten the period of pilot to 150 ms: 2 of 2 met
            "#]],
        );
    }

    #[test]
    fn nothing_is_offered_where_nothing_is_known() {
        let costs = [("laser", "40"), ("pilot", "20")];
        for deployment in [
            "deployment D { architecture A activity $0laser { priority = 9 period = 100 } activity pilot { priority = } }",
            "deployment D { architecture B activity $0laser { priority = 9 period = 100 } }",
            "deployment D { architecture A activity $0 { priority = 9 period = 100 } }",
        ] {
            assert_eq!(offered(&robot(&costs, deployment, "")), [] as [&str; 0], "{deployment}");
        }
    }

    #[test]
    fn a_question_that_is_repeated_is_not_searched_for_again() {
        let costs = [("laser", "40"), ("pilot", "20")];
        let text = robot(
            &costs,
            "deployment D { architecture A activity laser { priority = 9 period = 100 } \
             activity pilot { priority = 5 period = 90 } }\n//- /other.mal\nshell Other { }",
            "",
        );
        let Fixture { mut db, workspace, .. } = Fixture::new(&text);
        // What is kept stays where it is.
        let found = |db: &Database| {
            let project = projects(db, workspace)[0];
            let of = names_of(db, project).anywhere(Kind::Deployment, "D")[0];
            let query = Query::shown(db, project, of);
            let of_row = better_activity(db, project, of, 1, query);
            let of_all = better_priorities(db, project, of, query);
            assert!(!of_all.is_empty() && !of_row.is_empty());
            [of_all.as_ptr(), of_row.as_ptr()]
        };
        let first = found(&db);
        assert_eq!(found(&db), first);
        let other = workspace.file(&db, "/other.mal".as_ref()).unwrap();
        other.set_text(&mut db, "shell Other { /* é */ }".into());
        assert_eq!(found(&db), first);
    }

    #[test]
    fn what_is_said_is_what_comes_out_of_random_deployments() {
        let mut count = 0;
        for seed in 0..1000 {
            let mut random = Random(0x9E37 + seed * 7919);
            let names = ["a", "b", "c", "the_navigation_through_the_house", "e"];
            let tasks = 1 + random.below(names.len());
            let mut costs = Vec::new();
            let mut activities = String::new();
            let cursor = random.below(tasks);
            for (index, name) in names.iter().take(tasks).enumerate() {
                let period = *random.of(&[10, 20, 25, 50, 100]);
                costs.push((*name, format!("{}.{}", random.below(period / 2), random.below(10))));
                let mark = if index == cursor { "$0" } else { "" };
                let _ = write!(
                    activities,
                    "activity {mark}{name} {{ priority = {} period = {period}",
                    1 + random.below(6)
                );
                match random.below(4) {
                    0 => {}
                    1 => activities += &format!(" deadline = {period}"),
                    2 => activities += &format!(" deadline = {}", 1 + random.below(period)),
                    _ => activities += &format!(" deadline = {}", period + 5),
                }
                match random.below(6) {
                    0 => {}
                    1 => activities += " affinity = 3",
                    other => activities += &format!(" affinity = {}", 1 + other % 2),
                }
                activities += " }\n";
            }
            let costs: Vec<(&str, &str)> = costs.iter().map(|(name, cost)| (*name, cost.as_str())).collect();
            let config = random.of(&["", "cpus = 2", "cpus = 3"]);
            let fixture = robot(&costs, &format!("deployment D {{ architecture A\n{activities}}}"), config);
            // To apply them takes long.
            count += titles_at(&fixture, seed < 100).len();
        }
        assert!(count > 1000, "{count}");
    }
}
