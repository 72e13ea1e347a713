//! Activities that data never releases, or that do not read the data that releases them.

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Assumption, Decl, Flat, Location, ModelDb, Project, Ros2, core_of, deployed, deployment, passages_of,
    ros2_of,
};

use crate::fact::{TimingFact, TimingFactKind};
use crate::psm::is_readable;
use crate::reason::ActivityField;
use crate::system::{ResolvedActivity, system_of};

/// Returns the facts about the triggers of a deployment.
pub fn trigger_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<TimingFact<'db>> {
    let triggered = system_of(db, project, of).activities.iter();
    let triggered = triggered.filter(|it| it.trigger.is_some() && it.refusals.is_empty());
    let mut triggered = triggered.peekable();
    let flat = deployed(db, project, of).map(|(flat, _)| flat).filter(|_| triggered.peek().is_some());
    let Some(flat) = flat.filter(|flat| flat.refusals.is_empty() && !flat.link_completeness.is_incomplete())
    else {
        return Vec::new();
    };
    let checker = TriggerChecker { db, project, of, flat, ros2: ros2_of(db, project, of) };
    triggered.flat_map(|activity| checker.activity(activity)).collect()
}

struct TriggerChecker<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    flat: &'db Flat<'db>,
    ros2: &'db Ros2,
}

impl<'db> TriggerChecker<'db> {
    fn activity(&self, activity: &ResolvedActivity<'db>) -> Vec<TimingFact<'db>> {
        let Some(trigger) = &activity.trigger else { return Vec::new() };
        let activities = deployment(self.db, self.of).into_iter().flat_map(|data| &data.activities);
        let mut of_name = activities.filter(|it| it.name.name == activity.activity);
        let field = of_name.find_map(|it| it.field(ActivityField::Trigger));
        let place = |port: &Name| {
            let named = field.and_then(|field| field.names().find(|it| it.name == *port));
            named.map_or(activity.at.clone(), |it| Location::Source(self.of, it.id))
        };
        trigger.ports.iter().filter_map(|port| self.port(activity, port, place(port))).collect()
    }

    /// Returns what is wrong with a port whose data releases an activity.
    fn port(
        &self,
        activity: &ResolvedActivity<'db>,
        port: &Name,
        at: Location<'db>,
    ) -> Option<TimingFact<'db>> {
        let (instance, port) = (activity.instance.clone(), port.clone());
        let is_it = |end: &(Name, Name)| end.0 == instance && end.1 == port;
        let link = self.flat.links.iter().find(|link| !link.operation && is_it(&link.target));
        let writer = link.map(|link| link.source.clone());
        let is_written = match &writer {
            Some((writer, port)) => self.may_access(writer, port, true),
            None => self.ros2.topic(&instance, &port).is_some(),
        };
        let is_read = self.may_access(&instance, &port, false);
        let kind = match (is_written, is_read) {
            (false, _) => TimingFactKind::NeverTriggered { instance, port, writer },
            (true, false) => TimingFactKind::TriggerNotRead { instance, port },
            (true, true) => return None,
        };
        Some(TimingFact::new(at, kind))
    }

    /// Returns whether the core of an instance may write a port, or read it; also where that is not known.
    fn may_access(&self, instance: &Name, port: &Name, is_write: bool) -> bool {
        let (db, project) = (self.db, self.project);
        let component = self.flat.instance(instance).and_then(|it| it.component);
        let component = component.filter(|&component| *is_readable(db, project, component));
        let Some(core) = component.and_then(|it| core_of(db, project, it)) else { return true };
        let passages = passages_of(db, project, core, Assumption::nothing(db));
        let accesses = if is_write { &passages.writes } else { &passages.reads };
        accesses.iter().any(|(name, _)| name == port)
    }
}
