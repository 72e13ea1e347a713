//! The schedule behind the response time of an activity: the releases and the paths that its analysis found.

use mauve_timing::{NoWorstCase, Schedule, SimulationOptions, Time, WorstCase};
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
        let mut jobs = schedule.jobs.iter();
        let job = jobs.find(|job| job.activity == self.activity && job.number == self.case.job)?;
        job.end?.checked_sub(job.nominal)
    }

    /// Says what the schedule shows: `job 1 of pilot responds in 19 ms, which is its bound`.
    pub fn description(&self, deployment: &DeployedTasks<'_>, schedule: &Schedule) -> String {
        let WorstCase { job, bound, .. } = &self.case;
        let instance = deployment.tasks.name(self.activity);
        match self.response(schedule) {
            Some(time) if time == *bound => {
                format!("job {job} of {instance} responds in {time}, which is its bound")
            }
            Some(time) => format!(
                "job {job} of {instance} responds in {time}; no later schedule is known, its bound is {bound}"
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
