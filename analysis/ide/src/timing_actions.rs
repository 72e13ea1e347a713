//! What else a deployment could be: other priorities, another CPU, another period, each offered with the response times
//! that it gives.
//!
//! Those are no guess: the deployment is analysed with the new values as if they stood in the text (see
//! [`mauve_wcrt::response_times_if`]), and what is not analysed so is not offered. A file may be part of several projects,
//! in which other times count: what is found in one of them is analysed in every one. Nothing is offered with which a
//! deadline is lost that is proved now, in any of them; where they differ, the title says what comes out of each. It says
//! also which warnings there are then that there are not now.
//!
//! | offered | where | if |
//! |---|---|---|
//! | the priorities of two swapped | at an activity | it has a later deadline before it |
//! | the deadline as period | at an activity | it is later than the period |
//! | priorities by deadline | in a deployment | a later deadline goes before an earlier one on the same CPU |
//! | optimal priorities, or why there are none | in a deployment | a deadline is not proved, nor would be by the former |
//! | each other CPU, the best first | at an activity | no deadline is lost that is proved now |
//! | the shortest period found | at an activity | every deadline is proved now, and still would be |
//! | a longer period, the shortest found that helps | at an activity | some deadline is not proved now |
//! | the period as deadline | at an activity | it has an earlier one |

use std::cmp::Reverse;
use std::collections::BTreeSet;

use mauve_diagnostics::{Diagnostic, Finding, cpu_names, diagnostics_if};
use mauve_hir::item_tree::{Expr, Literal, Name};
use mauve_hir::{Decl, ModelDb, Place, Project, declaration_at, deployment};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Level, Status, Time};
use mauve_wcrt::{
    ActivityReport, Deadlines, Priority, Query, Report, Row, SupposedField, System, Verdict, before_its_time,
    response_times, response_times_if, system_of,
};

use crate::Change;
use crate::code_actions::{ActionKind, Actions, CodeAction};
use crate::project::name_of_root;

/// So many activities are analysed in one search, those of each try counted; what takes more is not offered. It is a number
/// of steps and no time, so that the same model has the same offers everywhere. A step of the sample robot, of ten activities,
/// takes 1.2 µs in a release build: the two searches of a question take 5 ms at most in each project, 20 ms in
/// [`MOST_PROJECTS`]; the robot itself needs 0.2 ms.
const MOST_STEPS: usize = 2048;

/// So many other CPUs are offered.
const MOST_MOVES: usize = 4;

/// In so many projects something better is looked for; a deployment is rarely part of more than one.
const MOST_PROJECTS: usize = 4;

/// A period is at most so many times longer than it is now.
const MOST_LONGER: u64 = 64;

/// The greatest number that a field takes, in nanoseconds.
const LONGEST: u64 = i32::MAX as u64 * 1_000_000;

/// Offers what there is at the cursor.
pub(crate) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Rewrite) && !actions.wants(ActionKind::QuickFix) {
        return;
    }
    let Some(node) = actions.node::<ast::Deployment>() else { return };
    let Some(deployment) = deployment_of(actions, node.syntax().text_range().start()) else { return };
    let activity = actions.node::<ast::Activity>();
    let name = activity.as_ref().and_then(|it| it.name_ref()).map(|name| name.syntax().text_range());
    let db = actions.db;
    let projects = actions.projects.clone();
    let mut found: Vec<(&Offer, Vec<Project<'_>>)> = Vec::new();
    for &project in projects.iter().take(MOST_PROJECTS) {
        let (query, rows) = (Query::shown(db, project), &system_of(db, project, deployment).rows);
        let row = name.and_then(|at| rows.iter().position(|row| row.at.range(db) == at));
        let of_row = row.map(|row| offers_of_activity(db, project, deployment, row, query));
        let offers = offers_of_deployment(db, project, deployment, query).iter();
        for offer in offers.chain(of_row.into_iter().flatten()) {
            match found.iter_mut().find(|(known, _)| known.is_same(offer)) {
                Some((_, having)) => having.push(project),
                None => found.push((offer, vec![project])),
            }
        }
    }
    let wrong = activity.map_or_else(Vec::new, |it| wrong_in(actions, it.syntax().text_range()));
    for (offer, having) in found {
        match offer {
            Offer::Refused { title, reason } => {
                let title = match having.len() < projects.len() {
                    true => format!("{title} {}", in_projects(db, &having)),
                    false => title.clone(),
                };
                actions.refuse(ActionKind::Rewrite, title, reason.clone());
            }
            Offer::Proposed { what, fields } => {
                let outcomes: Vec<(Project<'_>, &Outcome<'_>)> = projects
                    .iter()
                    .map(|&project| {
                        let query = Query::shown(db, project);
                        (project, outcome_of(db, project, deployment, query, fields.clone()))
                    })
                    .collect();
                if outcomes.iter().any(|(_, outcome)| outcome.loses) {
                    continue;
                }
                let is_left = |it: &&Finding<'_>| {
                    let what = (it.diagnostic.code.name, it.diagnostic.at.clone());
                    outcomes.iter().any(|(_, outcome)| outcome.wrong.contains(&what))
                };
                let mends: Vec<Finding<'_>> = wrong.iter().filter(|it| !is_left(it)).cloned().collect();
                let action = CodeAction {
                    title: format!("{what}: {}", said(db, &outcomes)),
                    kind: if mends.is_empty() { ActionKind::Rewrite } else { ActionKind::QuickFix },
                    preferred: false,
                    mends,
                    disabled: None,
                    change: None,
                };
                actions.push(action, || change(db, deployment, fields));
            }
        }
    }
}

/// What comes out in all projects, or where they differ, in each.
fn said(db: &dyn ModelDb, outcomes: &[(Project<'_>, &Outcome<'_>)]) -> String {
    let mut said: Vec<(&str, Vec<Project<'_>>)> = Vec::new();
    for (project, outcome) in outcomes {
        match said.iter_mut().find(|(known, _)| *known == outcome.said) {
            Some((_, having)) => having.push(*project),
            None => said.push((&outcome.said, vec![*project])),
        }
    }
    let differ = said.len() > 1;
    let each = said.into_iter().map(|(said, having)| match differ {
        true => format!("{said} {}", in_projects(db, &having)),
        false => said.to_owned(),
    });
    each.collect::<Vec<_>>().join("; ")
}

fn in_projects(db: &dyn ModelDb, projects: &[Project<'_>]) -> String {
    let roots: Vec<String> = projects.iter().map(|&project| name_of_root(db, project)).collect();
    format!("(in the project of {})", roots.join(", "))
}

/// The deployment that begins there.
fn deployment_of<'db>(actions: &Actions<'_, 'db>, start: TextSize) -> Option<Decl<'db>> {
    let found = declaration_at(actions.db, actions.question.file, TextRange::empty(start))?;
    deployment(actions.db, found).map(|_| found)
}

/// What is wrong with the timing of an activity, as it is shown.
fn wrong_in<'db>(actions: &Actions<'_, 'db>, activity: TextRange) -> Vec<Finding<'db>> {
    const CODES: [&str; 4] =
        ["deadline-missed", "priority-inversion", "equal-priorities", "deadline-exceeds-period"];
    if !actions.wants(ActionKind::QuickFix) {
        return Vec::new();
    }
    let is_it = |diagnostic: &Diagnostic<'db>| {
        CODES.contains(&diagnostic.code.name) && activity.contains_range(diagnostic.at.range(actions.db))
    };
    actions.findings().iter().filter(|it| is_it(&it.diagnostic)).cloned().collect()
}

/// Something that is offered.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
enum Offer {
    /// What it is called, and the values.
    Proposed { what: String, fields: Vec<SupposedField> },
    /// What may be expected, and why it cannot be.
    Refused { title: String, reason: String },
}

impl Offer {
    /// Would it do the same?
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Offer::Proposed { fields: one, .. }, Offer::Proposed { fields: other, .. }) => {
                one.len() == other.len() && one.iter().all(|field| other.contains(field))
            }
            (Offer::Refused { .. }, Offer::Refused { .. }) => self == other,
            _ => false,
        }
    }
}

/// What some values give in one project, as far as it is shown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct Outcome<'db> {
    /// In words.
    said: String,
    /// Is a deadline not proved then that is now, or a response time without a bound?
    loses: bool,
    /// What is wrong then.
    wrong: Vec<(&'static str, Place<'db>)>,
}

#[salsa::tracked(returns(ref))]
fn outcome_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    fields: Vec<SupposedField>,
) -> Outcome<'db> {
    let now = response_times(db, project, of, query);
    let then = response_times_if(db, project, of, query, &fields);
    let code = |it: Diagnostic<'db>| (it.code.name, it.at);
    let wrong_now: Vec<_> = diagnostics_if(db, project, of, &[]).into_iter().map(code).collect();
    let mut wrong: Vec<_> = diagnostics_if(db, project, of, &fields).into_iter().map(code).collect();
    let new: BTreeSet<&str> =
        wrong.iter().filter(|it| !wrong_now.contains(it)).map(|(code, _)| *code).collect();
    let mut said = outcome(&then, query.level);
    if !new.is_empty() {
        said += &format!(", with a new warning, {}", new.into_iter().collect::<Vec<_>>().join(", "));
    }
    let late = then.activities.iter().filter(|it| !it.verdict.is_met());
    wrong.extend(late.map(|it| ("deadline-missed", it.row.at.clone())));
    Outcome { said, loses: !is_no_worse(now, &then), wrong }
}

/// Everything that is offered of a deployment as a whole. Editors ask at every movement of the cursor, and again when an
/// action is chosen: the search is made once.
#[salsa::tracked(returns(ref))]
fn offers_of_deployment<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
) -> Vec<Offer> {
    Search::new(db, project, of, query).map_or_else(Vec::new, |mut search| search.priorities())
}

/// Everything that is offered of the activity of that row.
#[salsa::tracked(returns(ref))]
fn offers_of_activity<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    row: usize,
    query: Query,
) -> Vec<Offer> {
    let mut offers = Vec::new();
    let row = system_of(db, project, of).rows.get(row);
    if let Some(row) = row.filter(|row| matches!(row.priority, Priority::RealTime(_)))
        && let Some(mut search) = Search::new(db, project, of, query)
    {
        offers.extend(search.swap(row));
        offers.extend(search.late_deadline(row));
        offers.extend(search.deadline(row));
        offers.extend(search.period(row));
        offers.extend(search.moves(row));
    }
    offers
}

/// The search for something better.
struct Search<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    now: &'db Report<'db>,
    system: &'db System<'db>,
    /// How many more activities may be analysed.
    steps: usize,
}

impl<'db> Search<'db> {
    /// Nothing where a part of the deployment is unknown: so is what another one would give.
    fn new(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, query: Query) -> Option<Search<'db>> {
        let now = response_times(db, project, of, query);
        let system = system_of(db, project, of);
        now.lost.is_empty().then_some(Search { db, project, of, query, now, system, steps: MOST_STEPS })
    }

    /// What these values give; nothing where that would take too many steps. A search that nobody waits for any more ends
    /// at the next of them.
    fn ask(&mut self, fields: &[SupposedField]) -> Option<Report<'db>> {
        self.steps = self.steps.checked_sub(self.system.rows.len().max(1))?;
        self.db.unwind_if_revision_cancelled();
        Some(response_times_if(self.db, self.project, self.of, self.query, fields))
    }

    /// The priorities of an activity and of the least urgent that goes before it although it may end later.
    fn swap(&mut self, row: &Row<'db>) -> Option<Offer> {
        let other = before_its_time(&self.system.rows, row)?;
        let fields = vec![priority_of(row, priority(other)), priority_of(other, priority(row))];
        Some(proposed(&format!("Swap the priorities of {} and {}", row.instance, other.instance), fields))
    }

    /// A deadline that is later than the period, as the period.
    fn late_deadline(&mut self, row: &Row<'db>) -> Option<Offer> {
        let data = deployment(self.db, self.of).filter(|_| row.is_late)?;
        let activity = data.activities.iter().find(|it| it.instance.name == row.instance)?;
        let deadline = activity.fields.iter().find(|field| field.name.name == "deadline")?;
        let Expr::Literal(Literal::Int(text) | Literal::Float(text), _) = &deadline.value else {
            return None;
        };
        let fields = vec![field(row, "period", text.to_string())];
        Some(proposed(&format!("Period {text} ms, as the deadline"), fields))
    }

    /// Other priorities.
    fn priorities(&mut self) -> Vec<Offer> {
        let Some(groups) = groups(self.system) else { return Vec::new() };
        let mut offers = Vec::new();
        let ordered: Vec<SupposedField> =
            groups.iter().filter(|group| !group.is_by_deadline()).flat_map(Group::by_deadline).collect();
        let mut is_solved = is_proved(self.now);
        if !ordered.is_empty()
            && let Some(report) = self.ask(&ordered)
        {
            is_solved |= is_proved(&report);
            let what = "Priorities by deadline (deadline-monotonic)";
            offers.push(proposed(what, ordered));
        }
        let is_analysed = |it: &ActivityReport<'_>| it.verdict != Verdict::RealTime(Status::NotAnalysed);
        if !is_solved && self.now.activities.iter().all(is_analysed) {
            offers.extend(self.optimal(&groups));
        }
        offers
    }

    /// The priorities with which every deadline is proved, if there are any: from the least urgent up, whoever meets its
    /// deadline below all that are left is given the place (Audsley). That finds them where they are, since a response
    /// time depends on which activities are more urgent, and not on their order.
    fn optimal(&mut self, groups: &[Group<'_, 'db>]) -> Option<Offer> {
        let what = "Optimal priorities (Audsley's)";
        let mut fields = Vec::new();
        for group in groups {
            match self.optimal_of(group)? {
                Ok(found) => fields.extend(found),
                Err(names) => {
                    let reason = format!(
                        "no order of priorities is found with which every deadline is proved: below the others, none of {} \
                         would meet its own",
                        names.join(", ")
                    );
                    return Some(Offer::Refused { title: what.to_owned(), reason });
                }
            }
        }
        self.ask(&fields).filter(is_proved)?;
        Some(proposed(what, fields))
    }

    /// The priorities of a group, or those of it that cannot be ordered.
    fn optimal_of(&mut self, group: &Group<'_, 'db>) -> Option<Result<Vec<SupposedField>, Vec<String>>> {
        let mut numbers = group.numbers.clone();
        // Those with the latest deadlines last, so that they are tried first.
        let mut left: Vec<&Row<'db>> = group.in_order();
        let mut fields: Vec<SupposedField> = Vec::new();
        while let Some(number) = numbers.pop() {
            let greatest = *numbers.first().unwrap_or(&number);
            let mut chosen = None;
            for index in (0..left.len()).rev() {
                let mut supposed = fields.clone();
                supposed.extend(
                    left.iter()
                        .enumerate()
                        .map(|(other, row)| priority_of(row, if other == index { number } else { greatest })),
                );
                let report = self.ask(&supposed)?;
                let row = left.get(index)?;
                let is_it = |it: &&ActivityReport<'_>| it.row.instance == row.instance;
                if report.activities.iter().find(is_it).is_some_and(|it| it.verdict.is_met()) {
                    chosen = Some(index);
                    break;
                }
            }
            let Some(index) = chosen else {
                return Some(Err(left.iter().map(|row| row.instance.to_string()).collect()));
            };
            fields.push(priority_of(left.remove(index), number));
        }
        Some(Ok(fields))
    }

    /// The other CPUs on which nothing becomes worse, the best first.
    fn moves(&mut self, row: &Row<'db>) -> Vec<Offer> {
        let mut found = Vec::new();
        for cpu in (0..64).map(|bit| 1_u64 << bit).filter(|cpu| self.system.cpus & cpu != 0) {
            if row.cpus == Some(cpu) {
                continue;
            }
            let fields = vec![field(row, "affinity", cpu.to_string())];
            let Some(report) = self.ask(&fields) else { break };
            let is_analysed = report.activities.iter().any(|it| {
                it.row.instance == row.instance && it.verdict != Verdict::RealTime(Status::NotAnalysed)
            });
            if is_analysed && is_no_worse(self.now, &report) {
                let offer = proposed(&format!("Move to {}", cpu_names(cpu)), fields);
                found.push((offer, report));
            }
        }
        let slack = |report: &Report<'_>| least_slack(report).map(|(slack, _)| slack);
        found.sort_by_key(|(_, report)| Reverse((report.deadlines().met, slack(report))));
        found.into_iter().map(|(offer, _)| offer).take(MOST_MOVES).collect()
    }

    /// The shortest period while all is well; the least longer one that helps otherwise.
    fn period(&mut self, row: &Row<'db>) -> Option<Offer> {
        let period = row.period?.as_nanos();
        // The greatest power of ten that is a hundredth of it at most, up to a millisecond.
        let mut step = 1_000_000;
        while step > 1 && step > period / 100 {
            step /= 10;
        }
        let fields = |search: &Self, number: u64| search.with_period(row, Time::from_nanos(number * step));
        let now = period / step;
        if is_proved(self.now) {
            let greatest = if now * step == period { now.checked_sub(1)? } else { now };
            let report = self.ask(&fields(self, greatest)).filter(|it| greatest > 0 && is_proved(it))?;
            let (number, _) = self.least(0, (greatest, report), &fields, &is_proved)?;
            return Some(self.with(row, "Shorter", number * step, step));
        }
        let is_row_met = |report: &Report<'db>| {
            report.activities.iter().any(|it| it.row.instance == row.instance && it.verdict.is_met())
        };
        let is_met_now = is_row_met(self.now);
        let goals: [&dyn Fn(&Report<'db>) -> bool; 2] = [&is_proved, &is_row_met];
        for goal in goals.into_iter().take(if is_met_now { 1 } else { 2 }) {
            let mut bad = now;
            let mut factor = 2;
            while factor <= MOST_LONGER {
                let number = now.checked_mul(factor).filter(|number| number.saturating_mul(step) <= LONGEST);
                let Some(number) = number else { break };
                let report = self.ask(&fields(self, number))?;
                if goal(&report) {
                    let (number, _) = self.least(bad, (number, report), &fields, goal)?;
                    return Some(self.with(row, "Longer", number * step, step));
                }
                bad = number;
                factor *= 2;
            }
        }
        None
    }

    /// A number above `bad` with which the goal is reached, and with one less it is not; `good` is one with which it is. Where
    /// the goal is not lost and reached again in between, it is the least.
    fn least(
        &mut self,
        mut bad: u64,
        mut good: (u64, Report<'db>),
        fields: &dyn Fn(&Self, u64) -> Vec<SupposedField>,
        goal: &dyn Fn(&Report<'db>) -> bool,
    ) -> Option<(u64, Report<'db>)> {
        while good.0 - bad > 1 {
            let middle = bad + (good.0 - bad) / 2;
            let report = self.ask(&fields(self, middle))?;
            if goal(&report) {
                good = (middle, report);
            } else {
                bad = middle;
            }
        }
        Some(good)
    }

    fn with(&self, row: &Row<'db>, which: &str, period: u64, step: u64) -> Offer {
        let (period, step) = (Time::from_nanos(period), Time::from_nanos(step));
        let fields = self.with_period(row, period);
        let and = if fields.len() > 1 { " and deadline" } else { "" };
        // The search halves an interval: it knows that one step less is too short, and nothing of what is shorter still.
        let what = format!("{which} period{and}, {period} (the shortest found, in steps of {step})");
        proposed(&what, fields)
    }

    /// A period, and the deadline with it where it is written and is the period now, or would be later.
    fn with_period(&self, row: &Row<'db>, period: Time) -> Vec<SupposedField> {
        let mut fields = vec![field(row, "period", period.number())];
        let is_written = deployment(self.db, self.of)
            .and_then(|data| data.activities.iter().find(|it| it.instance.name == row.instance))
            .is_some_and(|it| it.fields.iter().any(|field| field.name.name == "deadline"));
        if is_written && (row.deadline == row.period || row.deadline > Some(period)) {
            fields.push(field(row, "deadline", period.number()));
        }
        fields
    }

    /// The latest deadline that there is.
    fn deadline(&mut self, row: &Row<'db>) -> Option<Offer> {
        let period = row.period.filter(|period| row.deadline < Some(*period))?;
        let fields = vec![field(row, "deadline", period.number())];
        Some(proposed(&format!("Deadline {period}, as the period"), fields))
    }
}

fn proposed(what: &str, fields: Vec<SupposedField>) -> Offer {
    Offer::Proposed { what: what.to_owned(), fields }
}

/// Activities that may delay each other, and the priorities that they have among them.
struct Group<'a, 'db> {
    cpus: u64,
    rows: Vec<&'a Row<'db>>,
    /// As many as rows, from the greatest down, no two alike.
    numbers: Vec<u32>,
}

/// The real-time activities by the CPUs that they share; none where the priority, the CPU or the deadline of one is not
/// known, or there are more of them than priorities.
fn groups<'a, 'db>(system: &'a System<'db>) -> Option<Vec<Group<'a, 'db>>> {
    let mut groups: Vec<Group<'a, 'db>> = Vec::new();
    for row in system.rows.iter().filter(|row| row.priority != Priority::Background) {
        let cpus = row.cpus.filter(|_| row.priority != Priority::Unknown && row.deadline.is_some())?;
        let (linked, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| group.cpus & cpus != 0);
        groups = apart;
        let mut joined = Group { cpus, rows: Vec::new(), numbers: Vec::new() };
        for group in linked {
            joined.cpus |= group.cpus;
            joined.rows.extend(group.rows);
        }
        joined.rows.push(row);
        groups.push(joined);
    }
    for group in &mut groups {
        let own: BTreeSet<u32> = group.rows.iter().map(|row| priority(row)).collect();
        let count = u32::try_from(group.rows.len()).ok().filter(|count| *count <= 99)?;
        group.numbers = if own.len() == group.rows.len() {
            own.into_iter().rev().collect()
        } else {
            (1..=count).rev().collect()
        };
    }
    Some(groups)
}

impl<'a, 'db> Group<'a, 'db> {
    /// By deadline; those that have the same stay as they are.
    fn in_order(&self) -> Vec<&'a Row<'db>> {
        let mut rows = self.rows.clone();
        rows.sort_by_key(|row| (row.deadline, Reverse(priority(row))));
        rows
    }

    /// Does the priority fall from each to the next, in the order of the deadlines?
    fn is_by_deadline(&self) -> bool {
        let rows = self.in_order();
        rows.windows(2).all(|pair| matches!(pair, [one, other] if priority(one) > priority(other)))
    }

    fn by_deadline(&self) -> Vec<SupposedField> {
        let rows = self.in_order();
        let changed = rows.iter().zip(&self.numbers).filter(|(row, number)| priority(row) != **number);
        changed.map(|(row, &number)| priority_of(row, number)).collect()
    }
}

fn priority(row: &Row<'_>) -> u32 {
    if let Priority::RealTime(priority) = row.priority { priority } else { 0 }
}

fn priority_of(row: &Row<'_>, number: u32) -> SupposedField {
    field(row, "priority", number.to_string())
}

fn field(row: &Row<'_>, field: &'static str, value: String) -> SupposedField {
    SupposedField { instance: row.instance.clone(), field, value: value.into() }
}

fn is_proved(report: &Report<'_>) -> bool {
    report.schedulable()
}

/// Is every deadline proved that is now, and is there a bound of all of which there is one?
fn is_no_worse(now: &Report<'_>, then: &Report<'_>) -> bool {
    now.activities.len() == then.activities.len()
        && now.activities.iter().zip(&then.activities).all(|(now, then)| {
            now.row.instance == then.row.instance
                && (!now.verdict.is_met() || then.verdict.is_met())
                && (now.response.is_none() || then.response.is_some())
        })
}

/// The time that is left in the worst case to the one that has the least.
fn least_slack<'a>(report: &'a Report<'_>) -> Option<(Time, &'a Name)> {
    let slack =
        |it: &'a ActivityReport<'_>| Some((it.row.deadline?.checked_sub(it.response?)?, &it.row.instance));
    report.activities.iter().filter_map(slack).min_by_key(|(slack, _)| *slack)
}

/// What a deployment gives, in a few words.
fn outcome(report: &Report<'_>, level: Level) -> String {
    const SHOWN: usize = 2;
    let Deadlines { met, all, .. } = report.deadlines();
    let assumed =
        if report.activities.iter().any(|it| !it.assumed.is_empty()) { ", times assumed" } else { "" };
    if met == all
        && let Some((slack, name)) = least_slack(report)
    {
        return match all {
            1 => format!("{name} meets its deadline at {level}, slack {slack}{assumed}"),
            _ => format!("all {all} meet their deadlines at {level}, worst slack {slack} ({name}){assumed}"),
        };
    }
    let failing = report.activities.iter().filter(|it| !it.verdict.is_met());
    let said: Vec<String> = failing
        .map(|it| {
            let name = &it.row.instance;
            match (it.verdict, it.response, it.row.deadline) {
                (Verdict::RealTime(Status::Missed), Some(response), Some(deadline)) => {
                    format!("{name} R {response} > {deadline}")
                }
                (Verdict::RealTime(Status::NotAnalysed), ..) => format!("{name} not analysed"),
                (Verdict::RealTime(Status::Unbounded), ..) => format!("{name} unbounded"),
                _ => format!("{name} no bound"),
            }
        })
        .collect();
    let more = match said.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        Some(more) => format!(" and {more} more"),
        None => String::new(),
    };
    let shown: Vec<&str> = said.iter().map(String::as_str).take(SHOWN).collect();
    format!("{}{more} ({met} of {all} deadlines met at {level}{assumed})", shown.join(", "))
}

/// What writes these values into the text.
fn change(db: &dyn ModelDb, of: Decl<'_>, fields: &[SupposedField]) -> Change {
    let mut change = Change::default();
    let Some(data) = deployment(db, of) else { return change };
    let place = |part| Place::Part(of, part);
    for SupposedField { instance, field, value } in fields {
        let Some(activity) = data.activities.iter().find(|it| it.instance.name == *instance) else {
            continue;
        };
        if let Some(known) = activity.fields.iter().find(|it| it.name.name == *field) {
            let at = place(known.value_part);
            change.replace(at.file(db), Replacement { range: at.range(db), text: value.to_string() });
        } else if let Some(last) = activity.fields.last() {
            let (name, end) = (place(last.name.part), place(last.value_part).range(db).end());
            let file = name.file(db);
            let before = indentation(file.text(db), name.range(db).start());
            let text = format!("{before}{field} = {value}");
            change.replace(file, Replacement { range: TextRange::empty(end), text });
        }
    }
    change
}

/// What stands between two fields: where the one that begins at `offset` has a line of its own, so has the next.
fn indentation(text: &str, offset: TextSize) -> String {
    let before = text.get(..usize::from(offset)).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_alone = line.len() < before.len() && line.trim().is_empty();
    if is_alone { format!("\n{line}") } else { " ".to_owned() }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::PathBuf;

    use super::*;
    use crate::fixture::Fixture;
    use crate::{ActionQuestion, Changes, code_actions};
    use expect_test::{Expect, expect};
    use mauve_diagnostics::workspace_diagnostics;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_tests::Random;
    use salsa::Setter as _;

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

    /// What matters of a report, wherever it stands.
    fn figures(report: &Report<'_>) -> String {
        let mut out = format!("{:?}\n", report.cpus);
        for it in &report.activities {
            let Row { instance, priority, cpus, period, deadline, .. } = &it.row;
            let row = (instance, priority, cpus, period, deadline);
            let _ = writeln!(
                out,
                "{row:?} {:?} {:?} {:?} {:?} {:?} {:?}",
                it.own, it.first_job, it.response, it.verdict, it.window, it.interference
            );
        }
        out
    }

    fn codes(db: &Database, workspace: Workspace) -> Vec<&'static str> {
        workspace_diagnostics(db, workspace).iter().map(|it| it.diagnostic.code.name).collect()
    }

    /// Every offer at the cursor, each applied to the text and analysed anew: it gives what was said.
    fn offered(fixture: &str) -> Vec<String> {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let rows = &system_of(&db, project, deployment).rows;
        let row = rows.iter().position(|row| row.at.range(&db).contains_inclusive(offset));
        let query = Query::shown(&db, project);
        let mut offers = offers_of_deployment(&db, project, deployment, query).clone();
        let of_row = row.map(|row| offers_of_activity(&db, project, deployment, row, query));
        offers.extend(of_row.into_iter().flatten().cloned());
        let question = ActionQuestion {
            file,
            range: TextRange::empty(offset),
            diagnostics: &[],
            kinds: &[ActionKind::Rewrite, ActionKind::QuickFix],
            changes: Changes::All,
        };
        let actions = code_actions(&db, &[workspace], question);
        let met =
            |report: &Report<'_>| report.activities.iter().map(|it| it.verdict.is_met()).collect::<Vec<_>>();
        let is_no_worse_than =
            |now: &[bool], then: &[bool]| now.iter().zip(then).all(|(now, then)| !now || *then);
        let now = met(response_times(&db, project, deployment, query));
        let before = codes(&db, workspace);
        let mut said = Vec::new();
        for offer in offers.clone() {
            let Offer::Proposed { what, fields } = &offer else {
                let Offer::Refused { title, reason } = offer else { continue };
                assert!(actions.iter().any(|action| action.title == title), "{title}");
                said.push(format!("{title} ✗ {reason}"));
                continue;
            };
            let outcome_now = outcome_of(&db, project, deployment, query, fields.clone());
            let title = format!("{what}: {}", outcome_now.said);
            let Some(action) = actions.iter().find(|action| action.title == title) else {
                // Two may do the same, and some would cost a deadline.
                let is_twin = |it: &&Offer| it.is_same(&offer);
                assert!(outcome_now.loses || offers.iter().filter(is_twin).count() > 1, "{title}\n{fixture}");
                continue;
            };
            let report = response_times_if(&db, project, deployment, query, fields);
            let change = action.change.as_ref().unwrap();
            let texts =
                workspace.files(&db).iter().map(|(path, file)| (path.clone(), change.applied(&db, *file)));
            let texts: Vec<(PathBuf, String)> = texts.collect();
            let new = Database::default();
            let workspace = Workspace::of_texts(&new, "/".into(), texts);
            let project = projects(&new, workspace)[0];
            let deployment = names_of(&new, project).anywhere(Kind::Deployment, "D")[0];
            let query = Query::shown(&new, project);
            let applied = response_times(&new, project, deployment, query);
            assert_eq!(figures(applied), figures(&report), "{title}\n{fixture}");
            assert!(title.contains(&outcome(applied, query.level)), "{title}\n{fixture}");
            // No deadline is lost, and no warning comes unsaid.
            assert!(is_no_worse_than(&now, &met(applied)), "{title}\n{fixture}");
            let after = codes(&new, workspace);
            for code in ["priority-inversion", "equal-priorities", "stale-data", "deadline-exceeds-period"] {
                let is_new = after.iter().filter(|it| **it == code).count()
                    > before.iter().filter(|it| **it == code).count();
                assert!(!is_new || title.contains(code), "{code}: {title}\n{fixture}");
            }
            let kind = if action.kind == ActionKind::QuickFix { " (mends)" } else { "" };
            said.push(format!("{title}{kind}"));
        }
        said
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
                Priorities by deadline (deadline-monotonic): all 2 meet their deadlines at 1e-4, worst slack 20 ms (laser)
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
        // With the most urgent below, b would miss its deadline: 30 > 20.
        check(
            &at("c"),
            expect![[r#"
            Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b) (mends)
            Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (b) (mends)
            Shorter period and deadline, 35 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (c)
        "#]],
        );
        check(
            &at("b"),
            expect![[r#"
            Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b) (mends)
            Swap the priorities of b and a: all 3 meet their deadlines at 1e-4, worst slack 5 ms (c) (mends)
            Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (c) (mends)
            Shorter period, 35 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 5 ms (b)
        "#]],
        );
        check(
            &at("a"),
            expect![[r#"
            Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 10 ms (b)
            Deadline 100 ms, as the period: all 3 meet their deadlines at 1e-4, worst slack 5 ms (b)
            Shorter period and deadline, 20 ms (the shortest found, in steps of 1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (c)
        "#]],
        );
    }

    #[test]
    fn a_deadline_later_than_the_period_may_be_the_period() {
        let deployment = "deployment D { architecture A
            activity $0laser { priority = 2 period = 50 deadline = 80 }
            activity pilot { priority = 1 period = 200 deadline = 150 }
        }";
        check(
            &robot(&[("laser", "40"), ("pilot", "30")], deployment, ""),
            expect![[r#"
            Period 80 ms, as the deadline: all 2 meet their deadlines at 1e-4, worst slack 40 ms (laser) (mends)
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
        let actions = code_actions(&db, &[workspace], question);
        let titles = actions.into_iter().map(|action| action.title).filter(|title| title.contains("1e-4"));
        titles.map(|title| title + "\n").collect()
    }

    #[test]
    fn what_is_offered_is_known_of_every_project_that_has_the_file() {
        let deployment = "deployment D { architecture A
            activity $0laser { affinity = 1 priority = 2 period = 100 }
            activity pilot { affinity = 2 priority = 1 period = 100 } }";
        // On one CPU, the two of the second project ask for more than it has; 10 ms are too short in it.
        expect![[r#"
            Shorter period, 60 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 50 ms (laser) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 0 ms (laser) (in the project of two.mal)
        "#]].assert_eq(&offered_in_two(deployment, ["short", "short"], ["long", "long"]));
        let alike = offered_in_two(deployment, ["short", "long"], ["short", "long"]);
        assert!(alike.contains("Move to CPU 2") && !alike.contains("in the project"), "{alike}");
        // What is missed in one of them may be mended where nothing is lost in the other.
        let deployment = "deployment D { architecture A
            activity laser { affinity = 1 priority = 2 period = 100 }
            activity $0pilot { affinity = 1 priority = 1 period = 100 deadline = 50 } }";
        expect![[r#"
            Priorities by deadline (deadline-monotonic): all 2 meet their deadlines at 1e-4, worst slack 40 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 30 ms (laser) (in the project of two.mal)
            Deadline 100 ms, as the period: all 2 meet their deadlines at 1e-4, worst slack 80 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 30 ms (pilot) (in the project of two.mal)
            Move to CPU 2: all 2 meet their deadlines at 1e-4, worst slack 40 ms (pilot) (in the project of one.mal); all 2 meet their deadlines at 1e-4, worst slack 40 ms (laser) (in the project of two.mal)
        "#]].assert_eq(&offered_in_two(deployment, ["short", "short"], ["long", "short"]));
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
                Optimal priorities (Audsley's) ✗ no order of priorities is found with which every deadline is proved: below the others, none of arm, laser, pilot would meet its own
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
            Priorities by deadline (deadline-monotonic): all 3 meet their deadlines at 1e-4, worst slack 20 ms (laser) (mends)
            Longer period and deadline, 60 ms (the shortest found, in steps of 0.1 ms): all 3 meet their deadlines at 1e-4, worst slack 0 ms (pilot) (mends)
            Move to CPU 3: all 3 meet their deadlines at 1e-4, worst slack 30 ms (arm) (mends)
            Move to CPU 2: all 3 meet their deadlines at 1e-4, worst slack 0 ms (pilot) (mends)
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
            Shorter period, 47 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 7 ms (laser)
        "#]],
        );
        let deployment = "deployment D { architecture A
            activity laser { priority = 9 period = 100 }
            activity $0pilot { priority = 5 period = 200 deadline = 150 }
        }";
        check(
            &robot(&costs, deployment, ""),
            expect![[r#"
                Deadline 200 ms, as the period: all 2 meet their deadlines at 1e-4, worst slack 60 ms (laser)
                Shorter period and deadline, 60 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 0 ms (pilot), with a new warning, priority-inversion
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
    fn a_field_that_is_left_out_is_written_behind_the_last() {
        let text = "deployment D { architecture A activity a { priority = 1\n  period = 100 /* é */\n} }";
        assert_eq!(indentation(text, TextSize::new(text.find("period").unwrap() as u32)), "\n  ");
        assert_eq!(indentation(text, TextSize::new(text.find("priority").unwrap() as u32)), " ");
    }

    #[test]
    fn the_order_that_is_found_proves_what_can_be_proved() {
        // From the worst order; without the offer by deadline, which would give it too.
        let costs = [("a", "3"), ("b", "6"), ("c", "14")];
        let text = robot(
            &costs,
            "deployment D { architecture A activity a { priority = 1 period = 10 } activity b { priority = 2 period = 20 } \
             activity c { priority = 3 period = 50 } }",
            "",
        );
        let Fixture { db, workspace, .. } = Fixture::new(&text);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let mut search = Search::new(&db, project, of, Query::shown(&db, project)).unwrap();
        let (now, system) = (search.now, search.system);
        assert!(!is_proved(now));
        let offer = search.optimal(&groups(system).unwrap()).unwrap();
        let Offer::Proposed { what, fields } = offer else { panic!("refused") };
        assert_eq!(
            format!("{what}: {}", outcome_of(&db, project, of, Query::shown(&db, project), fields).said),
            "Optimal priorities (Audsley's): all 3 meet their deadlines at 1e-4, worst slack 7 ms (a)"
        );
        // Too many steps: nothing rather than half an answer.
        search.steps = 3;
        assert!(search.optimal(&groups(system).unwrap()).is_none());
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
            let query = Query::shown(db, project);
            let of_row = offers_of_activity(db, project, of, 1, query);
            let of_all = offers_of_deployment(db, project, of, query);
            assert!(!of_all.is_empty() && !of_row.is_empty());
            [of_all.as_ptr(), of_row.as_ptr()]
        };
        let first = found(&db);
        assert_eq!(found(&db), first);
        let other = workspace.file(&db, "/other.mal".as_ref()).unwrap();
        other.set_text(&mut db).to("shell Other { /* é */ }".into());
        assert_eq!(found(&db), first);
    }

    #[test]
    fn what_is_said_is_what_comes_out_of_random_deployments() {
        let mut count = 0;
        for seed in 0..60 {
            let mut random = Random(0x9E37 + seed * 7919);
            let names = ["a", "b", "c", "d", "e"];
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
            count += offered(&fixture).len();
        }
        assert!(count > 100, "{count}");
    }
}
