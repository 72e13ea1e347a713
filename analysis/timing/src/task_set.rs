//! Task sets as files, in JSON: what a deployment runs, or what one component may execute, with everything that the
//! analysis reads of it. Response times are computed from such a file as from the model that it was made of.
//!
//! ```json
//! {
//!   "format": "mauve-3",
//!   "unit": "ns",
//!   "digest": "6f0c8d0a1b2c3d4e",
//!   "deployment": {
//!     "name": "Robot",
//!     "levels": [0.001, 0.0001],
//!     "significance": 0.0001,
//!     "cpus": 1,
//!     "rt_throttling": null,
//!     "not_analysed": [],
//!     "other": [],
//!     "operations": [],
//!     "activities": [
//!       {
//!         "instance": "laser",
//!         "component": "Laser",
//!         "affinity": 1,
//!         "priority": 10,
//!         "period": 100000000,
//!         "deadline": 100000000,
//!         "jitter": 0,
//!         "offset": null,
//!         "not_analysed": [],
//!         "doubt": null,
//!         "machine": {
//!           "states": [{ "state": "update", "first": ["update"] }],
//!           "initial": "update",
//!           "overhead": [0, 0],
//!           "component_time": [null, null],
//!           "assumed": [],
//!           "programs": [{ "program": "update", "time": [40000000, 43000000] }],
//!           "edges": [
//!             {
//!               "source": "update", "target": "update", "transition": null,
//!               "first": 1, "then": [], "cost": [40000000, 43000000]
//!             }
//!           ]
//!         }
//!       }
//!     ]
//!   }
//! }
//! ```
//!
//! The edges of a state execute its `run` and its guards first, up to the guard of the transition that fires. So the state
//! has one list of these programs, `first`, and an edge has the number of those that it executes: with a list for each edge,
//! the size would be quadratic in the number of transitions. Files of earlier formats are refused: `mauve-1`, which had these
//! lists, and `mauve-2`, which had no jitters, offsets, `other` and `operations`.
//!
//! A response time is a safety claim, and a file may be damaged. So what could not be analysed is in it with its reason,
//! never left out; every key must be there, and no other; times are whole nanoseconds; whatever does not fit together is
//! refused ([`Exported::parse`]). The digest is that of the meaning of the rest: what was changed since is refused too. A file
//! that somebody wrote himself has none ([`Parsed::is_sealed`]).

mod error;
mod json;

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use self::error::{TaskSetError, Times, Unknown};
use self::json::{items, line, lines, nullable};
use crate::level::MOST_LEVELS;
pub use crate::task::Priority;
use crate::{Edge as Period, Level, Method, StateMachine, Time};

/// The content of a file.
#[derive(Clone, PartialEq, Debug)]
pub enum Exported {
    /// What a deployment runs.
    Deployment(TaskSet),
    /// What a component may execute.
    Component(Component),
}

/// A file that was read.
#[derive(Clone, PartialEq, Debug)]
pub struct Parsed {
    /// Its content.
    pub content: Exported,
    /// Has it a digest? Then it is as MAUVE wrote it.
    pub is_sealed: bool,
}

/// What a deployment runs, at each of its levels.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSet {
    /// The name of the deployment.
    pub name: String,
    /// The section that names its own timing tables, such as `Sea`; none for the general ones.
    #[serde(default)]
    pub times: Option<String>,
    /// The significance levels; every array of times has one for each, in their order.
    pub levels: Vec<Level>,
    /// The level that is shown when none is asked for.
    pub significance: Level,
    /// The CPUs that there are, a bit each.
    pub cpus: u64,
    /// Whether Linux reserves 50 ms of each second for non-real-time tasks. `None` if the configuration does not say:
    /// then no throttling is assumed.
    #[serde(deserialize_with = "nullable")]
    pub rt_throttling: Option<bool>,
    /// Why nothing of it can be analysed: an activity or a time may be missing.
    pub not_analysed: Vec<String>,
    /// Real-time work that is not in the model.
    pub other: Vec<Other>,
    /// The connected operations that take time. One that sends calls is before those that it sends them to.
    pub operations: Vec<Called>,
    /// In the order of the deployment.
    pub activities: Vec<Activity>,
}

/// What a component may execute, at each of its levels.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Its library and its name: `motion.Navigation`.
    pub name: String,
    /// The section that names the timing tables of the deployment that executes it, such as `Sea`; none for the general ones.
    #[serde(default)]
    pub times: Option<String>,
    /// The significance levels; every array of times has one for each, in their order.
    pub levels: Vec<Level>,
    /// Why it cannot be analysed.
    pub not_analysed: Vec<NotAnalysed>,
    /// Its state machine; none where it cannot be analysed at any level.
    #[serde(deserialize_with = "nullable")]
    pub machine: Option<Machine>,
}

/// An activity of a deployment.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Activity {
    /// The instance.
    pub instance: String,
    /// The name of its component.
    pub component: String,
    /// The CPUs that it may use, a bit each; unknown where it is `None`.
    #[serde(deserialize_with = "nullable")]
    pub affinity: Option<u64>,
    /// Its priority.
    pub priority: Priority,
    /// T.
    #[serde(deserialize_with = "nullable")]
    pub period: Option<Time>,
    /// D.
    #[serde(deserialize_with = "nullable")]
    pub deadline: Option<Time>,
    /// J, the greatest delay of a release.
    pub jitter: Time,
    /// The offset of its releases in the period, less than the period, if its clock is synchronised.
    #[serde(deserialize_with = "nullable")]
    pub offset: Option<Time>,
    /// Why it cannot be analysed.
    pub not_analysed: Vec<NotAnalysed>,
    /// Why its priority counts as unknown although one is written, in words that follow its name.
    #[serde(deserialize_with = "nullable")]
    pub doubt: Option<String>,
    /// What its jobs execute; none where that is not known at any level, and in the background.
    #[serde(deserialize_with = "nullable")]
    pub machine: Option<Machine>,
}

/// Real-time work that is not in the model, such as an interrupt thread or a driver: it interferes as an activity does.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Other {
    /// Its name; no two have the same.
    pub name: String,
    /// The CPUs that it may use, a bit each; not 0.
    #[serde(rename = "affinity")]
    pub cpus: u64,
    /// Its priority, 1 to 99.
    pub priority: u32,
    /// T, the least time between two releases; greater than 0.
    pub period: Time,
    /// J, the greatest delay of a release.
    pub jitter: Time,
    /// The greatest execution time of a release.
    pub time: Time,
}

/// An operation that an activity executes for a client, which sends calls to it.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Called {
    /// Its name.
    pub operation: String,
    /// The instance that executes it.
    pub provider: String,
    /// The instance that sends the calls.
    pub client: String,
    /// The greatest number of calls that one job of the client sends, or one execution of the operation `during`.
    pub sends: u64,
    /// The number of the operation that sends the calls, an earlier one that the client executes; none for a job.
    #[serde(deserialize_with = "nullable")]
    pub during: Option<usize>,
    /// The execution time of one call.
    pub time: Vec<Time>,
}

/// Why something cannot be analysed.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotAnalysed {
    /// In words for the user.
    pub reason: String,
    /// Where that is so: `None` is at every level.
    #[serde(deserialize_with = "nullable")]
    pub levels: Option<Vec<Level>>,
    /// Is that so for [`Method::Classic`] only?
    pub classic_only: bool,
}

impl NotAnalysed {
    /// Does it hold at this level, by this method?
    pub fn holds(&self, level: Level, method: Method) -> bool {
        self.levels.as_ref().is_none_or(|levels| levels.contains(&level))
            && (!self.classic_only || method == Method::Classic)
    }
}

/// A periodic state machine, with its times at each level: no time where it cannot be analysed.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// The states; no two have the same name.
    pub states: Vec<State>,
    /// The initial one.
    pub initial: String,
    /// Dispatch and context switches, which every edge has.
    pub overhead: Vec<Option<Time>>,
    /// The declared time of the component, for [`Method::Classic`] only, if there is one.
    pub component_time: Vec<Option<Time>>,
    /// The codels whose time is assumed.
    pub assumed: Vec<Assumed>,
    /// The programs that edges execute.
    pub programs: Vec<Program>,
    /// What one period may execute.
    pub edges: Vec<Edge>,
}

/// A state of a machine.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Its name.
    pub state: String,
    /// The programs that its edges execute first, in order.
    pub first: Vec<String>,
}

/// A codel that no timing table has, and the time that it is assumed to take.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assumed {
    /// `library.name`.
    pub codel: String,
    /// Its time, at every level.
    pub time: Time,
}

/// A program of a component.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Its key: `update`, `Idle.run`, `Idle.go.guard`.
    pub program: String,
    /// What it takes.
    pub time: Vec<Option<Time>>,
}

/// One period of a machine.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edge {
    /// The state at its start.
    pub source: String,
    /// The state at its end.
    pub target: String,
    /// The transition that fires; none where the machine stays.
    #[serde(deserialize_with = "nullable")]
    pub transition: Option<String>,
    /// The number of programs that it executes of the `first` of its source.
    pub first: usize,
    /// What it executes after those, in that order.
    pub then: Vec<String>,
    /// What all of it takes, the overhead with it.
    pub cost: Vec<Option<Time>>,
}

/// What a file is, as it stands there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(rename = "format")]
    _format: String,
    unit: String,
    digest: Option<String>,
    deployment: Option<TaskSet>,
    component: Option<Component>,
}

/// The only format that is read.
pub const FORMAT: &str = "mauve-3";

/// Returns whether a text has the digest of its content, in this format or in an earlier one: MAUVE wrote it.
pub fn is_sealed(text: &str) -> bool {
    let Ok(Value::Object(mut document)) = serde_json::from_str(text) else { return false };
    let digest = document.remove("digest");
    let format = document.get("format").and_then(Value::as_str).unwrap_or_default();
    format.starts_with("mauve-") && digest == Some(Value::String(digest_of(&Value::Object(document))))
}

/// The digest of a document without one: of its meaning, whatever the white space and the order of the keys. FNV-1a: it is
/// to find damage, and no forgery.
fn digest_of(document: &Value) -> String {
    let hash = document
        .to_string()
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
    format!("{hash:016x}")
}

/// A task set has no more operations.
pub const MOST_OPERATIONS: usize = 1 << 16;

/// A task set has no more activities: what they tell of each other grows with the square.
pub const MOST_ACTIVITIES: usize = 2896;

impl Exported {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// The error and its location: the text is not JSON, a key is missing or unknown, a value is invalid or
    /// inconsistent, or the file was changed since it was written.
    pub fn parse(text: &str) -> Result<Parsed, TaskSetError> {
        #[derive(Deserialize)]
        struct Head {
            format: Option<String>,
        }
        let document: Document = match (serde_json::from_str(text), serde_json::from_str(text)) {
            (Ok(Head { format: None }), _) => {
                return Err(TaskSetError::NoFormat);
            }
            (Ok(Head { format: Some(format) }), _) if format != FORMAT => {
                return Err(TaskSetError::OtherFormat(format));
            }
            (_, document) => document.map_err(|error| TaskSetError::Json(error.to_string()))?,
        };
        if document.unit != "ns" {
            return Err(TaskSetError::OtherUnit(document.unit));
        }
        let content = match (document.deployment, document.component) {
            (Some(set), None) => Exported::Deployment(set),
            (None, Some(component)) => Exported::Component(component),
            _ => return Err(TaskSetError::NoContent),
        };
        if document.digest.as_ref().is_some_and(|digest| *digest != content.digest()) {
            return Err(TaskSetError::OtherDigest);
        }
        match &content {
            Exported::Deployment(set) => set.check()?,
            Exported::Component(component) => component.check()?,
        }
        Ok(Parsed { content, is_sealed: document.digest.is_some() })
    }

    /// The text of the file, which ends with a line break: the same for the same content.
    pub fn to_json(&self) -> String {
        self.write(Some(&self.digest()))
    }

    fn digest(&self) -> String {
        digest_of(&serde_json::from_str(&self.write(None)).unwrap_or_default())
    }

    fn write(&self, digest: Option<&str>) -> String {
        let mut fields = vec![("format", line(FORMAT)), ("unit", line("ns"))];
        fields.extend(digest.map(|digest| ("digest", line(digest))));
        fields.push(match self {
            Exported::Deployment(set) => ("deployment", set.write()),
            Exported::Component(component) => ("component", component.write()),
        });
        lines(0, &fields) + "\n"
    }
}

impl TaskSet {
    /// The number of a level, which is that of its time in every array.
    pub fn column(&self, level: Level) -> Option<usize> {
        self.levels.iter().position(|&it| it == level)
    }

    fn check(&self) -> Result<(), TaskSetError> {
        let texts = self.not_analysed.iter().chain([&self.name]).chain(&self.times);
        texts.into_iter().try_for_each(|text| is_one_line(text))?;
        check_levels(&self.levels)?;
        if self.cpus == 0 {
            return Err(TaskSetError::NoCpu);
        }
        let count = self.activities.len().saturating_add(self.other.len());
        if count > MOST_ACTIVITIES {
            return Err(TaskSetError::TooManyActivities(count));
        }
        let mut others = HashSet::new();
        for other in &self.other {
            other.check().map_err(|error| TaskSetError::OfOther(other.name.clone(), Box::new(error)))?;
            if !others.insert(&other.name) {
                return Err(TaskSetError::RepeatedOther(other.name.clone()));
            }
        }
        let mut known: HashMap<&str, &Activity> = HashMap::new();
        for activity in &self.activities {
            let name = &activity.instance;
            activity.check(self).map_err(|error| TaskSetError::OfActivity(name.clone(), Box::new(error)))?;
            if let Some(first) = known.insert(name, activity)
                && !(self.is_excused(first) && self.is_excused(activity))
            {
                return Err(TaskSetError::RepeatedActivity(name.clone()));
            }
        }
        if self.operations.len() > MOST_OPERATIONS {
            return Err(TaskSetError::TooManyOperations(self.operations.len()));
        }
        for (number, called) in self.operations.iter().enumerate() {
            let check =
                || called.check(self.operations.get(..number).unwrap_or_default(), &known, &self.levels);
            check().map_err(|error| TaskSetError::OfOperation(called.operation.clone(), Box::new(error)))?;
        }
        Ok(())
    }

    /// Is it said of every level why an activity is not analysed?
    fn is_excused(&self, activity: &Activity) -> bool {
        !self.not_analysed.is_empty()
            || self.levels.iter().all(|level| has_reason(&activity.not_analysed, *level))
    }

    fn write(&self) -> String {
        let mut fields = heading(&self.name, self.times.as_ref());
        fields.extend([
            ("levels", line(&self.levels)),
            ("significance", line(&self.significance)),
            ("cpus", line(&self.cpus)),
            ("rt_throttling", line(&self.rt_throttling)),
            ("not_analysed", line(&self.not_analysed)),
            ("other", items(2, self.other.iter().map(line))),
            ("operations", items(2, self.operations.iter().map(line))),
            ("activities", items(2, self.activities.iter().map(Activity::write))),
        ]);
        lines(1, &fields)
    }
}

/// Returns the first fields of what a file exports.
fn heading(name: &String, times: Option<&String>) -> Vec<(&'static str, String)> {
    [("name", Some(name)), ("times", times)]
        .into_iter()
        .filter_map(|(key, text)| Some((key, line(text?))))
        .collect()
}

impl Other {
    fn check(&self) -> Result<(), TaskSetError> {
        is_one_line(&self.name)?;
        if self.period == Time::ZERO {
            return Err(TaskSetError::NoPeriod);
        }
        if !(1..=99).contains(&self.priority) {
            return Err(TaskSetError::NoPriority(self.priority));
        }
        if self.cpus == 0 {
            return Err(TaskSetError::NoCpu);
        }
        Ok(())
    }
}

impl Called {
    fn check(
        &self,
        earlier: &[Called],
        known: &HashMap<&str, &Activity>,
        levels: &[Level],
    ) -> Result<(), TaskSetError> {
        is_one_line(&self.operation)?;
        for instance in [&self.provider, &self.client] {
            if !known.contains_key(instance.as_str()) {
                return Err(TaskSetError::NoActivity(instance.clone()));
            }
        }
        if let Some(during) = self.during
            && earlier.get(during).is_none_or(|sender| sender.provider != self.client)
        {
            return Err(TaskSetError::NoOperation(during));
        }
        if self.time.len() != levels.len() {
            let (times, levels) = (self.time.len(), levels.len());
            return Err(TaskSetError::OtherCount { of: Times::Operation, times, levels });
        }
        Ok(())
    }
}

impl Component {
    fn check(&self) -> Result<(), TaskSetError> {
        [&self.name].into_iter().chain(&self.times).try_for_each(|text| is_one_line(text))?;
        check_levels(&self.levels)?;
        check_reasons(&self.not_analysed, &self.levels)?;
        if let Some(machine) = &self.machine {
            machine.check(&self.levels)?;
        }
        for (column, level) in self.levels.iter().enumerate() {
            let is_known = self.machine.as_ref().is_some_and(|machine| machine.is_known(column));
            if !is_known && !has_reason(&self.not_analysed, *level) {
                return Err(TaskSetError::NoReason(Unknown::Times, *level));
            }
        }
        Ok(())
    }

    fn write(&self) -> String {
        let mut fields = heading(&self.name, self.times.as_ref());
        fields.extend([
            ("levels", line(&self.levels)),
            ("not_analysed", items(2, self.not_analysed.iter().map(line))),
            ("machine", Machine::write(self.machine.as_ref(), 2)),
        ]);
        lines(1, &fields)
    }
}

impl Activity {
    fn check(&self, set: &TaskSet) -> Result<(), TaskSetError> {
        [&self.instance, &self.component]
            .into_iter()
            .chain(&self.doubt)
            .try_for_each(|text| is_one_line(text))?;
        check_reasons(&self.not_analysed, &set.levels)?;
        if self.period == Some(Time::ZERO) || self.deadline == Some(Time::ZERO) {
            return Err(TaskSetError::NoPeriod);
        }
        if self.period.zip(self.deadline).is_some_and(|(period, deadline)| deadline > period) {
            return Err(TaskSetError::LateDeadline);
        }
        if self.period.zip(self.offset).is_some_and(|(period, offset)| offset >= period) {
            return Err(TaskSetError::LateOffset);
        }
        if let Some(machine) = &self.machine {
            if self.priority == Priority::Background {
                return Err(TaskSetError::BackgroundMachine);
            }
            machine.check(&set.levels)?;
        }
        if self.priority == Priority::Background || !set.not_analysed.is_empty() {
            return Ok(());
        }
        for (column, level) in set.levels.iter().enumerate() {
            if has_reason(&self.not_analysed, *level) {
                continue;
            }
            let unknown = if !self.machine.as_ref().is_some_and(|machine| machine.is_known(column)) {
                Unknown::Times
            } else if self.priority == Priority::Unknown {
                Unknown::Priority
            } else if self.period.is_none() || self.deadline.is_none() {
                Unknown::PeriodOrDeadline
            } else if !self.affinity.is_some_and(|cpus| cpus != 0 && cpus & !set.cpus == 0) {
                Unknown::Cpu
            } else {
                continue;
            };
            return Err(TaskSetError::NoReason(unknown, *level));
        }
        Ok(())
    }

    fn write(&self) -> String {
        lines(
            3,
            &[
                ("instance", line(&self.instance)),
                ("component", line(&self.component)),
                ("affinity", line(&self.affinity)),
                ("priority", line(&self.priority)),
                ("period", line(&self.period)),
                ("deadline", line(&self.deadline)),
                ("jitter", line(&self.jitter)),
                ("offset", line(&self.offset)),
                ("not_analysed", items(4, self.not_analysed.iter().map(line))),
                ("doubt", line(&self.doubt)),
                ("machine", Machine::write(self.machine.as_ref(), 4)),
            ],
        )
    }
}

impl Machine {
    /// Has it times at the level of this number?
    pub fn is_known(&self, column: usize) -> bool {
        self.overhead.get(column).is_some_and(Option::is_some)
    }

    /// The machine that the analysis reads, at the level of this number; its edges are those of this one, in their order.
    /// None where it has no times there.
    pub fn state_machine(&self, column: usize) -> Option<StateMachine> {
        self.machine_at(&self.numbers(), column).ok().flatten()
    }

    fn numbers(&self) -> HashMap<&str, u32> {
        self.states.iter().zip(0..).map(|(it, number)| (it.state.as_str(), number)).collect()
    }

    fn machine_at(
        &self,
        numbers: &HashMap<&str, u32>,
        column: usize,
    ) -> Result<Option<StateMachine>, TaskSetError> {
        if !self.is_known(column) {
            return Ok(None);
        }
        let number = |edge: usize, name: &String| {
            let number = numbers.get(name.as_str()).copied();
            number.ok_or_else(|| TaskSetError::NoState { edge, state: name.clone() })
        };
        let mut edges = Vec::with_capacity(self.edges.len());
        for (index, edge) in self.edges.iter().enumerate() {
            let (source, target) = (number(index, &edge.source)?, number(index, &edge.target)?);
            let cost = edge.cost.get(column).copied().flatten();
            edges.push(Period { source, target, cost: cost.ok_or(TaskSetError::NoCost(index))? });
        }
        let states = u32::try_from(self.states.len()).unwrap_or(u32::MAX);
        StateMachine::new(states, edges).map(Some).map_err(TaskSetError::Machine)
    }

    fn check(&self, levels: &[Level]) -> Result<(), TaskSetError> {
        let transitions = self.edges.iter().filter_map(|edge| edge.transition.as_ref());
        let assumed = self.assumed.iter().map(|it| &it.codel);
        let programs = self.programs.iter().map(|it| &it.program);
        let texts = self.states.iter().map(|it| &it.state).chain(transitions).chain(assumed).chain(programs);
        texts.into_iter().try_for_each(|text| is_one_line(text))?;
        let numbers = self.numbers();
        if numbers.len() < self.states.len() {
            return Err(TaskSetError::RepeatedState);
        }
        if !numbers.contains_key(self.initial.as_str()) {
            return Err(TaskSetError::NoInitialState(self.initial.clone()));
        }
        let all: HashMap<&str, &Program> = self.programs.iter().map(|it| (it.program.as_str(), it)).collect();
        if all.len() < self.programs.len() {
            return Err(TaskSetError::RepeatedProgram);
        }
        check_times(Times::Overhead, &self.overhead, levels)?;
        check_times(Times::ComponentTime, &self.component_time, levels)?;
        for program in &self.programs {
            self.check_column(Times::Program(program.program.clone()), &program.time, levels)?;
        }
        for (index, edge) in self.edges.iter().enumerate() {
            self.check_column(Times::Edge(index), &edge.cost, levels)?;
        }
        for column in 0..levels.len() {
            self.check_costs(&numbers, &all, column)?;
        }
        for column in 0..levels.len() {
            self.machine_at(&numbers, column)?;
        }
        Ok(())
    }

    /// No edge costs less than what it executes.
    fn check_costs(
        &self,
        numbers: &HashMap<&str, u32>,
        programs: &HashMap<&str, &Program>,
        column: usize,
    ) -> Result<(), TaskSetError> {
        let add = |sum: Option<Time>, program: &Program| {
            let time = program.time.get(column).copied().flatten();
            sum.zip(time).and_then(|(sum, time)| sum.checked_add(time))
        };
        let overhead = self.overhead.get(column).copied().flatten();
        // For each state, the sums of the first programs of its list.
        let mut sums: Vec<Vec<Option<Time>>> = Vec::with_capacity(self.states.len());
        for State { state, first } in &self.states {
            let mut after = vec![overhead];
            for name in first {
                let no_program =
                    || TaskSetError::NoProgramOfState { state: state.clone(), program: name.clone() };
                let program = programs.get(name.as_str()).ok_or_else(no_program)?;
                after.push(add(after.last().copied().flatten(), program));
            }
            sums.push(after);
        }
        for (index, edge) in self.edges.iter().enumerate() {
            let source = numbers.get(edge.source.as_str()).and_then(|&number| sums.get(number as usize));
            let no_state = || TaskSetError::NoState { edge: index, state: edge.source.clone() };
            let source = source.ok_or_else(no_state)?;
            let mut sum = *source.get(edge.first).ok_or(TaskSetError::MoreFirst(index))?;
            for name in &edge.then {
                let no_program = || TaskSetError::NoProgram { edge: index, program: name.clone() };
                sum = add(sum, programs.get(name.as_str()).ok_or_else(no_program)?);
            }
            let cost = edge.cost.get(column).copied().flatten();
            if cost.is_some_and(|cost| sum.is_none_or(|sum| sum > cost)) {
                return Err(TaskSetError::LowCost(index));
            }
        }
        Ok(())
    }

    /// A time wherever the machine has any, and nowhere else.
    fn check_column(&self, of: Times, times: &[Option<Time>], levels: &[Level]) -> Result<(), TaskSetError> {
        check_times(of.clone(), times, levels)?;
        let differs = |(time, overhead): (&Option<Time>, &Option<Time>)| time.is_some() != overhead.is_some();
        match times.iter().zip(&self.overhead).position(differs) {
            Some(column) => Err(TaskSetError::OtherLevels(of, levels.get(column).copied())),
            None => Ok(()),
        }
    }

    fn write(machine: Option<&Machine>, depth: usize) -> String {
        let Some(machine) = machine else { return line(&()) };
        lines(
            depth,
            &[
                ("states", items(depth + 1, machine.states.iter().map(line))),
                ("initial", line(&machine.initial)),
                ("overhead", line(&machine.overhead)),
                ("component_time", line(&machine.component_time)),
                ("assumed", items(depth + 1, machine.assumed.iter().map(line))),
                ("programs", items(depth + 1, machine.programs.iter().map(line))),
                ("edges", items(depth + 1, machine.edges.iter().map(line))),
            ],
        )
    }
}

/// Is there a reason why it is not analysed at this level by any method?
fn has_reason(reasons: &[NotAnalysed], level: Level) -> bool {
    reasons.iter().any(|it| it.holds(level, Method::Psm))
}

/// A terminal obeys control characters.
fn is_one_line(text: &str) -> Result<(), TaskSetError> {
    if text.chars().any(char::is_control) {
        return Err(TaskSetError::ControlCharacter(text.to_owned()));
    }
    Ok(())
}

fn check_levels(levels: &[Level]) -> Result<(), TaskSetError> {
    if levels.len() > MOST_LEVELS {
        return Err(TaskSetError::TooManyLevels(levels.len()));
    }
    let mut seen = HashSet::new();
    match levels.iter().find(|level| !seen.insert(**level)) {
        Some(level) => Err(TaskSetError::RepeatedLevel(*level)),
        None if levels.is_empty() => Err(TaskSetError::NoLevels),
        None => Ok(()),
    }
}

fn check_reasons(reasons: &[NotAnalysed], levels: &[Level]) -> Result<(), TaskSetError> {
    for it in reasons {
        is_one_line(&it.reason)?;
        if let Some(level) = it.levels.iter().flatten().find(|level| !levels.contains(level)) {
            return Err(TaskSetError::ReasonForOtherLevel(*level));
        }
    }
    Ok(())
}

/// A time for each level; what is exceeded more rarely is not shorter.
fn check_times(of: Times, times: &[Option<Time>], levels: &[Level]) -> Result<(), TaskSetError> {
    if times.len() != levels.len() {
        return Err(TaskSetError::OtherCount { of, times: times.len(), levels: levels.len() });
    }
    let mut known: Vec<(Level, Time)> =
        levels.iter().zip(times).filter_map(|(level, time)| Some((*level, (*time)?))).collect();
    known.sort_by_key(|(level, _)| std::cmp::Reverse(*level));
    match known.is_sorted_by_key(|(_, time)| *time) {
        true => Ok(()),
        false => Err(TaskSetError::FallingTimes(of)),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    use super::*;
    use crate::Demand;

    fn level(probability: f64) -> Level {
        Level::from_f64(probability).unwrap()
    }

    fn times(nanos: [u64; 2]) -> Vec<Option<Time>> {
        nanos.map(|nanos| Some(Time::from_nanos(nanos))).to_vec()
    }

    /// One activity of two states that is analysed by `psm`, one of which a time is missing at 1e-9, one in the background.
    fn example() -> Exported {
        let names = |names: &[&str]| names.iter().map(|it| (*it).to_owned()).collect();
        let edge = |source: &str, target: &str, transition: Option<&str>, then: &[&str], cost| Edge {
            source: source.to_owned(),
            target: target.to_owned(),
            transition: transition.map(str::to_owned),
            first: usize::from(source == "Idle"),
            then: names(then),
            cost: times(cost),
        };
        let state = |state: &str, first: &[&str]| State { state: state.to_owned(), first: names(first) };
        let program = |name: &str, time| Program { program: name.to_owned(), time: times(time) };
        let machine = Machine {
            states: vec![state("Idle", &["Idle.run"]), state("Busy", &[])],
            initial: "Idle".to_owned(),
            overhead: times([3, 4]),
            component_time: vec![Some(Time::from_nanos(900)), None],
            assumed: vec![Assumed { codel: "pilot.turn".to_owned(), time: Time::from_nanos(5) }],
            programs: vec![program("Idle.run", [10, 20]), program("Busy.entry", [70, 70])],
            edges: vec![
                edge("Idle", "Idle", None, &[], [13, 24]),
                edge("Idle", "Busy", Some("go"), &["Busy.entry"], [83, 94]),
                edge("Busy", "Idle", Some("back"), &[], [3, 4]),
            ],
        };
        let always = Time::from_nanos(1000);
        let activity = |instance: &str, priority| Activity {
            instance: instance.to_owned(),
            component: "Pilot".to_owned(),
            affinity: Some(1),
            priority,
            period: Some(always),
            deadline: Some(always),
            jitter: Time::from_nanos(7),
            offset: Some(Time::from_nanos(8)),
            not_analysed: Vec::new(),
            doubt: None,
            machine: None,
        };
        let reason = |reason: &str, at: f64, classic_only| NotAnalysed {
            reason: reason.to_owned(),
            levels: Some(vec![level(at)]),
            classic_only,
        };
        let front = Activity {
            not_analysed: vec![reason("no time for component `Pilot`", 1e-9, true)],
            machine: Some(machine.clone()),
            ..activity("front", Priority::RealTime(2))
        };
        let mut partial = machine;
        let without = |times: &mut Vec<Option<Time>>| times[1] = None;
        partial.programs.iter_mut().for_each(|it| without(&mut it.time));
        partial.edges.iter_mut().for_each(|it| without(&mut it.cost));
        without(&mut partial.overhead);
        let rear = Activity {
            not_analysed: vec![reason("no time for codel `pilot.look`", 1e-9, false)],
            doubt: Some("whose priority may be \"meant\"".to_owned()),
            machine: Some(partial),
            ..activity("rear", Priority::RealTime(1))
        };
        let idle = Activity { period: None, deadline: None, ..activity("idle", Priority::Background) };
        Exported::Deployment(TaskSet {
            name: "D".to_owned(),
            times: Some("Sea".to_owned()),
            levels: vec![level(1e-3), level(1e-9)],
            significance: level(1e-3),
            cpus: 1,
            rt_throttling: Some(true),
            not_analysed: Vec::new(),
            other: vec![Other {
                name: "lan".to_owned(),
                cpus: 1,
                priority: 50,
                period: always,
                jitter: Time::from_nanos(2),
                time: Time::from_nanos(9),
            }],
            operations: vec![
                called("plan", "front", "rear", None, [3, 4]),
                called("log", "rear", "front", Some(0), [0, 5]),
            ],
            activities: vec![front, rear, idle],
        })
    }

    fn called(
        operation: &str,
        provider: &str,
        client: &str,
        during: Option<usize>,
        time: [u64; 2],
    ) -> Called {
        Called {
            operation: operation.to_owned(),
            provider: provider.to_owned(),
            client: client.to_owned(),
            sends: 2,
            during,
            time: time.map(Time::from_nanos).to_vec(),
        }
    }

    /// The example as somebody wrote it himself.
    fn unsealed() -> Value {
        let mut document: Value = serde_json::from_str(&example().to_json()).unwrap();
        document.as_object_mut().unwrap().remove("digest");
        document
    }

    /// Where every value of a document stands.
    fn pointers(document: &Value) -> Vec<String> {
        let mut found = Vec::new();
        let mut open = vec![(String::new(), document)];
        while let Some((path, value)) = open.pop() {
            match value {
                Value::Array(values) => {
                    open.extend(values.iter().enumerate().map(|(index, it)| (format!("{path}/{index}"), it)));
                }
                Value::Object(values) => {
                    open.extend(values.iter().map(|(key, it)| (format!("{path}/{key}"), it)));
                }
                _ => {}
            }
            found.push(path);
        }
        found
    }

    /// Removes what stands at a path.
    fn remove(document: &mut Value, path: &str) {
        let (parent, key) = path.rsplit_once('/').unwrap();
        match document.pointer_mut(parent).unwrap() {
            Value::Object(values) => drop(values.remove(key)),
            Value::Array(values) => drop(values.remove(key.parse().unwrap())),
            _ => unreachable!("a path goes through arrays and objects"),
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let text = example().to_json();
        assert!(text.ends_with("}\n") && !text.contains(" \n"));
        assert_eq!(Exported::parse(&text), Ok(Parsed { content: example(), is_sealed: true }));
        // White space and the order of keys mean nothing.
        let sorted: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(Exported::parse(&sorted.to_string()), Ok(Parsed { content: example(), is_sealed: true }));
        let unsealed = Exported::parse(&unsealed().to_string());
        assert_eq!(unsealed, Ok(Parsed { content: example(), is_sealed: false }));
        let Exported::Deployment(set) = example() else { unreachable!() };
        let machine = set.activities[1].machine.as_ref().unwrap();
        assert_eq!(machine.state_machine(0).unwrap().greatest_cost(), Time::from_nanos(83));
        assert_eq!(machine.state_machine(1), None);
    }

    #[test]
    fn lines_are_indented_by_their_depth() {
        let mut depth = 0;
        for line in example().to_json().lines() {
            let content = line.trim_start();
            let closed = usize::from(content.starts_with(['}', ']']));
            assert_eq!(line.len() - content.len(), 2 * (depth - closed), "{line}");
            depth += content.matches(['{', '[']).count();
            depth -= content.matches(['}', ']']).count();
        }
    }

    #[test]
    fn what_is_sealed_was_written_by_this_version_or_an_earlier_one() {
        let text = example().to_json();
        assert!(is_sealed(&text));
        assert!(!is_sealed(&unsealed().to_string()));
        assert!(!is_sealed(&text.replace("1000", "1001")));
        let earlier =
            r#"{"format": "mauve-1", "unit": "ns", "digest": "DIGEST", "component": {"states": ["update"]}}"#;
        assert!(is_sealed(&earlier.replace("DIGEST", "ce5e14b710e28c1b")));
        assert!(!is_sealed(earlier) && !is_sealed("") && !is_sealed("[]"));
    }

    #[test]
    fn nothing_may_be_missing_but_the_name_of_the_tables() {
        let whole = unsealed();
        let is_key = |path: &String| path.rsplit('/').next().is_some_and(|key| key.parse::<usize>().is_err());
        let keys: Vec<String> =
            pointers(&whole).into_iter().filter(|path| !path.is_empty() && is_key(path)).collect();
        assert!(keys.len() > 70);
        for path in keys {
            let mut document = whole.clone();
            remove(&mut document, &path);
            assert_eq!(
                Exported::parse(&document.to_string()).is_ok(),
                path == "/deployment/times",
                "without {path}"
            );
            // Nor may there be what nobody knows.
            let mut document = whole.clone();
            let (parent, _) = path.rsplit_once('/').unwrap();
            document.pointer_mut(parent).unwrap()["wcet"] = 5.into();
            assert!(Exported::parse(&document.to_string()).is_err(), "more in {parent}");
        }
    }

    #[test]
    fn a_sealed_file_is_what_it_was_or_refused() {
        let sealed: Value = serde_json::from_str(&example().to_json()).unwrap();
        let all = pointers(&sealed);
        for path in &all {
            let old = sealed.pointer(path).unwrap();
            let others = all.iter().map(|path| sealed.pointer(path).unwrap().clone());
            for other in others.chain([0.into(), 1.into(), Value::Null, u64::MAX.into(), (-1).into()]) {
                if other == *old {
                    continue;
                }
                let mut document = sealed.clone();
                *document.pointer_mut(path).unwrap() = other;
                // Without the digest, it is no longer said to be what was written.
                let is_sealed = document.get("digest").is_some_and(|digest| !digest.is_null());
                assert!(!is_sealed || Exported::parse(&document.to_string()).is_err(), "{path}: {document}");
            }
            if !["", "/digest"].contains(&path.as_str()) {
                let mut document = sealed.clone();
                remove(&mut document, path);
                assert!(Exported::parse(&document.to_string()).is_err(), "without {path}");
            }
        }
    }

    fn check(changes: &[(&str, Value)], expected: Expect) {
        let mut found = String::new();
        for (path, value) in changes {
            let mut document = unsealed();
            let path =
                path.replace("front", "/deployment/activities/0").replace("rear", "/deployment/activities/1");
            *document.pointer_mut(&path).unwrap() = value.clone();
            // On several lines, so that a place is one.
            let text = serde_json::to_string_pretty(&document).unwrap();
            found += &match Exported::parse(&text) {
                Ok(_) => "fine\n".to_owned(),
                Err(error) => format!("{error:?}\n"),
            };
        }
        expected.assert_eq(&found);
    }

    #[test]
    fn what_is_refused() {
        use serde_json::json;
        let idle = json!({ "state": "Idle", "first": ["Idle.run"] });
        let busy = json!({ "state": "Busy", "first": [] });
        check(
            &[
                ("/format", json!("mauve-2")),
                ("/unit", json!("ms")),
                ("/deployment/levels", json!([1e-3, 1e-3])),
                ("/deployment/levels", json!([1e-3, 2])),
                ("/deployment/levels", json!([])),
                ("/deployment/cpus", json!(0)),
                ("/deployment/name", json!("a\nb")),
                ("/deployment/rt_throttling", json!(1)),
                ("/deployment/other/0/name", json!("a\nb")),
                ("/deployment/other/0/affinity", json!(0)),
                ("/deployment/other/0/priority", json!(100)),
                ("/deployment/other/0/period", json!(0)),
                (
                    "/deployment/other",
                    json!([{ "name": "a", "affinity": 1, "priority": 1, "period": 1, "jitter": 0, "time": 1 }, { "name": "a", "affinity": 1, "priority": 1, "period": 1, "jitter": 0, "time": 1 }]),
                ),
                ("/deployment/operations/0/provider", json!("nobody")),
                ("/deployment/operations/0/client", json!("nobody")),
                ("/deployment/operations/0/time", json!([1])),
                ("/deployment/operations/0/during", json!(0)),
                ("/deployment/operations/1/during", json!(1)),
                ("/deployment/operations/1/client", json!("rear")),
                ("/deployment/operations/0/operation", json!("a\nb")),
                ("front/affinity", json!(2)),
                ("front/affinity", json!(3)),
                ("front/affinity", json!(null)),
                ("front/priority", json!(0)),
                ("front/priority", json!(100)),
                ("front/priority", json!("idle")),
                ("front/priority", json!(null)),
                ("front/priority", json!("background")),
                ("front/period", json!(0)),
                ("front/period", json!(-5)),
                ("front/period", json!(1.5)),
                ("front/period", json!(1e30)),
                ("front/period", json!("5 ms")),
                ("front/period", json!(null)),
                ("front/deadline", json!(1001)),
                ("front/offset", json!(null)),
                ("front/offset", json!(999)),
                ("front/offset", json!(1000)),
                ("front/jitter", json!(0)),
                ("front/jitter", json!(1001)),
                ("front/jitter", json!(-1)),
                ("front/jitter", json!(null)),
                ("front/machine", json!(null)),
                ("front/instance", json!("rear")),
                ("front/machine/states/1/state", json!("Idle")),
                ("front/machine/states", json!([idle, busy, { "state": "Lost", "first": [] }])),
                ("front/machine/states/0/first", json!(["Idle.walk"])),
                ("front/machine/states/0/first", json!(["Idle.run", "Busy.entry"])),
                ("front/machine/states/0/first", json!([])),
                ("front/machine/initial", json!("Lost")),
                ("front/machine/edges/0/source", json!("Lost")),
                ("front/machine/edges/0/then", json!(["Idle.walk"])),
                ("front/machine/edges/0/then", json!(["Idle.run"])),
                ("front/machine/edges/0/first", json!(0)),
                ("front/machine/edges/0/first", json!(2)),
                ("front/machine/edges/0/first", json!(-1)),
                ("front/machine/edges/0/cost", json!([12, 24])),
                ("front/machine/edges/0/cost", json!([13])),
                ("front/machine/edges/0/cost", json!([13, null])),
                ("front/machine/edges/1/cost", json!([100, 94])),
                ("front/machine/edges/1/cost", json!([83, u64::MAX])),
                ("front/machine/programs/0/program", json!("Busy.entry")),
                ("front/machine/programs/0/time", json!([10, 19])),
                ("front/machine/programs/0/time", json!([10, 21])),
                ("front/machine/overhead", json!([null, 4])),
                ("rear/not_analysed", json!([])),
                ("rear/not_analysed/0/levels", json!([1e-3])),
                ("rear/not_analysed/0/levels", json!([1e-5])),
                ("rear/not_analysed/0/classic_only", json!(true)),
                ("rear/machine/overhead", json!([null, null])),
            ],
            expect![[r#"
                OtherFormat("mauve-2")
                OtherUnit("ms")
                RepeatedLevel(Level { bits: 4562254508917369340 })
                Json("invalid value: floating point `2.0`, expected a probability between 0 and 1, such as 1e-4 at line 226 column 5")
                NoLevels
                NoCpu
                ControlCharacter("a\nb")
                Json("invalid type: integer `1`, expected a boolean at line 263 column 22")
                OfOther("a\nb", ControlCharacter("a\nb"))
                OfOther("lan", NoCpu)
                OfOther("lan", NoPriority(100))
                OfOther("lan", NoPeriod)
                RepeatedOther("a")
                OfOperation("plan", NoActivity("nobody"))
                OfOperation("plan", NoActivity("nobody"))
                OfOperation("plan", OtherCount { of: Operation, times: 1, levels: 2 })
                OfOperation("plan", NoOperation(0))
                OfOperation("log", NoOperation(1))
                OfOperation("log", NoOperation(0))
                OfOperation("a\nb", ControlCharacter("a\nb"))
                OfActivity("front", NoReason(Cpu, Level { bits: 4562254508917369340 }))
                OfActivity("front", NoReason(Cpu, Level { bits: 4562254508917369340 }))
                OfActivity("front", NoReason(Cpu, Level { bits: 4562254508917369340 }))
                Json("invalid value: integer `0`, expected a priority from 1 to 99, \"background\", or null where it is unknown at line 104 column 21")
                Json("invalid value: integer `100`, expected a priority from 1 to 99, \"background\", or null where it is unknown at line 104 column 23")
                Json("invalid value: string \"idle\", expected a priority from 1 to 99, \"background\", or null where it is unknown at line 104 column 26")
                OfActivity("front", NoReason(Priority, Level { bits: 4562254508917369340 }))
                OfActivity("front", BackgroundMachine)
                OfActivity("front", NoPeriod)
                Json("invalid type: integer `-5`, expected a whole number of nanoseconds at line 103 column 20")
                Json("invalid type: floating point `1.5`, expected a whole number of nanoseconds at line 103 column 21")
                Json("invalid type: floating point `1e+30`, expected a whole number of nanoseconds at line 103 column 23")
                Json("invalid type: string \"5 ms\", expected a whole number of nanoseconds at line 103 column 24")
                OfActivity("front", NoReason(PeriodOrDeadline, Level { bits: 4562254508917369340 }))
                OfActivity("front", LateDeadline)
                fine
                fine
                OfActivity("front", LateOffset)
                fine
                fine
                Json("invalid type: integer `-1`, expected a whole number of nanoseconds at line 10 column 20")
                Json("invalid type: null, expected a whole number of nanoseconds at line 10 column 22")
                OfActivity("front", NoReason(Times, Level { bits: 4562254508917369340 }))
                RepeatedActivity("rear")
                OfActivity("front", RepeatedState)
                OfActivity("front", Machine(DeadEnd { state: 2 }))
                OfActivity("front", NoProgramOfState { state: "Idle", program: "Idle.walk" })
                fine
                OfActivity("front", MoreFirst(0))
                OfActivity("front", NoInitialState("Lost"))
                OfActivity("front", NoState { edge: 0, state: "Lost" })
                OfActivity("front", NoProgram { edge: 0, program: "Idle.walk" })
                OfActivity("front", LowCost(0))
                fine
                OfActivity("front", MoreFirst(0))
                Json("invalid value: integer `-1`, expected usize at line 28 column 25")
                OfActivity("front", LowCost(0))
                OfActivity("front", OtherCount { of: Edge(0), times: 1, levels: 2 })
                OfActivity("front", OtherLevels(Edge(0), Some(Level { bits: 4472406533629990549 })))
                OfActivity("front", FallingTimes(Edge(1)))
                OfActivity("front", Machine(TooLarge))
                OfActivity("front", RepeatedProgram)
                fine
                OfActivity("front", LowCost(0))
                OfActivity("front", OtherLevels(Program("Idle.run"), Some(Level { bits: 4562254508917369340 })))
                OfActivity("rear", NoReason(Times, Level { bits: 4472406533629990549 }))
                OfActivity("rear", NoReason(Times, Level { bits: 4472406533629990549 }))
                OfActivity("rear", ReasonForOtherLevel(Level { bits: 4532020583610935537 }))
                OfActivity("rear", NoReason(Times, Level { bits: 4472406533629990549 }))
                OfActivity("rear", OtherLevels(Program("Idle.run"), Some(Level { bits: 4562254508917369340 })))
            "#]],
        );
        for text in [
            "",
            "[]",
            "null",
            "{}",
            "{\"name\": \"a\"}",
            "{\"format\": \"mauve-3\"}",
            "{\"format\": \"\u{7}\"}",
        ] {
            assert!(Exported::parse(text).is_err(), "{text}");
        }
        let twice = example().to_json().replace("\"cpus\": 1,", "\"cpus\": 1, \"cpus\": 3,");
        let is_json_error = |text: &str, start: &str| matches!(Exported::parse(text), Err(TaskSetError::Json(why)) if why.starts_with(start));
        assert!(is_json_error(&twice, "duplicate field `cpus`"));
        let nan = example().to_json().replace("\"cpus\": 1,", "\"cpus\": NaN,");
        assert!(is_json_error(&nan, "expected value"));
    }

    fn example_set() -> TaskSet {
        let Exported::Deployment(set) = example() else { unreachable!() };
        set
    }

    #[test]
    fn what_is_known_at_a_level() {
        let set = example_set();
        let columns = [1e-3, 1e-9, 1e-5].map(|it| set.column(level(it)));
        assert_eq!(columns, [Some(0), Some(1), None]);
        // Of each activity, the greatest cost and the declared time.
        let demands = |column, method| {
            let known = |demand: Demand| match demand {
                Demand::Machine { machine, whole } => {
                    Some((machine.greatest_cost().as_nanos(), whole.map(Time::as_nanos)))
                }
                Demand::Unknown => None,
            };
            let tasks = set.tasks_at(set.levels[column], method).unwrap();
            tasks.activities().iter().map(|it| known(it.demand.clone())).collect::<Vec<_>>()
        };
        let both = [Some((83, Some(900))), Some((83, Some(900))), None];
        assert_eq!(demands(0, Method::Psm), both);
        assert_eq!(demands(0, Method::Classic), both);
        assert_eq!(demands(1, Method::Psm), [Some((94, None)), None, None]);
        assert_eq!(demands(1, Method::Classic), [None; 3]);
        assert_eq!(set.tasks_at(level(0.5), Method::Psm), None);
    }

    #[test]
    fn the_set_at_a_level() {
        let mut set = example_set();
        let rare = set.levels[1];
        let found = set.tasks_at(rare, Method::Psm).unwrap();
        let front = &found.activities()[0];
        assert_eq!((&*front.name, front.priority, front.cpus), ("front", Priority::RealTime(2), Some(1)));
        let always = Some(Time::from_nanos(1000));
        assert_eq!((front.period, front.deadline), (always, always));
        assert_eq!((front.jitter, front.offset), (Time::from_nanos(7), Some(Time::from_nanos(8))));
        assert_eq!(found.others().len(), set.other.len());
        let operation = |provider, client, time, during| crate::Operation {
            provider,
            client,
            sends: 2,
            time: Time::from_nanos(time),
            during,
        };
        assert_eq!(found.operations, [operation(0, 1, 4, None), operation(1, 0, 5, Some(0))]);
        let throttled = [Some(true), Some(false), None].map(|rt_throttling| {
            set.rt_throttling = rt_throttling;
            let tasks = set.tasks_at(rare, Method::Psm).unwrap();
            tasks.all().iter().any(|task| *task.name == *crate::THROTTLING)
        });
        assert_eq!(throttled, [true, false, false]);
    }

    #[test]
    fn names_are_repeated_only_where_nothing_is_analysed() {
        let excused = || {
            let reason = NotAnalysed { reason: "lost".to_owned(), levels: None, classic_only: false };
            let front = example_set().activities.swap_remove(0);
            Activity { not_analysed: vec![reason], machine: None, ..front }
        };
        let check = |activities: Vec<Activity>, not_analysed: &[&str]| {
            let not_analysed = not_analysed.iter().map(|&it| it.to_owned()).collect();
            TaskSet { activities, not_analysed, operations: Vec::new(), ..example_set() }.check()
        };
        let front = || example_set().activities.swap_remove(0);
        let repeated = Err(TaskSetError::RepeatedActivity("front".to_owned()));
        assert_eq!(check(vec![excused(), excused()], &[]), Ok(()));
        assert_eq!(check(vec![front(), excused()], &[]), repeated);
        assert_eq!(check(vec![excused(), front()], &[]), repeated);
        assert_eq!(check(vec![front(), front()], &["an activity is lost"]), Ok(()));
    }

    #[test]
    fn what_is_refused_of_a_component() {
        let machine = |activity: usize| example_set().activities.swap_remove(activity).machine;
        let check = |machine: Option<Machine>, reasons: &[NotAnalysed], name: &str, levels: &[f64]| {
            let levels = levels.iter().map(|&it| level(it)).collect();
            Component { name: name.to_owned(), times: None, levels, not_analysed: reasons.to_vec(), machine }
                .check()
        };
        let both = &[1e-3, 1e-9];
        let reason = NotAnalysed { reason: "lost".to_owned(), levels: None, classic_only: false };
        let no_reason = |at| Err(TaskSetError::NoReason(Unknown::Times, level(at)));
        assert_eq!(check(machine(0), &[], "C", both), Ok(()));
        assert_eq!(check(machine(1), &[], "C", both), no_reason(1e-9));
        assert_eq!(check(None, &[], "C", both), no_reason(1e-3));
        assert_eq!(check(None, &[reason], "C", both), Ok(()));
        assert_eq!(check(machine(0), &[], "C", &[]), Err(TaskSetError::NoLevels));
        let control_character = Err(TaskSetError::ControlCharacter("a\nb".to_owned()));
        assert_eq!(check(machine(0), &[], "a\nb", both), control_character);
    }

    #[test]
    fn sets_that_are_too_large() {
        let mut set = example_set();
        let other = |number| Other { name: format!("other {number}"), ..set.other[0].clone() };
        let others: Vec<Other> = (0..MOST_ACTIVITIES - 2).map(other).collect();
        set.other = others[1..].to_vec();
        assert_eq!(set.check(), Ok(()));
        set.other = others;
        assert_eq!(set.check(), Err(TaskSetError::TooManyActivities(MOST_ACTIVITIES + 1)));
        let levels: Vec<Level> = (2..67).map(|n| level(1.0 / f64::from(n))).collect();
        assert_eq!(check_levels(&levels[1..]), Ok(()));
        assert_eq!(check_levels(&levels), Err(TaskSetError::TooManyLevels(65)));
        let mut set = example_set();
        set.operations.resize(MOST_OPERATIONS, set.operations[0].clone());
        assert_eq!(set.check(), Ok(()));
        set.operations.push(set.operations[0].clone());
        assert_eq!(set.check(), Err(TaskSetError::TooManyOperations(MOST_OPERATIONS + 1)));
    }

    #[test]
    fn a_machine_of_many_states_is_read_quickly() {
        let states: Vec<String> = (0..20_000).map(|number| format!("S{number}")).collect();
        let edge = |(source, target): (&String, &String)| Edge {
            source: source.clone(),
            target: target.clone(),
            transition: None,
            first: 0,
            then: Vec::new(),
            cost: vec![Some(Time::from_nanos(1))],
        };
        let edges = states.iter().zip(states.iter().cycle().skip(1)).map(edge).collect();
        let none = || vec![Some(Time::ZERO)];
        let (initial, assumed, programs) = (states[0].clone(), Vec::new(), Vec::new());
        let states = states.into_iter().map(|state| State { state, first: Vec::new() }).collect();
        let machine =
            Machine { states, initial, overhead: none(), component_time: none(), assumed, programs, edges };
        let levels = vec![level(1e-4)];
        let component = Component {
            name: "C".to_owned(),
            times: None,
            levels,
            not_analysed: Vec::new(),
            machine: Some(machine),
        };
        let content = Exported::Component(component);
        assert_eq!(Exported::parse(&content.to_json()), Ok(Parsed { content, is_sealed: true }));
    }

    proptest! {
        /// Bytes that are lost or come in: the file is what it was, or refused.
        #[test]
        fn damage_is_seen(at in 0_usize..4000, length in 0_usize..60, put in "[0-9a-z{}\\[\\],:\"\\n -]{0,4}") {
            let text = example().to_json();
            // Without its last line break alone, the file is the same.
            let start = at % (text.len() - 1);
            let end = (start + length).min(text.len());
            let damaged = format!("{}{put}{}", &text[..start], &text[end..]);
            if let Ok(parsed) = Exported::parse(&damaged) {
                prop_assert_eq!(parsed.content, example(), "{}", damaged);
            }
            prop_assert!(Exported::parse(&text[..start]).is_err(), "its end is missing");
        }

        #[test]
        fn no_text_fails(text in "(\\{|\\}|\\[|\\]|\"(format|unit|deployment|machine|cost)\"|:|,|null|1e400|-1|\\PC){0,40}") {
            let _ = Exported::parse(&text);
        }
    }
}
