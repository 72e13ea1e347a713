//! How far the time of each codel may grow, and how far each period may shrink, before the first deadline is missed.
//!
//! Each value changes alone: all others stay as they are. It counts for the deadlines that it *affects*: those of the
//! activities that are not analysed if the activities that have the value are refused. Where these deadlines are proved now, the limit
//! is the last value with which they still are; where one is not, the first one with which all are. With the limit, every deadline of the
//! deployment that is proved now is proved, and with the next value, one is not: both are analysed.
//!
//! The response times are monotone in every time and in every period, with one exception: an activity that executes operations for
//! others counts fewer calls in each job if its period is shorter.

use mauve_timing::{Bound, Level, Priority, Response, Status, Tasks, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::bisection::ProofBoundary;
use crate::psm::OtherTimes;
use crate::reason::{ActivityField, Timed};
use crate::report::Query;
use crate::response::response_times;
use crate::system::{ResolvedActivity, System, system_of, written_field};
use crate::table_set::TableSet;
use crate::timetable::{Lookup, timetable_of};
use crate::variants::{Variants, is_missed, statuses};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Execution, ModelDb, ProgramId, Project, TimedProgram, behaviour_of, core_of};

/// So many activities are analysed for each value, those of each analysis counted. A search needs about 35 analyses: so a
/// deployment with 200 activities still gets exact limits.
const MOST_ANALYSED: usize = 1 << 13;

/// So many are analysed for all values of a deployment together.
const MOST_OF_ALL: usize = 1 << 19;

/// The sensitivity of a deployment at one level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sensitivity<'db> {
    /// The times of codels, and of programs with an own entry in a table, that an activity executes. In the order of the
    /// activities, each once.
    pub times: Vec<TimeSensitivity<'db>>,
    /// One for each activity, in the order of the deployment.
    pub activities: Vec<ActivitySensitivity>,
}

/// How far the time of a codel or a program may grow, or must shrink.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct TimeSensitivity<'db> {
    /// The codel or the program.
    pub of: Timed<'db>,
    /// Its time now; none where it has no usable one.
    pub time: Option<Time>,
    /// The first affected activity whose deadline is not proved with the present time.
    pub unproved: Option<Name>,
    /// The greatest time.
    pub limit: Limit,
}

/// How far the period of an activity may shrink, or must grow.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ActivitySensitivity {
    /// The instance.
    pub instance: Name,
    /// Its period now.
    pub period: Option<Time>,
    /// The time between its response and its deadline, where the deadline is proved.
    pub slack: Option<Time>,
    /// The first affected activity whose deadline is not proved with the present period.
    pub unproved: Option<Name>,
    /// The least period. The written deadline stays, but is at most the period, unless it is later now; without one, the period is
    /// the deadline.
    pub limit: Limit,
    /// Whether the activity executes operations for others: then not every period between the present one and the limit
    /// need be proved.
    pub serves: bool,
}

/// How far a value may go while every deadline that it affects is proved.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Limit {
    /// It affects no deadline.
    Any,
    /// Every affected deadline is proved with this value. It is the greatest time, or the least period.
    Last(Time),
    /// Every affected deadline is proved with this value. Whether one is missed with the next value is unknown: a budget is exhausted
    /// there, or an activity has no bound whose calls of operations must be counted, or clocks are synchronised.
    Proved(Time),
    /// The deadlines are not proved with any value that was tried: for a time, not even with 0; for a period, not with
    /// 64 times the present one.
    NotFound,
    /// This affected activity is not analysed; none where nothing of the deployment is.
    NotAnalysed(Option<Name>),
    /// The budget was exhausted before any value was proved.
    Exhausted,
}

impl TimeSensitivity<'_> {
    /// Returns the key of the time in a timing table.
    pub fn key(&self, db: &dyn ModelDb) -> String {
        self.of.key(db)
    }
}

impl Limit {
    /// Returns `last`, `proved`, `any`, `not-found`, `not-analysed` or `exhausted`.
    pub fn name(&self) -> &'static str {
        match self {
            Limit::Any => "any",
            Limit::Last(_) => "last",
            Limit::Proved(_) => "proved",
            Limit::NotFound => "not-found",
            Limit::NotAnalysed(_) => "not-analysed",
            Limit::Exhausted => "exhausted",
        }
    }

    /// Returns the value that is proved.
    pub fn time(&self) -> Option<Time> {
        match self {
            Limit::Last(time) | Limit::Proved(time) => Some(*time),
            Limit::Any | Limit::NotFound | Limit::NotAnalysed(_) | Limit::Exhausted => None,
        }
    }
}

/// Computes the sensitivity of a deployment: of all times and all periods in it, until the budget for all of them is exhausted.
pub fn sensitivity<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Sensitivity<'db> {
    all(&Variants::new(db, project, deployment, query, MOST_OF_ALL))
}

fn all<'db>(variants: &Variants<'db>) -> Sensitivity<'db> {
    let Variants { db, project, deployment, query, system, .. } = *variants;
    let times = executed_times(db, project, deployment, query.level).iter();
    let times = times.map(|it| time_limit(variants, it)).collect();
    let activities = 0..system.activities.len();
    Sensitivity { times, activities: activities.filter_map(|it| period_limit(variants, it)).collect() }
}

/// Computes how far the time of a codel or a program may grow, or must shrink; none where no activity executes it.
#[salsa::tracked(returns(ref))]
pub fn time_sensitivity<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    of: Timed<'db>,
    query: Query,
) -> Option<TimeSensitivity<'db>> {
    let executed = executed_times(db, project, deployment, query.level);
    let it = executed.iter().find(|it| it.of == of)?;
    Some(time_limit(&Variants::new(db, project, deployment, query, MOST_ANALYSED), it))
}

fn time_limit<'db>(variants: &Variants<'db>, it: &ExecutedTime<'db>) -> TimeSensitivity<'db> {
    let (of, time) = (it.of.clone(), it.time(variants.db, variants.query.level));
    let executing: Vec<usize> = it.activities.iter().chain(&it.in_background).copied().collect();
    let search = LimitSearch { variants, of: &executing };
    let found = variants.within(MOST_ANALYSED, || search.greatest_time(&of, time));
    let (unproved, limit) = found.unwrap_or_else(|limit| (None, limit));
    TimeSensitivity { of, time, unproved, limit }
}

/// Returns how far the period of the activity of this index may shrink, or must grow.
fn period_limit(variants: &Variants<'_>, index: usize) -> Option<ActivitySensitivity> {
    let Variants { db, project, deployment, query, system, .. } = *variants;
    let activity = system.activities.get(index)?;
    let slack = response_times(db, project, deployment, query).activities.get(index)?.slack();
    let base = variants.with_times(&FxHashSet::default(), &|_| None);
    // Those of one thread have one period.
    let is_of_thread = |other: &usize| {
        *other == index || base.activities().get(*other).is_some_and(|it| it.is_mate(activity))
    };
    let of: Vec<usize> = (0..base.activities().len()).filter(is_of_thread).collect();
    let serves = base.operations.iter().any(|operation| of.contains(&operation.provider));
    let search = LimitSearch { variants, of: &of };
    let found = variants.within(MOST_ANALYSED, || search.least_period(&base, activity));
    let (unproved, limit) = found.unwrap_or_else(|limit| (None, limit));
    let instance = activity.instance.clone();
    Some(ActivitySensitivity { instance, period: activity.period, slack, unproved, limit, serves })
}

/// A time of the tables, and the indices of the real-time activities that execute it.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ExecutedTime<'db> {
    /// The codel, program or port.
    pub of: Timed<'db>,
    activities: Vec<usize>,
    /// Those in the background: they delay others while they hold a lock.
    in_background: Vec<usize>,
    /// The tables that it has a time in: one for each host.
    pub tables: Vec<TableSet<'db>>,
}

impl<'db> ExecutedTime<'db> {
    /// Returns the indices of the real-time activities that execute it.
    pub fn activities(&self) -> &[usize] {
        &self.activities
    }

    /// Returns the time at a level: that of the slowest host.
    pub fn time(&self, db: &'db dyn ModelDb, level: Level) -> Option<Time> {
        let in_tables = |tables: &TableSet<'db>| {
            let times = timetable_of(db, *tables);
            let found = match &self.of {
                Timed::Codel(codel) => times.codel_time(db, *codel, level),
                program => times.time(program, level),
            };
            found.time()
        };
        self.tables.iter().map(in_tables).reduce(|one, other| Some(one?.max(other?))).flatten()
    }
}

/// Returns the times that the edges of activities, and the connected operations that they provide, consist of: those of codels,
/// and of programs with an own entry in a table.
#[salsa::tracked(returns(ref))]
pub fn executed_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Vec<ExecutedTime<'db>> {
    let system: &System<'db> = system_of(db, project, deployment);
    let mut found: Vec<ExecutedTime<'db>> = Vec::new();
    let mut places: FxHashMap<Timed<'db>, usize> = FxHashMap::default();
    for (index, activity) in system.activities.iter().enumerate() {
        let Some(component) = activity.component else { continue };
        let times = timetable_of(db, activity.tables);
        let Some(core) = core_of(db, project, component) else { continue };
        let behaviour = behaviour_of(db, project, core);
        if !behaviour.refusals.is_empty() {
            continue;
        }
        let served: FxHashSet<&Name> = system
            .connected
            .iter()
            .filter(|connected| connected.provider == index)
            .map(|connected| &connected.operation)
            .collect();
        let mut seen = FxHashSet::default();
        let executed = behaviour.edges.executed().filter(|program| seen.insert(*program));
        let mut open: Vec<&TimedProgram<'db>> =
            executed.filter_map(|program| behaviour.programs.get(program)).collect();
        let is_served =
            |it: &&TimedProgram<'db>| matches!(&it.id, ProgramId::Operation(name) if served.contains(name));
        open.extend(behaviour.operations.iter().filter(is_served));
        open.reverse();
        let mut operations = FxHashSet::default();
        let mut of_activity = Vec::new();
        while let Some(program) = open.pop() {
            let timed = Timed::Program(component, program.id.in_table());
            if times.time(&timed, level) != Lookup::Absent {
                of_activity.push(timed);
                continue;
            }
            for execution in program.cost.executions() {
                match execution {
                    Execution::Codel(codel) => of_activity.push(Timed::Codel(*codel)),
                    Execution::Operation(operation) if operations.insert(*operation) => {
                        open.extend(behaviour.operations.get(*operation));
                    }
                    Execution::Access(port) => {
                        let access = Timed::Access(component, port.clone());
                        of_activity.extend(Some(access).filter(|it| times.time(it, level) != Lookup::Absent));
                    }
                    _ => {}
                }
            }
        }
        for of in of_activity {
            let place = *places.entry(of.clone()).or_insert(found.len());
            if place == found.len() {
                let (activities, in_background) = (Vec::new(), Vec::new());
                found.push(ExecutedTime { of, activities, in_background, tables: Vec::new() });
            }
            let Some(known) = found.get_mut(place) else { continue };
            if !known.tables.contains(&activity.tables) {
                known.tables.push(activity.tables);
            }
            let executing = match activity.priority {
                Priority::Background => &mut known.in_background,
                _ => &mut known.activities,
            };
            if executing.last() != Some(&index) {
                executing.push(index);
            }
        }
    }
    found
}

/// The search for the limit of one value.
struct LimitSearch<'a, 'db> {
    variants: &'a Variants<'db>,
    /// The indices of the activities that have the value.
    of: &'a [usize],
}

impl<'db> LimitSearch<'_, 'db> {
    /// Returns the limit of a time that is `now`, and the activity whose deadline is not proved with it. The error is the limit of a
    /// time for which no deadline is compared.
    fn greatest_time(&self, of: &Timed<'db>, now: Option<Time>) -> Result<(Option<Name>, Limit), Limit> {
        let system = self.variants.system;
        if !system.not_analysed.is_empty() {
            return Err(Limit::NotAnalysed(None));
        }
        let executing = self.of.iter().filter_map(|index| system.activities.get(*index)?.executed());
        let components: FxHashSet<Decl<'db>> = executing.collect();
        let with = |time: Time| {
            let what_if: OtherTimes<'_, 'db> = &|other| (other == of).then_some(time);
            self.variants.with_times(&components, what_if)
        };
        let start = now.unwrap_or_default();
        let Affected { deadlines, unproved, .. } = self.affected(&with(start), now.is_some())?;
        let limit = match (&unproved, start.as_nanos()) {
            (None, start) => {
                let longest = system.activities.iter().filter_map(|it| it.deadline).max().unwrap_or_default();
                // A real-time activity that executes it misses its deadline.
                let bad = longest.as_nanos().max(start).saturating_add(1);
                match self.holds(&with(Time::from_nanos(bad)), &deadlines, false) {
                    Some(true) => Limit::Any,
                    Some(false) => self.limit(start, bad, None, &deadlines, with),
                    None => Limit::Proved(Time::from_nanos(start)),
                }
            }
            (Some(_), 0) => Limit::NotFound,
            (Some(_), start) => match self.holds(&with(Time::ZERO), &deadlines, false) {
                Some(true) => self.limit(0, start, None, &deadlines, with),
                Some(false) => Limit::NotFound,
                None => Limit::Exhausted,
            },
        };
        Ok((unproved, limit))
    }

    /// Returns the limit of the period of the activity of this index, and the activity whose deadline is not proved with it. The
    /// error is the limit of a period for which no deadline is compared.
    ///
    /// With synchronised clocks, a shorter period may make a response time shorter: the jobs meet less often. So the other periods
    /// are proved for any offsets, which is monotone.
    fn least_period(
        &self,
        base: &Tasks,
        activity: &ResolvedActivity<'db>,
    ) -> Result<(Option<Name>, Limit), Limit> {
        let Variants { db, deployment, .. } = *self.variants;
        if !self.variants.system.not_analysed.is_empty() {
            return Err(Limit::NotAnalysed(None));
        }
        let now = match (activity.priority, activity.period) {
            (Priority::Background, _) => return Err(Limit::Any),
            (_, Some(period)) => period.as_nanos(),
            (_, None) => return Err(Limit::NotAnalysed(Some(activity.instance.clone()))),
        };
        let is_written = written_field(db, deployment, &activity.instance, ActivityField::Deadline).is_some();
        let with = |period: Time| {
            let mut set = base.clone();
            set.activities_mut().iter_mut().for_each(|it| it.offset = None);
            for &index in self.of {
                let Some(changed) = set.activities_mut().get_mut(index) else { continue };
                let stays = |deadline: &Time| is_written && *deadline > Time::from_nanos(now);
                let deadline = if is_written { changed.deadline } else { Some(period) };
                changed.deadline = deadline.map(|it| if stays(&it) { it } else { it.min(period) });
                changed.period = Some(period);
            }
            set
        };
        let is_synchronised = base.activities().iter().filter(|it| it.offset.is_some()).count() > 1;
        let limit = |good: u64, bad: u64, invalid, deadlines: &[usize]| match self
            .limit(good, bad, invalid, deadlines, with)
        {
            Limit::Last(period) if is_synchronised => Limit::Proved(period),
            limit => limit,
        };
        let Affected { mut deadlines, others, unproved } = self.affected(base, true)?;
        if is_synchronised {
            // Others that are proved for some offsets only are not compared.
            let set = with(Time::from_nanos(now));
            let proved = statuses(&set, &self.variants.analysed(&set, false).ok_or(Limit::Exhausted)?);
            deadlines.retain(|it| !others.contains(it) || proved.get(*it) == Some(&Status::Met));
        }
        let holds = |period: Time| self.holds(&with(period), &deadlines, true);
        if unproved.is_none() {
            // A period is greater than the offset; without one, greater than 0.
            let least = activity.written_offset.unwrap_or_default().as_nanos();
            return Ok((None, limit(now, least, Some(least), &deadlines)));
        }
        let limit = match ProofBoundary::above(now, holds) {
            Some(Some(longer)) => limit(longer.good, longer.bad, None, &deadlines),
            Some(None) => Limit::NotFound,
            None => Limit::Exhausted,
        };
        Ok((unproved, limit))
    }

    /// Returns which deadlines are compared. The error is the limit where one that the value affects is not analysed, or where no steps
    /// are left. `set` has the present value if `is_present`: then the response times are those of the report.
    fn affected(&self, set: &Tasks, is_present: bool) -> Result<Affected, Limit> {
        let mut unknown = set.clone();
        self.of.iter().for_each(|index| unknown.refuse(*index));
        // With operations, a response time without a bound leaves others unknown: that must not depend on the smaller budget.
        let is_brief = set.operations.is_empty();
        let now = self.variants.analysed(set, is_brief).ok_or(Limit::Exhausted)?;
        let without = self.variants.analysed(&unknown, is_brief).ok_or(Limit::Exhausted)?;
        let is_affected = |(without, now): (&Response, &Response)| {
            let Some(because) = unknown_for(without) else { return false };
            because.iter().any(|index| self.of.contains(index)) || unknown_for(now) != Some(because)
        };
        let is_affected: Vec<bool> = without.iter().zip(&now).map(is_affected).collect();
        let found = match is_present {
            true => {
                let Variants { db, project, deployment, query, .. } = *self.variants;
                let report = response_times(db, project, deployment, query);
                report.activities.iter().map(|it| it.verdict).collect()
            }
            false => statuses(set, &now),
        };
        let all = || is_affected.iter().zip(&found).enumerate();
        let first = |is_it: &dyn Fn(Status) -> bool| {
            let (of, _) = all().find(|(_, (is_affected, status))| **is_affected && is_it(**status))?;
            Some(set.activities().get(of)?.name.as_ref().into())
        };
        if let Some(name) = first(&|status| status == Status::NotAnalysed) {
            return Err(Limit::NotAnalysed(Some(name)));
        }
        let others = all().filter(|(_, (is_affected, status))| !**is_affected && **status == Status::Met);
        let others: Vec<usize> = others.map(|(index, _)| index).collect();
        let affected = all().filter(|(_, (is_affected, _))| **is_affected).map(|(index, _)| index);
        Ok(Affected {
            deadlines: affected.chain(others.iter().copied()).collect(),
            others,
            unproved: first(&|status| status != Status::Met),
        })
    }

    /// Returns whether these deadlines are proved; `None` where no steps are left.
    fn holds(&self, set: &Tasks, deadlines: &[usize], is_brief: bool) -> Option<bool> {
        Some(matches!(self.found(set, deadlines, is_brief)?, NextValue::Met))
    }

    /// Searches for the limit between a value that is proved and one that is not; `invalid` is one that no analysis may have. The
    /// smaller budget searches first, the full one where that proves more.
    fn limit(
        &self,
        mut good: u64,
        bad: u64,
        invalid: Option<u64>,
        deadlines: &[usize],
        with: impl Fn(Time) -> Tasks,
    ) -> Limit {
        for is_brief in [true, false] {
            let holds = |value: Time| self.holds(&with(value), deadlines, is_brief);
            let boundary = ProofBoundary::between(good, bad, holds);
            good = boundary.good;
            if !boundary.is_complete() {
                break;
            }
            if invalid == Some(boundary.bad) {
                return Limit::Last(Time::from_nanos(good));
            }
            match self.found(&with(Time::from_nanos(boundary.bad)), deadlines, false) {
                Some(NextValue::Missed) => return Limit::Last(Time::from_nanos(good)),
                Some(NextValue::Met) => good = boundary.bad,
                Some(NextValue::Unknown) | None => break,
            }
            if good == bad {
                break;
            }
        }
        Limit::Proved(Time::from_nanos(good))
    }

    /// Analyses a variant; `None` where no steps are left.
    fn found(&self, set: &Tasks, deadlines: &[usize], is_brief: bool) -> Option<NextValue> {
        let responses = self.variants.analysed(set, is_brief)?;
        let statuses = statuses(set, &responses);
        if deadlines.iter().all(|index| statuses.get(*index) == Some(&Status::Met)) {
            return Some(NextValue::Met);
        }
        let mut all = deadlines.iter().filter_map(|&it| Some((*statuses.get(it)?, responses.get(it)?)));
        let is_one_missed = all.any(|(status, response)| is_missed(status, response));
        Some(if is_one_missed { NextValue::Missed } else { NextValue::Unknown })
    }
}

/// The deadlines that have to be proved with a limit.
struct Affected {
    /// The activities whose deadlines the value affects, and all others whose deadlines are proved now.
    deadlines: Vec<usize>,
    /// The latter.
    others: Vec<usize>,
    /// The first activity whose deadline the value affects and is not proved.
    unproved: Option<Name>,
}

/// What an analysis finds of the deadlines.
enum NextValue {
    /// All are met.
    Met,
    /// One is missed, and a greater budget would not change that.
    Missed,
    /// One is not proved.
    Unknown,
}

/// Returns the activities for whose unknown demand an activity is not analysed; `None` where it is analysed.
fn unknown_for(response: &Response) -> Option<&Vec<usize>> {
    if let Bound::NotAnalysed { because } = &response.bound { Some(because) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_timing::Method;
    use std::fmt::Write as _;

    const ROBOT: &str = "
codel one(): int
codel two(): int
codel four(): int
codel rest(): int
shell S { }
shell Serving { provide help(): int  provide spare(): int }
shell Asking { require help(): int }
core K1(S) { update = { one(); } }
core K2(S) { update = { two(); } }
core K4(S) { statemachine { initial state A { run = { four(); } transition t if one() > 0 to A } } }
core KR(S) { update = { rest(); } }
core KS(Serving) { provide help() = { return one(); } provide spare() = { return two(); } update = { four(); } }
core KA(Asking) { handler h: help update = { if two() > 0 then { h = send(help); } } }
core KO(Serving) { provide help() = { return one(); } provide spare() = { return two(); } update = { help(); } }
component C1(S, K1)
component C2(S, K2)
component C4(S, K4)
component CR(S, KR)
component CO(Serving, KO)
component CS(Serving, KS)
component CA(Asking, KA)
architecture A { instance a: C1  instance b: C2  instance c: C4  instance d: CR }
architecture B { instance s: CS  instance c: CA  operation s.help -> c.help }
architecture C { instance o: CO }
";

    const TIMES: &str = "[codel]\none = 1\ntwo = 2\nfour = 4\nrest = 9\n";

    /// A line for each time and for each activity of the deployment: its limit.
    fn limits_with(deployment: &str, times: &str, config: &str) -> String {
        limits_within(MOST_OF_ALL, deployment, times, config)
    }

    fn limits_within(most: usize, deployment: &str, times: &str, config: &str) -> String {
        let db = Database::default();
        let texts = [
            ("/robot.mal", format!("{ROBOT}deployment D {{ {deployment} }}")),
            (
                "/mauve.toml",
                format!("timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n{config}"),
            ),
            ("/times.toml", times.to_owned()),
        ];
        let texts = texts.into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Exact };
        let found = all(&Variants::new(&db, project, of, query, most));
        let mut out = String::new();
        let shown = |limit: &Limit| limit.time().map_or_else(String::new, |time| format!(" {time}"));
        let late =
            |name: &Option<Name>| name.as_ref().map_or_else(String::new, |name| format!(" for {name}"));
        for it in &found.times {
            let limit = (it.limit.name(), shown(&it.limit), late(&it.unproved));
            let _ = writeln!(out, "{}: {}{}{}", it.key(&db), limit.0, limit.1, limit.2);
        }
        for it in &found.activities {
            let slack = it.slack.map_or_else(String::new, |slack| format!(", slack {slack}"));
            let serves = if it.serves { ", serves" } else { "" };
            let limit = (it.limit.name(), shown(&it.limit), late(&it.unproved));
            let _ = writeln!(out, "{}: {}{}{}{slack}{serves}", it.instance, limit.0, limit.1, limit.2);
        }
        out
    }

    fn limits(deployment: &str, times: &str) -> String {
        limits_with(deployment, times, "")
    }

    const FINE: &str = "architecture A
        activity a { priority = 3 period = 10 }
        activity b { priority = 2 period = 20 deadline = 12 }
        activity c { priority = 1 period = 20 }
        activity d { priority = background }";

    #[test]
    fn every_deadline_is_met() {
        // `c` executes `one` too: in its 20 ms, 2 ms of `b`, 4 ms of its own and three times `one`. `b` fits into 12 ms with two
        // jobs of `a`. In the 20 ms of `c`, 13 jobs of `a` or 6 of `b` (which end after 19 ms) have room.
        let expected = "one: last 4.666666 ms\ntwo: last 10 ms\nfour: last 15 ms\nrest: any\n\
                        a: last 1.538462 ms, slack 9 ms\nb: last 3.166667 ms, slack 9 ms\nc: last 8 ms, slack 12 ms\nd: any\n";
        assert_eq!(limits(FINE, TIMES), expected);
    }

    #[test]
    fn the_values_of_a_deployment_share_a_budget() {
        let all = limits(FINE, TIMES);
        let known = |most, config| {
            let found = limits_within(most, FINE, TIMES, config);
            assert_eq!(found.lines().count(), all.lines().count());
            found.lines().zip(all.lines()).filter(|(one, other)| one == other).count()
        };
        let budgets = [0, 100, 200, 300, 400, 500, 600];
        let found = budgets.map(|most| known(most, ""));
        assert!(found.is_sorted() && found[0] == 1 && found[6] > found[1], "`rest` is free: {found:?}");
        // The locks of many codels are a part of each analysis.
        let lock = "locks.l = { codels = ['one', 'two', 'four', 'rest'], protocol = 'ceiling' }\n";
        let of_locks = budgets.map(|most| known(most, lock));
        assert!(of_locks.iter().sum::<usize>() < found.iter().sum(), "{of_locks:?}, {found:?}");
    }

    #[test]
    fn a_deadline_is_missed() {
        let late = FINE.replace("deadline = 12", "deadline = 2.5");
        let found = limits(&late, TIMES);
        assert!(found.contains("one: last 0.5 ms for b\ntwo: last 1.5 ms for b\nfour: last"), "{found}");
        let lost = FINE.replace("deadline = 12", "deadline = 0.5");
        let found = limits(&lost, TIMES);
        assert!(found.starts_with("one: not-found for b\ntwo: not-found for b\nfour: last"), "{found}");
        // Before the deadline of `c`, there is room for its own 5 ms, 2 ms of `b` and one job of `a`.
        let often =
            FINE.replace("period = 10", "period = 2").replace("1 period = 20", "1 period = 20 deadline = 8");
        let found = limits(&often, TIMES);
        assert!(found.contains("a: last 8 ms for c, slack 1 ms\n"), "{found}");
    }

    #[test]
    fn a_program_executes_its_own_operations() {
        let found = limits("architecture C activity o { priority = 1 period = 10 }", TIMES);
        assert_eq!(found, "one: last 10 ms\no: last 1 ms, slack 9 ms\n");
    }

    #[test]
    fn a_program_has_its_own_time() {
        let times = format!("{TIMES}[program]\n\"C4/A.run\" = 6\n");
        let found = limits(FINE, &times);
        assert!(found.contains("C4/A.run: last"), "{found}");
        assert!(!found.contains("four"), "{found}");
    }

    #[test]
    fn a_codel_without_a_time() {
        let found = limits(FINE, &TIMES.replace("two = 2\n", ""));
        // What delays an activity that is not analysed has no limit; the codel itself has one.
        assert!(
            found.starts_with("one: not-analysed\ntwo: last 10 ms\nfour: not-analysed\nrest: any\n"),
            "{found}"
        );
        let found = limits("architecture A", TIMES);
        assert!(
            found.ends_with("a: not-analysed\nb: not-analysed\nc: not-analysed\nd: not-analysed\n"),
            "{found}"
        );
    }

    #[test]
    fn a_period_is_greater_than_its_offset() {
        let found = limits(&FINE.replace("deadline = 12", "deadline = 12 offset = 15"), TIMES);
        assert!(found.contains("b: last 15.000001 ms"), "{found}");
        // One clock has nothing to be synchronised with.
        let alone = "architecture C activity o { priority = 1 period = 10 offset = 2 }";
        let found = limits_with(alone, TIMES, "clocks.synchronised = [\"o\"]");
        assert!(found.contains("o: last 2.000001 ms"), "{found}");
    }

    #[test]
    fn operations_are_served() {
        let served = "architecture B
            activity s { priority = 2 period = 10 }
            activity c { priority = 1 period = 20 }";
        // `s` executes `help` once in each of its jobs, and never `spare`.
        let found = limits(served, TIMES);
        // With more, `c` has no bound: then the number of its calls is unknown, and `s` is not analysed.
        let expected = "four: proved 7 ms\none: proved 2.5 ms\ntwo: proved 8 ms\n\
                        s: proved 6.666667 ms, slack 4 ms, serves\nc: last 9 ms, slack 12 ms\n";
        assert_eq!(found, expected);
    }

    /// The instances of `A` whose deadlines are met with these times in nanoseconds and periods.
    fn met(activities: &[Random], times: &[(&str, u64)]) -> Vec<String> {
        let db = Database::default();
        let (project, of) = random_project(&db, activities, times);
        let query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Exact };
        let report = response_times(&db, project, of, query);
        let met = report.activities.iter().filter(|it| it.verdict == Status::Met);
        met.map(|it| it.instance.to_string()).collect()
    }

    fn random_project<'db>(
        db: &'db Database,
        activities: &[Random],
        times: &[(&str, u64)],
    ) -> (Project<'db>, Decl<'db>) {
        let mut deployment = "architecture A activity d { priority = background }".to_owned();
        for it in activities {
            let Random { name, priority, period, deadline, mask } = it;
            let _ = write!(
                deployment,
                " activity {name} {{ priority = {priority} period = {} deadline = {} affinity = {mask} }}",
                milliseconds(*period),
                milliseconds(*deadline)
            );
        }
        let times: String =
            times.iter().map(|(codel, time)| format!("{codel} = {}\n", milliseconds(*time))).collect();
        let texts = [
            ("/robot.mal", format!("{ROBOT}deployment D {{ {deployment} }}")),
            (
                "/mauve.toml",
                "timing.tables = [\"t.toml\"]\nplatform.rt_throttling = false\nplatform.cpus = 2".to_owned(),
            ),
            ("/t.toml", format!("[codel]\n{times}")),
        ];
        let texts = texts.into_iter().map(|(path, text)| (path.into(), text));
        let project = projects(db, Workspace::of_texts(db, "/".into(), texts))[0];
        (project, names_of(db, project).anywhere(Kind::Deployment, "D")[0])
    }

    fn milliseconds(nanoseconds: u64) -> String {
        format!("{}.{:06}", nanoseconds / MS, nanoseconds % MS)
    }

    const MS: u64 = 1_000_000;

    /// An activity on one or two CPUs.
    #[derive(Debug, Clone)]
    struct Random {
        name: &'static str,
        priority: u64,
        period: u64,
        deadline: u64,
        mask: u64,
    }

    impl Random {
        fn new(name: &'static str, below: &mut impl FnMut(u64) -> u64) -> Random {
            let period = 10 + below(60);
            let deadline = period - below(period / 2);
            let (period, deadline) = (period * MS, deadline * MS);
            Random { name, priority: 1 + below(5), period, deadline, mask: 1 + below(3) }
        }
    }

    /// Returns random numbers below a limit.
    fn generator(seed: u64) -> impl FnMut(u64) -> u64 {
        let mut random = mauve_timing::Random::new(seed);
        move |limit| random.up_to(limit - 1)
    }

    /// The codels, each with its greatest time in milliseconds.
    const TIMED: [(&str, u64); 4] = [("one", 6), ("two", 14), ("four", 14), ("rest", 1)];

    /// The oracle analyses the printed value and the next one, as a user would. No deadline that is met with a time of 0 is missed
    /// with the printed time, and one is with 1 ns more.
    #[test]
    fn the_next_value_misses_a_deadline_on_several_cpus() {
        let mut below = generator(7);
        let (mut checked, mut free) = (0, 0);
        for round in 0..150 {
            let activities = ["a", "b", "c"].map(|name| Random::new(name, &mut below));
            let times = TIMED.map(|(name, most)| (name, (1 + below(most)) * MS));
            let db = Database::default();
            let (project, of) = random_project(&db, &activities, &times);
            let query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Exact };
            let found = sensitivity(&db, project, of, query);
            for it in &found.times {
                let key = it.key(&db);
                let with = |value: u64| {
                    let times = times.map(|(name, time)| (name, if name == key { value } else { time }));
                    met(&activities, &times)
                };
                match &it.limit {
                    Limit::Last(last) => {
                        let last = last.as_nanos();
                        let least = with(0);
                        assert_eq!(with(last), least, "{round}: {key} = {last} in {activities:?} {times:?}");
                        assert_ne!(
                            with(last + 1),
                            least,
                            "{round}: {key} > {last} in {activities:?} {times:?}"
                        );
                        checked += 1;
                    }
                    Limit::Any => {
                        assert_eq!(with(1000 * MS), with(0), "{round}: {key} in {activities:?} {times:?}");
                        free += 1;
                    }
                    _ => {}
                }
            }
            for it in &found.activities {
                let (Limit::Last(least), Some(index)) =
                    (&it.limit, activities.iter().position(|random| it.instance == random.name))
                else {
                    continue;
                };
                let with = |period: u64| {
                    let mut activities = activities.clone();
                    activities[index].period = period;
                    activities[index].deadline = activities[index].deadline.min(period);
                    met(&activities, &times)
                };
                let least = least.as_nanos();
                let (before, after) = (with(least), with(least.saturating_sub(1).max(1)));
                assert!(
                    least == 1 || before.iter().any(|it| !after.contains(it)),
                    "{round}: {} {least} in {activities:?} {times:?}",
                    it.instance
                );
                checked += 1;
            }
        }
        assert!(checked > 300 && free > 50, "{checked} {free}");
    }

    /// With 22 ms, the thread executes 5 + 7 ms twice in the 44 ms of `c`. Its deadline is later than its period now.
    #[test]
    fn the_least_period_of_a_thread_and_of_late_deadlines() {
        let db = Database::default();
        let text = "shell S { } codel fa(): int codel fb(): int codel fc(): int
            core A(S) { update = { fa(); } } core B(S) { update = { fb(); } } core C(S) { update = { fc(); } }
            component KA(S, A) component KB(S, B) component KC(S, C)
            architecture R { instance a: KA instance b: KB instance c: KC }
            deployment D { architecture R
              activity drivers { instances = [a, b] priority = 2 period = 100 deadline = 150 }
              activity c { priority = 1 period = 100 deadline = 44 } }";
        let files = [
            ("/robot.mal", text),
            ("/mauve.toml", "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n"),
            ("/times.toml", "[codel]\nfa = 5\nfb = 7\nfc = 20\n"),
        ];
        let files = files.map(|(path, text)| (path.into(), text.to_owned()));
        let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let found = sensitivity(&db, project, of, Query::shown(&db, project, of));
        let least: Vec<_> = found.activities.iter().map(|it| it.limit.time()).collect();
        let ms = |time: u64| Some(Time::from_nanos(time * 1_000_000));
        assert_eq!(least, [ms(22), ms(22), ms(32)]);
    }

    /// The same for the time that a codel without one may take.
    #[test]
    fn the_next_time_of_a_missing_one_misses_a_deadline_on_several_cpus() {
        let mut below = generator(11);
        let mut checked = 0;
        for round in 0..150 {
            let activities = ["a", "b", "c"].map(|name| Random::new(name, &mut below));
            let mut times = TIMED.map(|(name, most)| (name, (1 + below(most)) * MS)).to_vec();
            let missing = times.remove(usize::try_from(below(3)).unwrap()).0;
            let db = Database::default();
            let (project, of) = random_project(&db, &activities, &times);
            let query = Query { level: Level::TEN_TO_MINUS_FOUR, method: Method::Exact };
            for it in crate::budgets(&db, project, of, query) {
                let with = |value: u64| met(&activities, &[&times[..], &[(missing, value)]].concat()).len();
                match it.time.map(Time::as_nanos) {
                    Some(most) => {
                        let at_zero = with(0);
                        assert_eq!(it.further, at_zero < 3);
                        assert_eq!(
                            with(most),
                            at_zero,
                            "{round}: {missing} = {most} in {activities:?} {times:?}"
                        );
                        assert!(
                            with(most + 1) < at_zero,
                            "{round}: {missing} > {most} in {activities:?} {times:?}"
                        );
                        checked += 1;
                    }
                    None => assert!(with(0) < 3, "{round}: {missing} in {activities:?} {times:?}"),
                }
            }
        }
        assert!(checked > 30, "{checked}");
    }
}
