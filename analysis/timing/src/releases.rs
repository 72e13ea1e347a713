//! How often data releases the tasks of a set: the [`Arrivals`] of each.

use std::sync::Arc;

use crate::arrivals::ArrivalSource;
use crate::{Arrivals, Needs, PortWriter, TaskTrigger, Tasks, Time};

/// The most writers of writers that are followed.
const MOST_DEPTH: usize = 8;
/// The most writers that a count visits.
const MOST_SIZE: usize = 256;

/// Returns whether the writers of some task release it less often than T allows, in the long run: whatever the response times are.
pub(crate) fn follows_writers(set: &Tasks) -> bool {
    let at_once = || vec![Some(Time::ZERO); set.all.len()];
    !set.triggers.is_empty() && arrivals(set, &at_once()).iter().any(Option::is_some)
}

/// Returns how often data releases each task, with these response times of the tasks; none where T alone counts. So it does where the
/// data comes as often in the long run: a CPU that is loaded to exactly 100 % keeps its bounds.
pub(crate) fn arrivals(set: &Tasks, responses: &[Option<Time>]) -> Vec<Option<Arc<Arrivals>>> {
    let mut found: Vec<Option<Arc<Arrivals>>> = vec![None; set.all.len()];
    let depth = set.triggers.len().min(MOST_DEPTH);
    for _ in 0..depth {
        let known = found.clone();
        for trigger in &set.triggers {
            let next = set.arrivals_of(trigger, responses, &known).filter(|it| it.size() <= MOST_SIZE);
            let next = next.filter(|it| {
                set.all.get(trigger.task).is_some_and(|task| it.is_slower_than(task.period, task.burst()))
            });
            if let (Some(of), Some(next)) = (found.get_mut(trigger.task), next) {
                *of = Some(Arc::new(next));
            }
        }
        if found == known {
            break;
        }
    }
    found
}

impl Tasks {
    fn arrivals_of(
        &self,
        trigger: &TaskTrigger,
        responses: &[Option<Time>],
        known: &[Option<Arc<Arrivals>>],
    ) -> Option<Arrivals> {
        // A clock releases it all the same.
        self.all.get(trigger.task).filter(|task| !task.is_periodic())?;
        let source = |writer: &PortWriter| {
            let task = self.all.get(writer.task)?;
            Some(ArrivalSource {
                writes: writer.writes,
                response: (*responses.get(writer.task)?)?.as_nanos(),
                period: task.period.filter(|period| *period > Time::ZERO)?.as_nanos(),
                burst: task.burst(),
                arrivals: known.get(writer.task)?.clone(),
            })
        };
        let port = |port: &Option<Vec<PortWriter>>| port.as_ref()?.iter().map(source).collect();
        let ports = trigger.ports.iter().map(port);
        let ports: Vec<Vec<ArrivalSource>> = match trigger.needs {
            Needs::Any | Needs::Each => ports.collect::<Option<_>>()?,
            Needs::All => ports.flatten().collect(),
        };
        Arrivals::new(trigger.needs, ports)
    }
}
