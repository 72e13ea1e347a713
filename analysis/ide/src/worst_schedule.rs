//! The schedule behind the response time of an activity: the releases and the paths that its analysis found. The schedule with
//! the longest way of data along a chain that a search finds.

use mauve_diagnostics::figure::Forms;
use mauve_hir::{Decl, ModelDb, Project, config_of};
use mauve_timing::{ChainStep, Job, NoWorstCase, Schedule, SimulationOptions, Time, Way, WorstCase};
use mauve_wcrt::chains::chains_of;
use mauve_wcrt::{DeployedTasks, Query};

/// The worst case of one activity.
#[derive(Debug, Clone)]
pub struct WorstOf {
    /// The index of the activity.
    pub activity: usize,
    /// Its releases and paths.
    pub case: WorstCase,
}

impl WorstOf {
    /// Finds the worst case of an activity of a deployment. To cancel, `interrupt` unwinds.
    ///
    /// # Errors
    ///
    /// Why no schedule is known, as [`no_worst_case`] says it.
    pub fn of(
        deployment: &DeployedTasks<'_>,
        activity: usize,
        query: Query,
        interrupt: &dyn Fn(),
    ) -> Result<WorstOf, NoWorstCase> {
        let case = deployment.tasks.worst_case(activity, &query.options(false), interrupt)?;
        Ok(WorstOf { activity, case })
    }

    /// Simulates its schedule, with at most `most_events` events.
    pub fn schedule(
        &self,
        deployment: &DeployedTasks<'_>,
        most_events: u64,
        interrupt: &dyn Fn(),
    ) -> Schedule {
        let options = SimulationOptions {
            initial_states: deployment.initial_states(),
            least_time: 100,
            keeps_schedule: true,
            most_events,
            script: Some(self.case.script.clone()),
            ..SimulationOptions::new(1, self.case.length)
        };
        deployment.tasks.simulate(&options, interrupt)
    }

    /// Returns the response time of its late job in a schedule, if that ended.
    pub fn response(&self, schedule: &Schedule) -> Option<Time> {
        let job = self.job(schedule)?;
        job.end?.checked_sub(job.nominal)
    }

    /// Returns its late job in a schedule, if that has it.
    pub(crate) fn job<'a>(&self, schedule: &'a Schedule) -> Option<&'a Job> {
        schedule.jobs.iter().find(|job| job.activity == self.activity && job.number == self.case.job)
    }

    /// Says what the schedule shows: `job 1 of pilot: ✓ 19 / 40 ms, which is its bound`. Slack below `tight_slack` percent of the
    /// deadline is little.
    pub fn description(
        &self,
        deployment: &DeployedTasks<'_>,
        schedule: &Schedule,
        tight_slack: u32,
    ) -> String {
        let WorstCase { job, bound, .. } = &self.case;
        let instance = deployment.tasks.name(self.activity);
        let figure = |response: Time| {
            let deadline = self.job(schedule).and_then(|job| job.deadline.checked_sub(job.nominal));
            Forms::of(response, deadline.unwrap_or_default(), tight_slack).text().to_owned()
        };
        match self.response(schedule) {
            Some(time) if time == *bound => {
                format!("job {job} of {instance}: {}, which is its bound", figure(time))
            }
            Some(time) => format!(
                "job {job} of {instance}: {}; no later schedule is known, its bound is {bound}",
                figure(time)
            ),
            // Too many events for a drawing.
            None if schedule.end < self.case.length => {
                let end = schedule.end;
                format!(
                    "the schedule is shown until {end}: job {job} of {instance} ends later; its bound is {bound}"
                )
            }
            None => format!("job {job} of {instance} does not end; its bound is {bound}"),
        }
    }
}

/// Returns a time rounded to microseconds: a reader that starts a nanosecond before a write is as late as one that starts with it.
pub fn to_micros(time: Time) -> Time {
    Time::from_nanos(time.as_nanos().saturating_add(500) / 1000 * 1000)
}

/// The longest way of data along a chain that is found.
#[derive(Debug, Clone)]
pub struct WayOf {
    /// The name of the chain.
    pub chain: String,
    /// Its greatest latency.
    pub bound: Time,
    /// The way.
    pub way: Way,
}

/// Says that a deployment has no chain of this name.
pub fn no_chain(name: &str, deployment: &str) -> String {
    format!("no chain `{name}` in {deployment}: `mauve chains` lists them")
}

impl WayOf {
    /// Searches for the longest way along the chain `name`, with these random choices. To cancel, `interrupt` unwinds.
    ///
    /// # Errors
    ///
    /// Why there is none, for the user.
    pub fn of<'db>(
        db: &'db dyn ModelDb,
        (project, of, query): (Project<'db>, Decl<'db>, Query),
        deployment: &DeployedTasks<'db>,
        (name, seed): (&str, u64),
        interrupt: &dyn Fn(),
    ) -> Result<WayOf, String> {
        let chains = chains_of(db, project, of, query);
        let Some(chain) = chains.all.iter().find(|chain| chain.name == name) else {
            return Err(no_chain(name, of.name(db)));
        };
        let timed: Option<Vec<ChainStep>> = chain.steps.iter().map(|step| step.timed.clone()).collect();
        let (Some(bound), Some(timed)) = (chain.latency, timed) else {
            return Err(format!(
                "the chain `{name}` has no latency in {}: `mauve chains` says why",
                of.name(db)
            ));
        };
        if timed.iter().any(|step| step.released.is_some()) {
            return Err(format!(
                "data releases an activity of the chain `{name}` in {}: such schedules are not searched",
                of.name(db)
            ));
        }
        let config = config_of(db, project.workspace(db));
        let declared = chain.declared.and_then(|index| config.chains.get(index));
        let states =
            || declared.into_iter().flat_map(|it| &it.states).filter_map(|(state, _)| state.rsplit_once('.'));
        let mut edges = vec![None; deployment.tasks.all().len()];
        for (step, of_report) in timed.iter().zip(&chain.steps) {
            let own = states().filter(|(instance, _)| of_report.instance == *instance);
            let own: Vec<&str> = own.map(|(_, state)| state).collect();
            if let Some(edges) = edges.get_mut(step.task).filter(|_| !own.is_empty()) {
                *edges = deployment.edges_within(step.task, &own);
            }
        }
        let way = deployment.tasks.longest_way(&timed, &edges, seed, interrupt);
        let way = way.ok_or_else(|| format!("no schedule of the chain `{name}` can be simulated"))?;
        Ok(WayOf { chain: name.to_owned(), bound, way })
    }

    /// Says what was found: `avoid: the longest way found takes 480 ms of at most 526 ms, of 240 schedules`.
    pub fn description(&self) -> String {
        let WayOf { chain, bound, way } = self;
        let latency = to_micros(way.latency());
        format!(
            "{chain}: the longest way found takes {latency} of at most {bound}, of {} schedules",
            way.schedules
        )
    }
}

/// Says why no schedule behind the response time of `instance` in `deployment` is known.
pub fn no_worst_case(why: NoWorstCase, instance: &str, deployment: &str) -> String {
    match why {
        NoWorstCase::NoResponse => format!("`{instance}` has no response time in {deployment}"),
        NoWorstCase::OtherOffsets => format!(
            "the response time of `{instance}` in {deployment} holds for any offsets: the schedule behind it does not keep \
             those of the synchronised clocks"
        ),
    }
}
