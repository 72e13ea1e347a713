//! What else a deployment could be: other priorities, another CPU, another period.
//!
//! No response time here is a guess: the deployment is analysed with the new values as if they stood in the text (see
//! [`response_times_if`]), and what is not analysed so is not found.
//!
//! | found | of | if |
//! |---|---|---|
//! | the priorities of two swapped | an activity | it has a later deadline before it |
//! | the deadline as period | an activity | it is later than the period |
//! | priorities by deadline | a deployment | a later deadline goes before an earlier one on the same CPU |
//! | optimal priorities, or why none exist | a deployment | a deadline is not proved, nor would be by the former |
//! | each other CPU, the best first | an activity | every deadline that is proved now stays proved |
//! | the shortest period found | an activity | every deadline is proved now, and still would be |
//! | a longer period, the shortest found that helps | an activity | some deadline is not proved now |
//! | the period as deadline | an activity | it has an earlier one |

use std::cmp::Reverse;
use std::collections::BTreeSet;

use mauve_timing::{Status, Time};

use crate::priorities::before_its_time;
use crate::response::{ActivityReport, Query, Report, Verdict, response_times, response_times_if};
use crate::system::{Priority, Row, System, system_of};
use crate::what_if::SupposedField;
use mauve_hir::item_tree::{Expr, Literal, Name};
use mauve_hir::{Decl, ModelDb, Project, deployment};
use mauve_syntax::keywords::ActivityField;

/// So many activities are analysed in one search, those of each try counted; what takes more is not found. It is a number
/// of steps and no time, so that the same model has the same answers everywhere. A step of the sample robot, of ten
/// activities, takes 1.2 µs in a release build: the searches of a deployment and of an activity take 5 ms at most; for the
/// robot itself 0.2 ms.
const MOST_STEPS: usize = 2048;

/// So many other CPUs are found.
const MOST_MOVES: usize = 4;

/// A period is at most so many times longer than it is now.
const MOST_LONGER: u64 = 64;

/// The greatest number that a field takes, in nanoseconds.
const LONGEST: u64 = i32::MAX as u64 * 1_000_000;

/// What a search finds.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum BetterTiming {
    /// A change, and the values that make it.
    Change(TimingChange, Vec<SupposedField>),
    /// No order of priorities is found that proves every deadline: none of these activities meets its own below the others.
    NoPriorities(Vec<Name>),
}

/// What changes in a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum TimingChange {
    /// The priorities of two activities are swapped.
    SwapPriorities(Name, Name),
    /// Priorities are deadline-monotonic.
    PrioritiesByDeadline,
    /// Priorities are those that Audsley's algorithm finds.
    OptimalPriorities,
    /// The deadline becomes the period, as it is written, in milliseconds.
    PeriodAsDeadline(Name),
    /// The period becomes the deadline.
    DeadlineAsPeriod(Time),
    /// The activity moves to the CPU of this mask.
    Cpu(u64),
    /// The period becomes shorter or longer.
    Period {
        /// Whether it becomes longer.
        is_longer: bool,
        /// Whether the deadline becomes the same.
        with_deadline: bool,
        /// The shortest period found. One step less is too short; of shorter ones nothing is known, for the search halves
        /// an interval.
        period: Time,
        /// What the period is a multiple of.
        step: Time,
    },
}

/// What is found for a deployment as a whole. Editors ask at every movement of the cursor, and again when an action is
/// chosen: the search is made once.
#[salsa::tracked(returns(ref))]
pub fn better_priorities<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
) -> Vec<BetterTiming> {
    Search::new(db, project, of, query).map_or_else(Vec::new, |mut search| search.priorities())
}

/// What is found for the activity of that row.
#[salsa::tracked(returns(ref))]
pub fn better_activity<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    row: usize,
    query: Query,
) -> Vec<BetterTiming> {
    let mut found = Vec::new();
    let row = system_of(db, project, of).rows.get(row);
    if let Some(row) = row.filter(|row| matches!(row.priority, Priority::RealTime(_)))
        && let Some(mut search) = Search::new(db, project, of, query)
    {
        found.extend(search.swap(row));
        found.extend(search.late_deadline(row));
        found.extend(deadline(row));
        found.extend(search.period(row));
        found.extend(search.moves(row));
    }
    found
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

    /// What these values give; `None` where that would take too many steps. A cancelled search ends
    /// at the next of them.
    fn ask(&mut self, fields: &[SupposedField]) -> Option<Report<'db>> {
        self.steps = self.steps.checked_sub(self.system.rows.len().max(1))?;
        self.db.unwind_if_revision_cancelled();
        Some(response_times_if(self.db, self.project, self.of, self.query, fields))
    }

    /// The priorities of an activity and of the activity with the lowest priority above its own that has a later deadline.
    fn swap(&self, row: &Row<'db>) -> Option<BetterTiming> {
        let other = before_its_time(&self.system.rows, row)?;
        let fields = vec![priority_of(row, priority(other)), priority_of(other, priority(row))];
        let swap = TimingChange::SwapPriorities(row.instance.clone(), other.instance.clone());
        Some(BetterTiming::Change(swap, fields))
    }

    /// A deadline that is later than the period, as the period.
    fn late_deadline(&self, row: &Row<'db>) -> Option<BetterTiming> {
        let data = deployment(self.db, self.of).filter(|_| row.is_late)?;
        let activity = data.activities.iter().find(|it| it.instance.name == row.instance)?;
        let deadline =
            activity.fields.iter().find(|field| field.name.name == ActivityField::Deadline.keyword())?;
        let Expr::Literal(Literal::Int(text) | Literal::Float(text), _) = &deadline.value else {
            return None;
        };
        let fields = vec![field(row, ActivityField::Period, text.to_string())];
        Some(BetterTiming::Change(TimingChange::PeriodAsDeadline(text.clone()), fields))
    }

    /// Other priorities.
    fn priorities(&mut self) -> Vec<BetterTiming> {
        let Some(groups) = groups(self.system) else { return Vec::new() };
        let mut found = Vec::new();
        let ordered: Vec<SupposedField> =
            groups.iter().filter(|group| !group.is_by_deadline()).flat_map(Group::by_deadline).collect();
        let mut is_solved = is_proved(self.now);
        if !ordered.is_empty()
            && let Some(report) = self.ask(&ordered)
        {
            is_solved |= is_proved(&report);
            found.push(BetterTiming::Change(TimingChange::PrioritiesByDeadline, ordered));
        }
        let is_analysed = |it: &ActivityReport<'_>| it.verdict != Verdict::RealTime(Status::NotAnalysed);
        if !is_solved && self.now.activities.iter().all(is_analysed) {
            found.extend(self.optimal(&groups));
        }
        found
    }

    /// The priorities with which every deadline is proved, if they exist (Audsley's algorithm): from the lowest priority up,
    /// an activity that meets its deadline below all that are left gets the priority. The algorithm is optimal, since a
    /// response time depends on which activities have higher priorities, and not on their order.
    fn optimal(&mut self, groups: &[Group<'_, 'db>]) -> Option<BetterTiming> {
        let mut fields = Vec::new();
        for group in groups {
            match self.optimal_of(group)? {
                Ok(found) => fields.extend(found),
                Err(names) => return Some(BetterTiming::NoPriorities(names)),
            }
        }
        self.ask(&fields).filter(is_proved)?;
        Some(BetterTiming::Change(TimingChange::OptimalPriorities, fields))
    }

    /// The priorities of a group, or those of it that cannot be ordered.
    fn optimal_of(&mut self, group: &Group<'_, 'db>) -> Option<Result<Vec<SupposedField>, Vec<Name>>> {
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
                return Some(Err(left.iter().map(|row| row.instance.clone()).collect()));
            };
            fields.push(priority_of(left.remove(index), number));
        }
        Some(Ok(fields))
    }

    /// The other CPUs on which nothing becomes worse, the best first.
    fn moves(&mut self, row: &Row<'db>) -> Vec<BetterTiming> {
        let mut found = Vec::new();
        for cpu in (0..64).map(|bit| 1_u64 << bit).filter(|cpu| self.system.cpus & cpu != 0) {
            if row.cpus == Some(cpu) {
                continue;
            }
            let fields = vec![field(row, ActivityField::Affinity, cpu.to_string())];
            let Some(report) = self.ask(&fields) else { break };
            let is_analysed = report.activities.iter().any(|it| {
                it.row.instance == row.instance && it.verdict != Verdict::RealTime(Status::NotAnalysed)
            });
            if is_analysed && is_no_worse(self.now, &report) {
                found.push((BetterTiming::Change(TimingChange::Cpu(cpu), fields), report));
            }
        }
        let slack = |report: &Report<'_>| least_slack(report).map(|(slack, _)| slack);
        found.sort_by_key(|(_, report)| Reverse((report.deadlines().met, slack(report))));
        found.into_iter().map(|(change, _)| change).take(MOST_MOVES).collect()
    }

    /// The shortest period while all is well; the least longer one that helps otherwise.
    fn period(&mut self, row: &Row<'db>) -> Option<BetterTiming> {
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
            return Some(self.with(row, false, number * step, step));
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
                    return Some(self.with(row, true, number * step, step));
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

    fn with(&self, row: &Row<'db>, is_longer: bool, period: u64, step: u64) -> BetterTiming {
        let (period, step) = (Time::from_nanos(period), Time::from_nanos(step));
        let fields = self.with_period(row, period);
        let with_deadline = fields.len() > 1;
        BetterTiming::Change(TimingChange::Period { is_longer, with_deadline, period, step }, fields)
    }

    /// A period, and the deadline with it where it is written and is the period now, or would be later.
    fn with_period(&self, row: &Row<'db>, period: Time) -> Vec<SupposedField> {
        let mut fields = vec![field(row, ActivityField::Period, period.number())];
        let is_written = deployment(self.db, self.of)
            .and_then(|data| data.activities.iter().find(|it| it.instance.name == row.instance))
            .is_some_and(|it| {
                it.fields.iter().any(|field| field.name.name == ActivityField::Deadline.keyword())
            });
        if is_written && (row.deadline == row.period || row.deadline > Some(period)) {
            fields.push(field(row, ActivityField::Deadline, period.number()));
        }
        fields
    }
}

/// The latest deadline that there is.
fn deadline(row: &Row<'_>) -> Option<BetterTiming> {
    let period = row.period.filter(|period| row.deadline < Some(*period))?;
    let fields = vec![field(row, ActivityField::Deadline, period.number())];
    Some(BetterTiming::Change(TimingChange::DeadlineAsPeriod(period), fields))
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
    field(row, ActivityField::Priority, number.to_string())
}

fn field(row: &Row<'_>, field: ActivityField, value: String) -> SupposedField {
    SupposedField { instance: row.instance.clone(), field: field.keyword(), value: value.into() }
}

fn is_proved(report: &Report<'_>) -> bool {
    report.schedulable()
}

/// Is every deadline proved that is now, and is there a bound of all of which there is one?
pub fn is_no_worse(now: &Report<'_>, then: &Report<'_>) -> bool {
    now.activities.len() == then.activities.len()
        && now.activities.iter().zip(&then.activities).all(|(now, then)| {
            now.row.instance == then.row.instance
                && (!now.verdict.is_met() || then.verdict.is_met())
                && (now.response.is_none() || then.response.is_some())
        })
}

/// The time that is left in the worst case to the one that has the least.
pub fn least_slack<'a>(report: &'a Report<'_>) -> Option<(Time, &'a Name)> {
    let slack =
        |it: &'a ActivityReport<'_>| Some((it.row.deadline?.checked_sub(it.response?)?, &it.row.instance));
    report.activities.iter().filter_map(slack).min_by_key(|(slack, _)| *slack)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    #[test]
    fn the_order_that_is_found_proves_what_can_be_proved() {
        // From the worst order; without the one by deadline, which would prove it too.
        let model = "shell S { } codel fa(): int codel fb(): int codel fc(): int
            core A(S) { update = { fa(); } } core B(S) { update = { fb(); } } core C(S) { update = { fc(); } }
            component KA(S, A) component KB(S, B) component KC(S, C)
            architecture R { instance a: KA instance b: KB instance c: KC }
            deployment D { architecture R activity a { priority = 1 period = 10 } activity b { priority = 2 period = 20 }
                activity c { priority = 3 period = 50 } }";
        let db = Database::default();
        let files = [
            ("/robot.mal", model),
            ("/mauve.toml", "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n"),
            ("/times.toml", "[codel]\nfa = 3\nfb = 6\nfc = 14\n"),
        ];
        let files = files.map(|(path, text)| (path.into(), text.to_owned()));
        let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let query = Query::shown(&db, project);
        let mut search = Search::new(&db, project, of, query).unwrap();
        let (now, system) = (search.now, search.system);
        assert!(!is_proved(now));
        let found = search.optimal(&groups(system).unwrap()).unwrap();
        let BetterTiming::Change(TimingChange::OptimalPriorities, fields) = found else {
            panic!("{found:?}")
        };
        let report = response_times_if(&db, project, of, query, &fields);
        assert!(is_proved(&report));
        assert_eq!(least_slack(&report), Some((Time::from_nanos(7_000_000), &Name::from("a"))));
        // Too many steps: nothing rather than half an answer.
        search.steps = 3;
        assert!(search.optimal(&groups(system).unwrap()).is_none());
    }
}
