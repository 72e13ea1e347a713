//! The search for better priorities, CPUs, periods and deadlines.
//!
//! The search analyses the deployment with the new values (`variants.rs`), and proposes only changes that it
//! has analysed.
//!
//! | change | of | where |
//! |---|---|---|
//! | one priority, the nearest free one that helps | an activity | a deadline is not proved now |
//! | two priorities are swapped | an activity | an activity with a later deadline has a higher priority |
//! | one priority that meets every deadline | a deployment | a deadline is not proved now |
//! | deadline-monotonic priorities | a deployment | an activity with a later deadline has a higher priority on the same CPU |
//! | optimal priorities, or why none exist | a deployment | a deadline is not proved, not by the former either |
//! | each other CPU, the best first | an activity | every deadline that is proved now stays proved |
//! | the shortest period found | an activity | every deadline is proved now and stays proved |
//! | a longer period, the shortest found that helps | an activity | a deadline is not proved now |
//! | a later deadline, the earliest that is met | an activity | its deadline is missed, and earlier than the period |

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use mauve_timing::{CpuSet, Priority, Status, Time, sharing_cpus};

use crate::bisection::{ProofBoundary, step_of};
use crate::priorities::inverted;
use crate::report::{ActivityReport, Deadlines, Query, Report};
use crate::response::response_times;
use crate::system::{ResolvedActivity, System, system_of, written_field};
use crate::tune::{TuneRequest, tune};
use crate::variants::Variants;
use crate::what_if::{WhatIfField, least_period, other_period};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, Project, hosts_of};
use mauve_syntax::keywords::ActivityField;

/// So many activities are analysed in one search, those of each analysis counted. The limit is a number of steps and no
/// time, so that the same model has the same answers everywhere. A step of the sample robot, of ten
/// activities, takes 1.2 µs in a release build: the searches of a deployment and of an activity take 5 ms at most; for the
/// robot itself 0.2 ms.
const MOST_STEPS: usize = 2048;

const MOST_MOVES: usize = 4;

/// The priorities of real-time threads.
const PRIORITIES: RangeInclusive<u32> = 1..=99;

/// The greatest value of a field, in nanoseconds.
const LONGEST: u64 = i32::MAX as u64 * 1_000_000;

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum BetterTiming {
    /// A change, and the values that make it.
    Change(TimingChange, Vec<WhatIfField>),
    /// No order of priorities proves every deadline: none of these activities meets its deadline at the lowest
    /// priority of them.
    NoPriorities(Vec<Name>),
}

/// A change of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum TimingChange {
    /// One activity gets this priority.
    Priority(u32),
    /// The priorities of two activities are swapped: those of the two values.
    SwapPriorities,
    /// Priorities are deadline-monotonic.
    PrioritiesByDeadline,
    /// Priorities are those that Audsley's algorithm finds.
    OptimalPriorities,
    /// The deadline becomes later: the earliest one that the response time does not reach.
    Deadline(Time),
    /// The activity moves to the CPU of this mask.
    Cpu(CpuSet),
    /// The period becomes shorter or longer.
    Period {
        /// Whether it becomes longer.
        is_longer: bool,
        /// Whether the deadline becomes the same.
        with_deadline: bool,
        /// The shortest period found by bisection. One step less is too short: the greatest power of ten that is at most
        /// 1 ms and a hundredth of the period.
        period: Time,
    },
}

/// Searches for better priorities of a deployment. Editors ask at every movement of the cursor, and again when an action is
/// chosen: the search runs once.
#[salsa::tracked(returns(ref))]
pub fn better_priorities<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
) -> Vec<BetterTiming> {
    let search = || TimingSearch::new(Variants::new(db, project, of, query, MOST_STEPS));
    let one = search().and_then(|search| search.one_priority());
    one.into_iter().chain(search().map_or_else(Vec::new, |search| search.priorities())).collect()
}

/// Searches for better values of the activity of this index.
#[salsa::tracked(returns(ref))]
pub fn better_activity<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    index: usize,
    query: Query,
) -> Vec<BetterTiming> {
    let mut found = Vec::new();
    let activity = system_of(db, project, of).activities.get(index);
    let search = || TimingSearch::new(Variants::new(db, project, of, query, MOST_STEPS));
    if let Some(activity) = activity.filter(|it| matches!(it.priority, Priority::RealTime(_)))
        && let Some((of_priority, search)) = search().zip(search())
    {
        // With steps of its own, since it has as many as there are priorities.
        found.extend(of_priority.priority(activity));
        found.extend(search.swap(activity));
        found.extend(search.deadline(activity));
        found.extend(search.period(activity));
        found.extend(search.moves(activity));
    }
    found
}

struct TimingSearch<'db> {
    variants: Variants<'db>,
    now: &'db Report<'db>,
}

impl TimingChange {
    /// Returns whether the change lets the robot do less than the model requires now: an activity runs more rarely, or may end
    /// later.
    pub fn relaxes(&self) -> bool {
        matches!(self, TimingChange::Deadline(_) | TimingChange::Period { is_longer: true, .. })
    }
}

impl<'db> TimingSearch<'db> {
    /// Returns none where the deployment is not analysed: no change of a field can be either.
    fn new(variants: Variants<'db>) -> Option<TimingSearch<'db>> {
        let Variants { db, project, deployment, query, .. } = variants;
        let now = response_times(db, project, deployment, query);
        now.not_analysed.is_empty().then_some(TimingSearch { variants, now })
    }

    /// Returns the free priorities that an activity may have in other places of the order, the nearest first: higher ones first if it
    /// misses its deadline.
    fn free_priorities(&self, activity: &ResolvedActivity<'db>) -> Vec<u32> {
        let Some(groups) = groups(self.variants.system) else { return Vec::new() };
        let is_it =
            |it: &&ResolvedActivity<'db>| it.instance == activity.instance || it.shares_thread(activity);
        let Some(group) = groups.iter().find(|group| group.activities.iter().any(is_it)) else {
            return Vec::new();
        };
        let others: BTreeSet<u32> =
            group.activities.iter().filter(|it| !is_it(it)).map(|it| priority(it)).collect();
        let own = priority(activity);
        let is_free = |number: &u32| PRIORITIES.contains(number) && !others.contains(number);
        let higher = others.range(own..).map(|it| it + 1).filter(is_free);
        let lower = others.range(..=own).rev().map(|it| it.saturating_sub(1)).filter(is_free);
        match is_met(self.now, activity) {
            true => lower.chain(higher).collect(),
            false => higher.chain(lower).collect(),
        }
    }

    /// Returns the deployment with another priority of an activity; the inner none where it loses a deadline, a bound or slack.
    fn with_priority(
        &self,
        activity: &ResolvedActivity<'db>,
        number: u32,
    ) -> Option<Option<(Report<'db>, BetterTiming)>> {
        let fields = vec![priority_of(activity, number)];
        let report = self.variants.report(&fields)?;
        let is_kept = is_no_worse(self.now, &report) && keeps_slack(self.now, &report);
        Some(is_kept.then_some((report, BetterTiming::Change(TimingChange::Priority(number), fields))))
    }

    /// Returns the nearest priority with which every deadline is met; if there is none, with which that of the activity is.
    fn priority(&self, activity: &ResolvedActivity<'db>) -> Option<BetterTiming> {
        if meets_all(self.now) {
            return None;
        }
        let mut second = None;
        for number in self.free_priorities(activity) {
            let Some(found) = self.with_priority(activity, number) else { break };
            let Some((report, change)) = found else { continue };
            if meets_all(&report) {
                return Some(change);
            }
            if second.is_none() && !is_met(self.now, activity) && is_met(&report, activity) {
                second = Some(change);
            }
        }
        second
    }

    /// Returns one priority with which every deadline is met: of the activities that miss theirs first.
    fn one_priority(&self) -> Option<BetterTiming> {
        if meets_all(self.now) {
            return None;
        }
        let system = self.variants.system;
        let is_written = |it: &&ResolvedActivity<'db>| {
            it.priority != Priority::Background && is_first_of_thread(&system.activities, it)
        };
        let mut activities: Vec<&ResolvedActivity<'db>> =
            system.activities.iter().filter(is_written).collect();
        activities.sort_by_cached_key(|it| (is_met(self.now, it), Reverse(priority(it))));
        for activity in activities {
            for number in self.free_priorities(activity) {
                let found = self.with_priority(activity, number)?;
                if let Some((_, change)) = found.filter(|(report, _)| meets_all(report)) {
                    return Some(change);
                }
            }
        }
        None
    }

    /// Returns the earliest deadline that a late activity meets, by a step of [`step_of`] at most, and none beyond the period.
    fn deadline(&self, activity: &ResolvedActivity<'db>) -> Option<BetterTiming> {
        let report = self.now.activities.iter().find(|it| it.instance == activity.instance)?;
        let (response, now, period) = (report.response?, activity.deadline?, activity.period?);
        if report.verdict != Status::Missed {
            return None;
        }
        let step = step_of(now);
        let least = Time::from_nanos((response.as_nanos() / step).saturating_add(1).saturating_mul(step));
        let deadline = least.min(period);
        if deadline <= response || deadline <= now {
            return None;
        }
        let fields = vec![WhatIfField::new(activity, ActivityField::Deadline, deadline.number())];
        Some(BetterTiming::Change(TimingChange::Deadline(deadline), fields))
    }

    /// Swaps the priorities of an activity and of the activity with the lowest priority above its own that has a later
    /// deadline.
    fn swap(&self, activity: &ResolvedActivity<'db>) -> Option<BetterTiming> {
        let other = inverted(&self.variants.system.activities, activity)?;
        let fields = vec![priority_of(activity, priority(other)), priority_of(other, priority(activity))];
        Some(BetterTiming::Change(TimingChange::SwapPriorities, fields))
    }

    fn priorities(&self) -> Vec<BetterTiming> {
        let Some(groups) = groups(self.variants.system) else { return Vec::new() };
        let mut found = Vec::new();
        let ordered: Vec<WhatIfField> = groups.iter().flat_map(SharingGroup::deadline_monotonic).collect();
        let mut is_solved = self.now.schedulable();
        if !ordered.is_empty()
            && let Some(report) = self.variants.report(&ordered)
        {
            is_solved |= report.schedulable();
            found.push(BetterTiming::Change(TimingChange::PrioritiesByDeadline, ordered));
        }
        if !is_solved && self.now.activities.iter().all(is_analysed) {
            found.extend(self.optimal());
        }
        found
    }

    /// Returns the priorities with which every deadline is proved, or why none exist.
    fn optimal(&self) -> Option<BetterTiming> {
        let request =
            TuneRequest { priorities: true, most_steps: self.variants.left.get(), ..TuneRequest::default() };
        let Variants { db, project, deployment, query, .. } = self.variants;
        let found = tune(db, project, deployment, query, &request).ok()?;
        match found.conflict {
            _ if found.is_met => Some(BetterTiming::Change(TimingChange::OptimalPriorities, found.fields)),
            conflict => Some(BetterTiming::NoPriorities(conflict?.activities)),
        }
    }

    fn moves(&self, activity: &ResolvedActivity<'db>) -> Vec<BetterTiming> {
        let mut found = Vec::new();
        let Variants { db, project, system, .. } = self.variants;
        let hosts = hosts_of(db, project.workspace(db));
        for cpu in system.cpus.each() {
            if activity.cpus == Some(cpu) || hosts.host(cpu) != activity.host {
                continue;
            }
            let (_, cpu) = hosts.local(cpu);
            let fields = vec![WhatIfField::new(activity, ActivityField::Affinity, cpu.0)];
            let Some(report) = self.variants.report(&fields) else { break };
            let is_it = |it: &&ActivityReport<'_>| it.instance == activity.instance;
            if report.activities.iter().filter(is_it).any(is_analysed) && is_no_worse(self.now, &report) {
                found.push((BetterTiming::Change(TimingChange::Cpu(cpu), fields), report));
            }
        }
        // A CPU with more met deadlines first, then with the smaller response time of the activity.
        found.sort_by_key(|(_, report)| {
            let it = report.activities.iter().find(|it| it.instance == activity.instance);
            let response = it.and_then(|it| it.response);
            (Reverse(report.deadlines().met), response.is_none(), response)
        });
        found.into_iter().map(|(change, _)| change).take(MOST_MOVES).collect()
    }

    /// Returns the shortest period with which every deadline is met. Where one is missed now, the shortest longer one; if there is none,
    /// that with which the deadline of the activity is met.
    fn period(&self, activity: &ResolvedActivity<'db>) -> Option<BetterTiming> {
        let (period, step) = (activity.period?.as_nanos(), step_of(activity.period?));
        let Variants { db, deployment, .. } = self.variants;
        let has_deadline =
            written_field(db, deployment, &activity.instance, ActivityField::Deadline).is_some();
        let fields = |nanos: u64| other_period(activity, has_deadline, Time::from_nanos(nanos));
        let holds = |goal: &dyn Fn(&Report<'db>) -> bool, number: Time| {
            let least = least_period(activity, has_deadline).as_nanos();
            let nanos = number.as_nanos().checked_mul(step);
            let Some(nanos) = nanos.filter(|it| (least..=LONGEST).contains(it)) else {
                return Some(false);
            };
            let report = self.variants.report(&fields(nanos))?;
            Some(goal(&report) && keeps_slack(self.now, &report))
        };
        // With one step less, the goal is not reached. Where it is monotone, the period is the least.
        let change = |is_longer, between: ProofBoundary, goal: &dyn Fn(&Report<'db>) -> bool| {
            let found = ProofBoundary::between(between.good, between.bad, |number| holds(goal, number));
            let fields = found.is_complete().then(|| fields(found.good * step))?;
            let period = Time::from_nanos(found.good * step);
            let change = TimingChange::Period { is_longer, with_deadline: fields.len() > 1, period };
            Some(BetterTiming::Change(change, fields))
        };
        let now = period / step;
        if self.now.schedulable() {
            let greatest = if now * step == period { now.checked_sub(1)? } else { now };
            let goal = |report: &Report<'_>| report.schedulable();
            let is_shorter = holds(&goal, Time::from_nanos(greatest))? && greatest > 0;
            return if is_shorter {
                change(false, ProofBoundary { good: greatest, bad: 0 }, &goal)
            } else {
                None
            };
        }
        if meets_all(self.now) {
            return None;
        }
        let goals: [&dyn Fn(&Report<'db>) -> bool; 2] = [&meets_all, &|report| is_met(report, activity)];
        for goal in goals.into_iter().take(if is_met(self.now, activity) { 1 } else { 2 }) {
            if let Some(longer) = ProofBoundary::above(now, |number| holds(goal, number))? {
                return change(true, longer, goal);
            }
        }
        None
    }
}

/// Activities that may delay each other, and the priorities that they have among them. Of the activities of a thread, which have one
/// priority, it has the first.
struct SharingGroup<'a, 'db> {
    activities: Vec<&'a ResolvedActivity<'db>>,
    /// One for each activity, descending, no two alike.
    numbers: Vec<u32>,
}

/// Groups the real-time activities by the CPUs that they share; none where the priority, the CPU or the deadline of one is
/// unknown, or where there are more activities than priorities.
fn groups<'a, 'db>(system: &'a System<'db>) -> Option<Vec<SharingGroup<'a, 'db>>> {
    let is_counted = |it: &&ResolvedActivity<'db>| {
        // That of a gateway is in mauve.toml, and stays.
        let is_written = it.priority != Priority::Background && it.gateway.is_none();
        is_written && is_first_of_thread(&system.activities, it)
    };
    let known = system.activities.iter().filter(is_counted).map(|activity| {
        let is_known = activity.priority != Priority::Unknown && activity.deadline.is_some();
        Some((activity.cpus.filter(|_| is_known)?, activity))
    });
    let groups = sharing_cpus(known.collect::<Option<Vec<_>>>()?).into_iter().map(|(_, activities)| {
        let own: BTreeSet<u32> = activities.iter().map(|it| priority(it)).collect();
        let count = u32::try_from(activities.len()).ok().filter(|count| *count <= 99)?;
        let numbers = if own.len() == activities.len() {
            own.into_iter().rev().collect()
        } else {
            (1..=count).rev().collect()
        };
        Some(SharingGroup { activities, numbers })
    });
    groups.collect()
}

/// Whether an activity is the first one that its thread executes.
fn is_first_of_thread(activities: &[ResolvedActivity<'_>], activity: &ResolvedActivity<'_>) -> bool {
    activities
        .iter()
        .find(|it| it.shares_thread(activity))
        .is_none_or(|first| first.instance == activity.instance)
}

impl<'a, 'db> SharingGroup<'a, 'db> {
    /// Returns the activities by deadline; those that have the same stay in the order of their priorities.
    fn by_deadline(&self) -> Vec<&'a ResolvedActivity<'db>> {
        let mut activities = self.activities.clone();
        activities.sort_by_key(|it| (it.deadline, Reverse(priority(it))));
        activities
    }

    /// Returns the priorities that change where an earlier deadline gets a higher one; none where they are in this order.
    fn deadline_monotonic(&self) -> Vec<WhatIfField> {
        let activities = self.by_deadline();
        let changed = activities.iter().zip(&self.numbers).filter(|(it, number)| priority(it) != **number);
        changed.map(|(it, &number)| priority_of(it, number)).collect()
    }
}

fn priority(activity: &ResolvedActivity<'_>) -> u32 {
    activity.priority.real_time().unwrap_or_default()
}

fn priority_of(activity: &ResolvedActivity<'_>, number: u32) -> WhatIfField {
    WhatIfField::new(activity, ActivityField::Priority, number)
}

fn is_analysed(activity: &ActivityReport<'_>) -> bool {
    activity.verdict != Status::NotAnalysed
}

fn is_met(report: &Report<'_>, activity: &ResolvedActivity<'_>) -> bool {
    let found = report.activities.iter().find(|it| it.instance == activity.instance);
    found.is_some_and(|it| it.verdict.is_met())
}

/// Returns whether every deadline is proved of those that the analysis has a figure for.
fn meets_all(report: &Report<'_>) -> bool {
    let Deadlines { met, unknown, all } = report.deadlines();
    met + unknown == all
}

/// Returns whether every deadline that is proved now, and every bound, still is.
pub fn is_no_worse(now: &Report<'_>, then: &Report<'_>) -> bool {
    now.activities.len() == then.activities.len()
        && now.activities.iter().zip(&then.activities).all(|(now, then)| {
            now.instance == then.instance
                && (!now.verdict.is_met() || then.verdict.is_met())
                && (now.response.is_none() || then.response.is_some())
        })
}

/// Returns whether no response time becomes equal to its deadline: such a change would fail with the next nanosecond.
pub fn keeps_slack(now: &Report<'_>, then: &Report<'_>) -> bool {
    let is_used_up = |it: &ActivityReport<'_>| it.response.is_some() && it.response == it.deadline;
    now.activities.iter().zip(&then.activities).all(|(now, then)| !is_used_up(then) || is_used_up(now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::response_times_if;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    /// The deployment of the activities `a`, `b` and `c`, whose programs are `fa`, `fb` and `fc`.
    fn deployed<'db>(db: &'db Database, activities: &str, times: &str) -> (Project<'db>, Decl<'db>) {
        let model = format!(
            "shell S {{ }} codel fa(): int codel fb(): int codel fc(): int
            core A(S) {{ update = {{ fa(); }} }} core B(S) {{ update = {{ fb(); }} }} core C(S) {{ update = {{ fc(); }} }}
            component KA(S, A) component KB(S, B) component KC(S, C)
            architecture R {{ instance a: KA instance b: KB instance c: KC }}
            deployment D {{ architecture R {activities} }}"
        );
        let files = [
            ("/robot.mal", model),
            ("/mauve.toml", "timing.tables = [\"times.toml\"]\nplatform.rt_throttling = false\n".to_owned()),
            ("/times.toml", format!("[codel]\n{times}")),
        ];
        let files = files.map(|(path, text)| (path.into(), text));
        let project = projects(db, Workspace::of_texts(db, "/".into(), files))[0];
        (project, names_of(db, project).anywhere(Kind::Deployment, "D")[0])
    }

    /// Returns the values of each change that is found: for the activity of this index, or for the deployment.
    fn changes(activities: &str, times: &str, index: Option<usize>) -> Vec<String> {
        let db = Database::default();
        let (project, of) = deployed(&db, activities, times);
        let query = Query::shown(&db, project, of);
        let found = match index {
            Some(index) => better_activity(&db, project, of, index, query),
            None => better_priorities(&db, project, of, query),
        };
        let values = |it: &BetterTiming| match it {
            BetterTiming::Change(_, fields) => fields
                .iter()
                .map(|it| format!("{} {} = {}", it.instance, it.field.keyword(), it.value))
                .collect::<Vec<_>>()
                .join(", "),
            BetterTiming::NoPriorities(names) => format!("none of {}", names.join(", ")),
        };
        found.iter().map(values).collect()
    }

    const TIMES: &str = "fa = 10\nfb = 20\nfc = 30\n";

    #[test]
    fn the_order_that_is_found_proves_what_can_be_proved() {
        // From the worst order; without the one by deadline, which would prove it too.
        let db = Database::default();
        let activities = "activity a { priority = 1 period = 10 } activity b { priority = 2 period = 20 }
            activity c { priority = 3 period = 50 }";
        let (project, of) = deployed(&db, activities, "fa = 3\nfb = 6\nfc = 14\n");
        let query = Query::shown(&db, project, of);
        let search = TimingSearch::new(Variants::new(&db, project, of, query, MOST_STEPS)).unwrap();
        assert!(!search.now.schedulable());
        let found = search.optimal().unwrap();
        let BetterTiming::Change(TimingChange::OptimalPriorities, fields) = found else {
            panic!("{found:?}")
        };
        let report = response_times_if(&db, project, of, query, &fields);
        assert!(report.schedulable());
        let responses: Vec<_> = report.activities.iter().filter_map(|it| it.response).collect();
        assert_eq!(responses, [3, 9, 38].map(|ms| Time::from_nanos(ms * 1_000_000)));
        // Too many steps: nothing rather than half an answer.
        search.variants.left.set(3);
        assert!(search.optimal().is_none());
    }

    #[test]
    fn only_activities_that_may_delay_each_other_are_ordered() {
        let on = |cpus: [&str; 3]| {
            let [a, b, c] = cpus;
            let activities = format!(
                "activity a {{ affinity = {a} priority = 2 period = 90 }}
                activity b {{ affinity = {b} priority = 3 period = 120 }}
                activity c {{ affinity = {c} priority = 1 period = 70 }}"
            );
            changes(&activities, TIMES, None)
        };
        assert_eq!(on(["1", "2", "4"]), [] as [&str; 0]);
        assert_eq!(on(["1", "1", "4"]), ["a priority = 3, b priority = 2"]);
        // `a` may run where `b` does and where `c` does: so all of them have one order.
        assert_eq!(on(["3", "1", "2"]), ["c priority = 3, b priority = 1"]);
    }

    #[test]
    fn equal_priorities_get_an_order() {
        let activities = "activity a { priority = 5 period = 100 } activity b { priority = 5 period = 90 }
            activity c { priority = background }";
        assert_eq!(changes(activities, TIMES, None), ["b priority = 2, a priority = 1"]);
    }

    #[test]
    fn priorities_are_swapped_with_a_higher_one_of_a_later_deadline() {
        let of_a = |b: &str| {
            let activities = format!(
                "activity a {{ priority = 5 period = 100 }} activity b {{ {b} }} activity c {{ priority = background }}"
            );
            let found = changes(&activities, TIMES, Some(0));
            found.into_iter().filter(|it| it.contains("priority")).collect::<Vec<_>>()
        };
        assert_eq!(of_a("priority = 6 period = 101"), ["a priority = 6, b priority = 5"]);
        for b in ["priority = 6 period = 100", "priority = 5 period = 101", "priority = 4 period = 101"] {
            assert_eq!(of_a(b), [] as [&str; 0], "{b}");
        }
    }

    #[test]
    fn one_free_priority_is_enough_where_it_is() {
        let of = |index, a: &str, b: &str| {
            let activities = format!(
                "activity a {{ priority = {a} period = 100 deadline = 25 }} activity b {{ priority = {b} period = 100 }}
                activity c {{ priority = background }}"
            );
            let found = changes(&activities, TIMES, index).into_iter();
            found.filter(|it| it.contains("priority") && !it.contains(',')).collect::<Vec<_>>()
        };
        // `a` has 10 ms of its own, and 20 ms of `b`.
        assert_eq!(of(Some(0), "1", "9"), ["a priority = 10"]);
        assert_eq!(of(None, "2", "9"), ["a priority = 10"]);
        assert_eq!(of(Some(1), "2", "9"), ["b priority = 1"]);
        assert_eq!(of(None, "2", "99"), ["b priority = 1"]);
        // None is free above 99 and below 1.
        assert_eq!(of(None, "1", "99"), [] as [&str; 0]);
        assert_eq!(of(None, "9", "1"), [] as [&str; 0]);
    }

    #[test]
    fn a_later_deadline_is_the_earliest_that_is_met() {
        let of_a = |period: &str| {
            let activities = format!(
                "activity a {{ priority = 1 period = {period} deadline = 25 }} activity b {{ priority = 9 period = 100 }}
                activity c {{ priority = background }}"
            );
            let found = changes(&activities, TIMES, Some(0)).into_iter();
            found.filter(|it| it.contains("deadline")).collect::<Vec<_>>()
        };
        // It responds after 30 ms.
        assert_eq!(of_a("100"), ["a deadline = 30.1"]);
        assert_eq!(of_a("30.05"), ["a deadline = 30.05"]);
        assert_eq!(of_a("30"), [] as [&str; 0]);
    }

    #[test]
    fn an_unknown_deadline_has_no_place_in_the_order() {
        let activities = "activity a { priority = 3 period = 100 } activity b { priority = 2 period = 0 }
            activity c { priority = 1 period = 90 }";
        assert_eq!(changes(activities, TIMES, None), [] as [&str; 0]);
    }

    #[test]
    fn an_activity_moves_where_all_deadlines_are_met() {
        let activities = |c: &str| {
            format!(
                "activity a {{ affinity = 2 priority = 5 period = 100 deadline = 35 }}
                activity b {{ affinity = 4 priority = 5 period = 100 deadline = 35 }}
                activity c {{ affinity = 1 priority = {c} period = 35 }}"
            )
        };
        let moves = |c: &str, times: &str| {
            let found = changes(&activities(c), times, Some(2));
            found.into_iter().filter(|it| it.contains("affinity")).collect::<Vec<_>>()
        };
        // The CPU where `c` responds first comes first: 4 + 10 ms with `b`, 4 + 20 ms with `a`.
        let times = "fa = 20\nfb = 10\nfc = 4\n";
        assert_eq!(moves("1", times), ["c affinity = 4", "c affinity = 2"]);
        // Before `a`, 20 ms of `c` and 20 ms of its own would be more than 35 ms; before `b`, 20 + 10 ms are not.
        assert_eq!(moves("9", "fa = 20\nfb = 10\nfc = 20\n"), ["c affinity = 4"]);
        // Without a time, `c` has no figure on any CPU.
        assert_eq!(moves("1", "fa = 20\nfb = 10\n"), [] as [&str; 0]);
    }

    #[test]
    fn periods_have_steps_of_at_most_a_hundredth() {
        let alone = |time: &str, fields: &str| {
            let activities = format!(
                "activity a {{ priority = 1 {fields} }} activity b {{ priority = background }}
                activity c {{ priority = background }}"
            );
            changes(&activities, &format!("fa = {time}\n"), Some(0))
        };
        assert_eq!(alone("3.25", "period = 20"), ["a period = 3.3"]);
        assert_eq!(alone("3.25", "period = 200"), ["a period = 4"]);
        assert_eq!(alone("0.00001", "period = 0.00005"), ["a period = 0.000011"]);
        // One step less is too short.
        assert_eq!(alone("10", "period = 10"), [] as [&str; 0]);
    }

    #[test]
    fn a_deadline_that_is_the_new_period_stays() {
        // In the 150 ms of `c`: 20 ms of its own, and three times 40 ms; with a period of 46 ms, four times.
        let activities =
            "activity a { priority = 2 period = 100 deadline = 47 } activity b { priority = background }
            activity c { priority = 1 period = 200 deadline = 150 }";
        assert_eq!(changes(activities, "fa = 40\nfc = 20\n", Some(0)), ["a period = 47"]);
    }

    #[test]
    fn the_activities_of_a_thread_change_together() {
        let with = |thread: &str, c: &str| {
            format!("activity drivers {{ instances = [a, b] {thread} }} activity c {{ {c} }}")
        };
        // One of them stands for the thread.
        let inverted = with("priority = 1 period = 60", "priority = 5 period = 90");
        assert_eq!(changes(&inverted, TIMES, None), ["a priority = 5, c priority = 1"]);
        for index in [0, 1] {
            let found = changes(&inverted, TIMES, Some(index));
            assert!(
                found.contains(&format!("{} priority = 5, c priority = 1", ["a", "b"][index])),
                "{found:?}"
            );
        }
        // `b` ends after 30 ms of `c`, 10 of `a` and 20 of its own.
        let late = with("priority = 1 period = 90", "priority = 2 period = 80");
        assert_eq!(changes(&late, TIMES, Some(1)), ["b period = 60.1"]);
        // `a` alone would meet its deadline below `c`, and `b` does not.
        let db = Database::default();
        let activities =
            with("priority = 1 period = 100 deadline = 50", "priority = 2 period = 100 deadline = 35");
        let (project, of) = deployed(&db, &activities, TIMES);
        let query = Query::shown(&db, project, of);
        let search = TimingSearch::new(Variants::new(&db, project, of, query, MOST_STEPS)).unwrap();
        let found = search.optimal();
        assert_eq!(found, Some(BetterTiming::NoPriorities(vec!["c".into(), "a".into()])));
    }

    #[test]
    fn a_deadline_beyond_the_period_stays() {
        let activities = "activity a { priority = 2 period = 100 deadline = 150 }
            activity b { priority = background } activity c { priority = background }";
        assert_eq!(changes(activities, "fa = 40\n", Some(0)), ["a period = 40"]);
    }

    #[test]
    fn a_longer_period_may_help_another_activity() {
        // 30 ms of `c` and 40 ms of `a` fit into one period of `a`; with a shorter one, `a` overloads the CPU or comes twice.
        let activities = "activity a { priority = 2 period = 50 } activity b { priority = background }
            activity c { priority = 1 period = 100 }";
        assert_eq!(changes(activities, "fa = 40\nfc = 30\n", Some(0)), ["a period = 70"]);
    }
}
