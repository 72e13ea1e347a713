//! The search for what is requested: CPUs and priorities first, then periods.

use mauve_hir::{Decl, ModelDb, Project};

use super::conflict::conflict_of;
use super::order::ordered;
use super::periods::with_shortest_periods;
use super::placement::placed;
use super::trials::{Trials, TunePlan};
use super::{SearchKind, TuneAim, TuneRequest, Tuned, Untunable};
use crate::report::Query;
use crate::response::response_times_if;
use crate::variants::Variants;

/// Searches for values of a deployment.
///
/// # Errors
///
/// The activities that are not analysed, whatever their values.
///
/// ```
/// use mauve_hir::{Database, Workspace, names_of, projects, item_tree::Kind};
/// use mauve_wcrt::tune::{TuneAim, TuneRequest, tune};
/// use mauve_wcrt::Query;
///
/// let db = Database::default();
/// let model = "shell S { } codel look(): int codel plan(): int
///     core L(S) { update = { look(); } } core P(S) { update = { plan(); } }
///     component Look(S, L) component Plan(S, P)
///     architecture A { instance eye: Look instance brain: Plan }
///     deployment D { architecture A activity eye { period = 10 } activity brain { period = 50 } }";
/// let files = [
///     ("/m.mal", model),
///     ("/mauve.toml", "timing.tables = [\"t.toml\"]"),
///     ("/t.toml", "codel.look = 4\ncodel.plan = 20"),
/// ];
/// let files = files.map(|(path, text)| (path.into(), text.to_owned()));
/// let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
/// let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
/// let request = TuneRequest {
///     priorities: true,
///     cpus: false,
///     periods: false,
///     aim: TuneAim::Deadlines,
///     pins: Vec::new(),
///     partly: false,
///     most_steps: TuneRequest::STEPS_OF_COMMAND,
/// };
/// let found = tune(&db, project, deployment, Query::shown(&db, project, deployment), &request).unwrap();
/// let fields = found.fields.iter().map(|it| format!("{}: {} = {}", it.instance, it.field.keyword(), it.value));
/// assert_eq!(fields.collect::<Vec<_>>(), ["eye: priority = 2", "brain: priority = 1"]);
/// assert!(found.is_met);
/// ```
pub fn tune<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    request: &TuneRequest,
) -> Result<Tuned, Vec<Untunable<'db>>> {
    let mut trials = Trials::new(Variants::new(db, project, of, query, request.most_steps), request)?;
    trials.request.priorities |= request.aim != TuneAim::Deadlines || trials.lacks_priorities();
    let start = trials.start();
    let found = values(&mut trials, &start);
    let fields = trials.fields(&found.plan);
    let is_met = response_times_if(db, project, of, query, &fields).schedulable();
    let mut tuned = Tuned { fields, is_met, search: found.search, conflict: None, given_up: Vec::new() };
    let is_proof = found.search == SearchKind::Exact && !request.periods;
    if !is_met && is_proof && (trials.request.priorities || trials.request.cpus) {
        trials.refill();
        trials.request.aim = TuneAim::Deadlines;
        tuned.conflict = Some(conflict_of(&trials, &start, &found.suspects));
    }
    if !is_met && request.partly {
        trials.refill();
        trials.request.aim = request.aim;
        if let Some(plan) = given_up(&mut trials, &start, found.plan) {
            tuned.fields = trials.fields(&plan);
            // Of the activities in one thread, each has a deadline.
            let members = || trials.given_up.iter().flat_map(|it| &trials.units[*it].members);
            let instance = |member: &usize| &trials.variants.system.activities[*member].instance;
            let report = response_times_if(db, project, of, query, &tuned.fields);
            let late = report.activities.iter().filter(|it| !it.verdict.is_met()).map(|it| &it.instance);
            tuned.given_up = late.filter(|late| members().any(|it| instance(it) == *late)).cloned().collect();
        }
    }
    Ok(tuned)
}

/// Gives up one deadline after another, of those that `plan` does not meet, until all others are met. None if the budget is exhausted.
fn given_up(trials: &mut Trials<'_>, start: &TunePlan, mut plan: TunePlan) -> Option<TunePlan> {
    loop {
        let trial = trials.analyse(&plan)?;
        if trial.is_met(&plan) {
            return Some(plan);
        }
        let late = (0..trials.units.len()).filter(|unit| trial.slack[*unit] < 0);
        let utilisation = |unit: &usize| trials.units[*unit].utilisation;
        let greatest = late.max_by(|a, b| utilisation(a).total_cmp(&utilisation(b)))?;
        trials.given_up.push(greatest);
        plan = values(trials, start).plan;
    }
}

/// What is found.
struct FoundValues {
    plan: TunePlan,
    search: SearchKind,
    /// The units that cannot be scheduled together.
    suspects: Vec<usize>,
}

fn values(trials: &mut Trials<'_>, start: &TunePlan) -> FoundValues {
    let found = search(trials, start);
    // No priority and no CPU makes an execution shorter: that is a proof, however far the search went.
    match trials.hopeless(start) {
        Some(unit) if found.search != SearchKind::Exact && !trials.request.periods => {
            FoundValues { search: SearchKind::Exact, suspects: vec![unit], ..found }
        }
        _ => found,
    }
}

fn search(trials: &mut Trials<'_>, start: &TunePlan) -> FoundValues {
    let aim = trials.request.aim;
    let free = || start.present().into_iter().filter(|it| !trials.units[*it].is_pinned);
    let mut found =
        FoundValues { plan: start.clone(), search: SearchKind::Exact, suspects: free().collect() };
    if trials.request.cpus {
        if aim == TuneAim::Latency {
            trials.request.aim = TuneAim::Deadlines;
        }
        let Some(placed) = placed(trials, start) else { return found.exhausted() };
        (found.plan, found.search) = (placed.plan, placed.search);
        trials.request.aim = aim;
    }
    if trials.request.priorities && (!trials.request.cpus || aim == TuneAim::Latency) {
        let Some(ordered) = ordered(trials, &found.plan) else { return found.exhausted() };
        (found.plan, found.search) = (ordered.plan, found.search.max(ordered.search));
        // Where response times depend on each other, those for which no priority was left may be no conflict alone.
        if !ordered.stuck.is_empty() && !trials.request.cpus && trials.is_order_free(&found.plan) {
            found.suspects = ordered.stuck;
        }
    }
    if trials.request.periods {
        trials.refill();
        match with_shortest_periods(trials, &found.plan) {
            Some((plan, search)) => (found.plan, found.search) = (plan, found.search.max(search)),
            None if trials.is_spent() => return found.exhausted(),
            None => {}
        }
    }
    found
}

impl FoundValues {
    fn exhausted(self) -> FoundValues {
        FoundValues { search: SearchKind::Exhausted, ..self }
    }
}
