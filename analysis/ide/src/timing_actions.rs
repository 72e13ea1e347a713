//! What else a deployment could be: other priorities, another CPU, another period, each offered with the response times
//! that it gives.
//!
//! Those are no guess: the deployment is analysed with the new values as if they stood in the text (see
//! [`mauve_model::response_times_if`]), and what is not analysed so is not offered.
//!
//! | offered | where | if |
//! |---|---|---|
//! | priorities by deadline | in a deployment | a later deadline goes before an earlier one on the same CPU |
//! | optimal priorities, or why there are none | in a deployment | a deadline is not proved, nor would be by the former |
//! | each other CPU, the best first | at an activity | no deadline is lost that is proved now |
//! | the shortest period found | at an activity | every deadline is proved now, and still would be |
//! | a longer period, the shortest found that helps | at an activity | some deadline is not proved now |
//! | the period as deadline | at an activity | it has an earlier one |

use std::cmp::Reverse;
use std::collections::BTreeSet;

use mauve_model::diagnostics::{Finding, diagnostics_of_file};
use mauve_model::item_tree::{Kind, Name};
use mauve_model::{
    ActivityReport, Deadlines, Decl, ModelDb, Place, Priority, Project, Query, Report, Row, SupposedField,
    System, Verdict, cpu_names, declarations, deployment, response_times, response_times_if, source_map,
    system_of,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Level, Status, Time};

use crate::Change;
use crate::code_actions::{ActionKind, Actions, CodeAction};
use crate::project::name_of_root;

/// So many activities are analysed for one question, those of each try counted; what takes more is not offered. It is a
/// number of steps and no time, so that the same model has the same offers everywhere.
const MOST_STEPS: usize = 4096;

/// So many other CPUs are offered.
const MOST_MOVES: usize = 4;

/// So many projects are asked; a deployment is rarely part of more than one.
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
    let activity = actions.node::<ast::Activity>().and_then(|it| it.name_ref());
    let activity = activity.map(|name| name.syntax().text_range());
    let db = actions.db;
    let projects: Vec<Project<'_>> = actions.projects.iter().copied().take(MOST_PROJECTS).collect();
    let mut found: Vec<(&Offer, Vec<Project<'_>>)> = Vec::new();
    let mut mended: Vec<&Offer> = Vec::new();
    for &project in &projects {
        let (query, rows) = (Query::shown(db, project), &system_of(db, project, deployment).rows);
        let row = activity.and_then(|at| rows.iter().position(|row| row.at.range(db) == at));
        let of_row = row.map(|row| offers_of_activity(db, project, deployment, row, query));
        let offers = offers_of_deployment(db, project, deployment, query).iter();
        for offer in offers.chain(of_row.into_iter().flatten()) {
            if row.is_some_and(|row| offer.meets(row)) {
                mended.push(offer);
            }
            match found.iter_mut().find(|(known, _)| known.is_same(offer)) {
                Some((_, having)) => having.push(project),
                None => found.push((offer, vec![project])),
            }
        }
    }
    let missed = activity.map_or_else(Vec::new, |activity| missed_at(actions, activity));
    for (offer, having) in found {
        let mut title = offer.title().to_owned();
        if having.len() < actions.projects.len() {
            let roots: Vec<String> = having.iter().map(|&project| name_of_root(db, project)).collect();
            title += &format!(" (in the project of {})", roots.join(", "));
        }
        match offer {
            Offer::Refused { reason, .. } => actions.refuse(ActionKind::Rewrite, title, reason.clone()),
            Offer::Proposed { fields, .. } => {
                let is_mended = !missed.is_empty() && mended.iter().any(|it| std::ptr::eq(*it, offer));
                let action = CodeAction {
                    title,
                    kind: if is_mended { ActionKind::QuickFix } else { ActionKind::Rewrite },
                    preferred: false,
                    mends: if is_mended { missed.clone() } else { Vec::new() },
                    disabled: None,
                    change: None,
                };
                actions.push(action, || change(db, deployment, fields));
            }
        }
    }
}

/// The deployment that begins there.
fn deployment_of<'db>(actions: &Actions<'_, 'db>, start: TextSize) -> Option<Decl<'db>> {
    let (db, file) = (actions.db, actions.question.file);
    let mut all = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
    let is_it = |decl: Decl<'db>, of: TextRange| {
        decl.kind(db) == Kind::Deployment && of.contains(start) && deployment(db, decl).is_some()
    };
    all.find(|(decl, map)| is_it(**decl, map.range)).map(|(decl, _)| *decl)
}

/// The deadlines that are missed at an activity, as they are shown.
fn missed_at<'db>(actions: &Actions<'_, 'db>, activity: TextRange) -> Vec<Finding<'db>> {
    let (db, file) = (actions.db, actions.question.file);
    if !actions.wants(ActionKind::QuickFix) {
        return Vec::new();
    }
    let mut missed: Vec<Finding<'db>> = Vec::new();
    for &workspace in actions.workspaces {
        for finding in diagnostics_of_file(db, workspace, file) {
            let diagnostic = &finding.diagnostic;
            if diagnostic.code.name == "deadline-missed"
                && diagnostic.at.range(db) == activity
                && !missed.iter().any(|it| it.diagnostic == *diagnostic)
            {
                missed.push(finding);
            }
        }
    }
    missed
}

/// Something that is offered. What would come out is kept as far as it is shown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
enum Offer {
    /// What it is called with what it gives, the values, and which activities meet their deadlines then, by their rows.
    Proposed { title: String, fields: Vec<SupposedField>, met: Vec<bool> },
    /// What may be expected, and why it cannot be.
    Refused { title: String, reason: String },
}

impl Offer {
    /// Would the user not see a difference?
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Offer::Proposed { fields: one, .. }, Offer::Proposed { fields: other_fields, .. }) => {
                one == other_fields && self.title() == other.title()
            }
            (Offer::Refused { .. }, Offer::Refused { .. }) => self == other,
            _ => false,
        }
    }

    fn title(&self) -> &str {
        match self {
            Offer::Proposed { title, .. } | Offer::Refused { title, .. } => title,
        }
    }

    /// Does the activity of that row meet its deadline then?
    fn meets(&self, row: usize) -> bool {
        matches!(self, Offer::Proposed { met, .. } if met.get(row) == Some(&true))
    }
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

    fn proposed(&self, what: &str, fields: Vec<SupposedField>, report: &Report<'db>) -> Offer {
        let title = format!("{what}: {}", outcome(report, self.query.level));
        let is_met = |it: &ActivityReport<'_>| it.verdict == Verdict::RealTime(Status::Met);
        Offer::Proposed { title, fields, met: report.activities.iter().map(is_met).collect() }
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
            offers.push(self.proposed(what, ordered, &report));
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
        let report = self.ask(&fields).filter(is_proved)?;
        Some(self.proposed(what, fields, &report))
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
                let offer = self.proposed(&format!("Move to {}", cpu_names(cpu)), fields, &report);
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
            let (number, report) = self.least(0, (greatest, report), &fields, &is_proved)?;
            return Some(self.with(row, "Shorter", number * step, step, report));
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
                    let (number, report) = self.least(bad, (number, report), &fields, goal)?;
                    return Some(self.with(row, "Longer", number * step, step, report));
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

    fn with(&self, row: &Row<'db>, which: &str, period: u64, step: u64, report: Report<'db>) -> Offer {
        let (period, step) = (Time::from_nanos(period), Time::from_nanos(step));
        let fields = self.with_period(row, period);
        let and = if fields.len() > 1 { " and deadline" } else { "" };
        // The search halves an interval: it knows that one step less is too short, and nothing of what is shorter still.
        let what = format!("{which} period{and}, {period} (the shortest found, in steps of {step})");
        self.proposed(&what, fields, &report)
    }

    /// A period, and the deadline with it where it is written and is the period now, or would be later.
    fn with_period(&self, row: &Row<'db>, period: Time) -> Vec<SupposedField> {
        let mut fields = vec![field(row, "period", written(period))];
        let is_written = deployment(self.db, self.of)
            .and_then(|data| data.activities.iter().find(|it| it.instance.name == row.instance))
            .is_some_and(|it| it.fields.iter().any(|field| field.name.name == "deadline"));
        if is_written && (row.deadline == row.period || row.deadline > Some(period)) {
            fields.push(field(row, "deadline", written(period)));
        }
        fields
    }

    /// The latest deadline that there is.
    fn deadline(&mut self, row: &Row<'db>) -> Option<Offer> {
        let period = row.period.filter(|period| row.deadline < Some(*period))?;
        let fields = vec![field(row, "deadline", written(period))];
        let report = self.ask(&fields)?;
        Some(self.proposed(&format!("Deadline {period}, as the period"), fields, &report))
    }
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

/// A time as a field has it.
fn written(time: Time) -> String {
    time.to_string().trim_end_matches(" ms").to_owned()
}

fn is_proved(report: &Report<'_>) -> bool {
    report.schedulable()
}

/// Is every deadline proved that is now?
fn is_no_worse(now: &Report<'_>, then: &Report<'_>) -> bool {
    now.activities.len() == then.activities.len()
        && now.activities.iter().zip(&then.activities).all(|(now, then)| {
            now.row.instance == then.row.instance && (!now.verdict.is_met() || then.verdict.is_met())
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
    use mauve_model::{Database, Workspace, names_of, projects};
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
        let mut said = Vec::new();
        for offer in offers {
            let title = offer.title().to_owned();
            let action = actions.iter().find(|action| action.title == title).unwrap();
            let Offer::Proposed { fields, .. } = &offer else {
                said.push(format!("{title} ✗ {}", action.disabled.as_ref().unwrap()));
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
            assert!(title.ends_with(&outcome(applied, query.level)), "{title}\n{fixture}");
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
            Shorter period and deadline, 60 ms (the shortest found, in steps of 1 ms): all 2 meet their deadlines at 1e-4, worst slack 0 ms (pilot)
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
        assert_eq!(
            offer.title(),
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
