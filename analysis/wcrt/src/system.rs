//! What a deployment runs: an activity for each instance of its architecture, and what must not be left out.

use rustc_hash::{FxHashMap, FxHashSet};

pub use mauve_timing::task_set::Priority;
use mauve_timing::{Rounding, Time, Unit};

use crate::fact::{Expected, NoTime, TimingFact, TimingFactKind};
use crate::reason::{ActivityField, Doubt, MOST_REASONS, NoSuchCpu, Reason, Refusal, Unknown};
use mauve_hir::item_tree::{
    Activity, Deployment, Endpoint, Expr, FeatureKind, Field, Kind, Literal, Name, NameRef, SourceId,
    UnaryOperator,
};
use mauve_hir::{
    Decl, Features, Flat, FlatInstance, Link, Location, ModelDb, Project, architecture, core_interface,
    core_of, deployment, errors_in, features_of, flat_of, names_of, platform_of, shell_of, similar,
    too_large, whole_number as whole_number_of,
};

/// What a deployment asks to be run.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct System<'db> {
    /// In the order of the deployment; instances without an activity last.
    pub rows: Vec<Row<'db>>,
    /// The CPUs that there are, a bit each: those of `mauve.toml`, otherwise those that an activity names.
    pub cpus: u64,
    /// Why nothing of it can be analysed: an activity may be missing.
    pub lost: Vec<Refusal<'db>>,
    /// What is wrong in the deployment.
    pub facts: Vec<TimingFact<'db>>,
}

/// An activity, or an instance that has none.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Row<'db> {
    /// The instance.
    pub instance: Name,
    /// The name of its component as the architecture writes it.
    pub component_name: Name,
    /// Its component, where that is known.
    pub component: Option<Decl<'db>>,
    /// What it is, for whoever points at it.
    pub at: Location<'db>,
    /// How urgent it is.
    pub priority: Priority,
    /// The CPUs that it may use, a bit each; `None` where that is unknown.
    pub cpus: Option<u64>,
    /// T.
    pub period: Option<Time>,
    /// D; the period where it is left out, or where it is later than that.
    pub deadline: Option<Time>,
    /// Is a deadline written that is later than the period, and does not count?
    pub is_late: bool,
    /// Why it is not analysed.
    pub refusals: Vec<Refusal<'db>>,
    /// Why its priority counts as unknown although one is written.
    pub doubt: Option<Doubt>,
}

impl<'db> Row<'db> {
    /// The component whose state machine it executes, where that is known; none of what is not real-time.
    pub(crate) fn executed(&self) -> Option<Decl<'db>> {
        self.component.filter(|_| self.priority != Priority::Background)
    }

    /// It may be as urgent as anything, on any CPU. What may be wrong is kept where a priority is written: otherwise that is
    /// what is unknown.
    fn forget(&mut self, doubt: Doubt) {
        if matches!(self.priority, Priority::RealTime(_)) {
            self.doubt = Some(doubt);
        }
        (self.priority, self.cpus) = (Priority::Unknown, None);
    }
}

/// Reads a deployment.
#[salsa::tracked(returns(ref))]
pub fn system_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> System<'db> {
    deployment(db, of).map_or_else(System::default, |data| read(db, project, of, data))
}

/// Reads the deployment that `of` declares, with `data` in it: what it has, or what it is supposed to have.
pub(crate) fn read<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    data: &Deployment,
) -> System<'db> {
    let mut reader = Reader { db, project, of, found: System::default(), affinities: FxHashMap::default() };
    if data.completeness.is_incomplete() {
        reader.lost(Reason::DamagedDeployment(of), Location::name_of(of));
    }
    if let Some(at) = too_large(db, project) {
        reader.lost(Reason::ProjectTooLarge, Location::name_of(at));
        return reader.found;
    }
    let names = names_of(db, project);
    if names.in_library(of.library(db).as_ref(), Kind::Deployment, of.name(db)).len() > 1 {
        reader.lost(Reason::DeclaredTwice(of), Location::name_of(of));
    }
    let target = match data.targets.as_slice() {
        [target] => match names.resolve_type(db, of, Kind::Architecture, Some(target)) {
            Ok(architecture) => Some(architecture),
            Err(why) => {
                let at = Location::Source(of, target.id);
                reader.report(at, TimingFactKind::UnresolvedArchitecture { of, ty: target.clone(), why });
                None
            }
        },
        targets => {
            if data.completeness.is_complete() {
                match targets.get(1) {
                    Some(second) => {
                        reader.report(Location::Source(of, second.id), TimingFactKind::SecondTarget)
                    }
                    None => reader.report(Location::name_of(of), TimingFactKind::NoTarget),
                }
            }
            None
        }
    };
    match target {
        Some(target) => {
            reader.activities(target, &data.activities);
            reader.errors(target);
        }
        None => {
            reader.lost(Reason::NoArchitecture(of), Location::name_of(of));
            for activity in data.activities.iter().filter(|activity| !activity.instance.name.is_empty()) {
                reader.activity(None, activity);
            }
        }
    }
    reader.cpus();
    reader.found
}

struct Reader<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    found: System<'db>,
    /// Where the affinities stand, by row.
    affinities: FxHashMap<usize, Location<'db>>,
}

impl<'db> Reader<'db> {
    fn report(&mut self, at: Location<'db>, kind: TimingFactKind<'db>) {
        self.found.facts.push(TimingFact::new(at, kind));
    }

    fn lost(&mut self, reason: Reason<'db>, at: Location<'db>) {
        self.found.lost.push(Refusal::reported(reason, at));
    }

    fn activities(&mut self, target: Decl<'db>, activities: &[Activity]) {
        let flat = flat_of(self.db, self.project, target);
        self.found.lost.extend(flat.refusals.iter().map(Refusal::of_model));
        if flat.cycle {
            self.lost(Reason::ImportsItself(target), Location::name_of(target));
        }
        let mut first_of: FxHashMap<&Name, &Activity> = FxHashMap::default();
        // Instances whose activity has a misspelt name: that is one mistake.
        let mut misspelt: FxHashSet<Name> = FxHashSet::default();
        let mut strays = Vec::new();
        let mut twice: FxHashMap<&Name, Refusal<'db>> = FxHashMap::default();
        for activity in activities.iter().filter(|activity| !activity.instance.name.is_empty()) {
            let name = &activity.instance.name;
            let first = first_of.insert(name, activity);
            let instance = flat.instance(name);
            // An instance that was lost is one mistake.
            if instance.is_none() && flat.refusals.is_empty() {
                let near = similar(name, flat.instances.iter().map(|instance| &instance.name));
                let at = Location::Source(self.of, activity.instance.id);
                misspelt.extend(near.clone());
                let missing = Reason::NoSuchInstance { architecture: target, instance: name.clone() };
                strays.push(Refusal::reported(missing, at.clone()));
                let name = name.clone();
                self.report(at, TimingFactKind::UnresolvedInstance { name, architecture: target, near });
            }
            self.activity(instance, activity);
            if let Some(first) = first {
                let at = Location::Source(self.of, activity.instance.id);
                let first = Location::Source(self.of, first.instance.id);
                let instance = name.clone();
                self.report(at.clone(), TimingFactKind::DuplicateActivity { instance, first });
                let refusal = Refusal::reported(Reason::SecondActivity(name.clone()), at);
                twice.entry(name).or_insert(refusal);
            }
        }
        // Which one counts is unknown: both may be as urgent as anything.
        for row in &mut self.found.rows {
            if let Some(refusal) = twice.get(&row.instance) {
                row.refusals.push(refusal.clone());
                row.forget(Doubt::TwoActivities);
            }
        }
        // One activity too much and one too few are one mistake, which is reported.
        let missing = flat.instances.iter().filter(|it| !first_of.contains_key(&it.name)).count();
        let named = activities.iter().filter(|it| !it.instance.name.is_empty()).count();
        let right = first_of.keys().filter(|name| flat.instance(name).is_some()).count();
        let is_renamed = missing == 1 && named.saturating_sub(right) == 1;
        let mut without: FxHashSet<&Name> = FxHashSet::default();
        for instance in &flat.instances {
            if first_of.contains_key(&instance.name) || !without.insert(&instance.name) {
                continue;
            }
            let at = Location::name_of(self.of);
            let refusal = Refusal::reported(Reason::NoActivity, at.clone());
            // Where an activity was lost, it may have been this one.
            if !misspelt.contains(&instance.name) && !is_renamed && self.found.lost.is_empty() {
                let instance = instance.name.clone();
                self.report(at.clone(), TimingFactKind::MissingActivity { of: self.of, instance });
            }
            self.found.rows.push(Row {
                instance: instance.name.clone(),
                component_name: self.component_name(instance),
                component: instance.component,
                at,
                priority: Priority::Unknown,
                cpus: None,
                period: None,
                deadline: None,
                is_late: false,
                refusals: vec![refusal],
                doubt: None,
            });
        }
        // Only now: what is missing in a deployment with such an activity is reported all the same.
        self.found.lost.extend(strays);
        self.served(flat);
        self.synchronised();
    }

    /// Refuses the instances that an item with an error declares, connects or sets a value of: their component may be wrong.
    /// Any other error in an architecture may hide an instance, and refuses all.
    fn errors(&mut self, target: Decl<'db>) {
        let (db, project) = (self.db, self.project);
        let flat = flat_of(db, project, target);
        let mut of_instance: FxHashMap<&Name, Vec<Refusal<'db>>> = FxHashMap::default();
        for &decl in flat.architectures.iter().chain([&self.of]) {
            let errors = errors_in(db, project, decl);
            if errors.is_empty() {
                continue;
            }
            let items = items_of(db, decl);
            for error in errors {
                let refusal =
                    Refusal::reported(Reason::ErrorIn(decl, error.reason.clone()), error.at.clone());
                let item = item_at(&items, decl, &error.at);
                let named = item.map_or(&[] as &[&Name], |item| item.instances.as_slice());
                if named.is_empty() || named.iter().any(|name| flat.instance(name).is_none()) {
                    self.found.lost.push(refusal);
                } else {
                    named.iter().for_each(|name| of_instance.entry(name).or_default().push(refusal.clone()));
                }
            }
        }
        for row in &mut self.found.rows {
            let Some(refusals) = of_instance.get(&row.instance) else { continue };
            row.refusals.extend(refusals.iter().take(MOST_REASONS).cloned());
        }
        self.found.lost.truncate(MOST_REASONS);
    }

    fn component_name(&self, instance: &FlatInstance<'db>) -> Name {
        let (declared, index) = instance.declared;
        let written = architecture(self.db, declared)
            .and_then(|data| data.instances.get(index)?.component.as_ref()?.path.last().cloned());
        instance.component.map(|component| component.name(self.db).clone()).or(written).unwrap_or_default()
    }

    fn activity(&mut self, instance: Option<&FlatInstance<'db>>, activity: &Activity) {
        let at = Location::Source(self.of, activity.instance.id);
        let mut row = Row {
            instance: activity.instance.name.clone(),
            component_name: instance.map_or_else(Name::default, |instance| self.component_name(instance)),
            component: instance.and_then(|instance| instance.component),
            at: at.clone(),
            priority: Priority::Unknown,
            cpus: Some(0),
            period: None,
            deadline: None,
            is_late: false,
            refusals: Vec::new(),
            doubt: None,
        };
        let mut repeated = false;
        match instance {
            None => row.refusals.push(Refusal::reported(Reason::UnknownInstance, at.clone())),
            Some(instance) if instance.repeated => {
                repeated = true;
                row.refusals.push(Refusal::reported(Reason::SeveralInstances, at.clone()));
            }
            Some(instance) if instance.component.is_none() => {
                let (declared, _) = instance.declared;
                let what = Unknown::ComponentOf(instance.name.clone());
                let unknown = Reason::Unknown { project: self.project, what };
                row.refusals.push(Refusal::reported(unknown, Location::name_of(declared)));
            }
            Some(_) => {}
        }
        let of_instance = row.refusals.len();
        let mut fields = Fields::default();
        for field in &activity.fields {
            self.field(&mut row, &mut fields, field);
        }
        let wrong = row.refusals.len() > of_instance;
        if activity.completeness.is_incomplete() && row.refusals.is_empty() {
            row.refusals.push(Refusal::reported(Reason::DamagedActivity, at.clone()));
        }
        // A field that was lost may be any of those that are missing. Where one is missing that must be there, another may
        // have its value; where an affinity names no CPU, it may be the priority.
        let missing = row.priority != Priority::Background && fields.period.is_none();
        let doubtful = missing || fields.priority.is_none() || fields.misplaced || instance.is_none();
        let lost = activity.completeness.is_incomplete() || fields.lost;
        if lost && fields.affinity.is_none() {
            row.cpus = None;
        }
        // Where something is wrong, it may be the priority of a real-time activity; of two instances of one name, one has
        // lost its own activity, which may be any.
        if row.priority == Priority::Background && (lost || wrong) || repeated {
            row.forget(Doubt::SeveralInstances);
        }
        if row.priority == Priority::Unknown {
            if fields.priority.is_none() && !lost {
                let free = self.free_priority(activity);
                let period = field_of(activity, ActivityField::Period).map(|period| period.name.id);
                let name = (activity.instance.name.clone(), activity.instance.id);
                let missing = TimingFactKind::MissingPriority { of: self.of, activity: name, free, period };
                self.report(at.clone(), missing);
            }
            // Where it has one, why that cannot be used is said already.
            if fields.priority.is_none() || row.refusals.is_empty() {
                row.refusals.push(Refusal::reported(Reason::NoField(ActivityField::Priority), at.clone()));
            }
        } else if row.priority != Priority::Background && row.period.is_none() {
            if fields.period.is_none() && !lost {
                let priority = field_of(activity, ActivityField::Priority).map(|priority| priority.value_id);
                let name = (activity.instance.name.clone(), activity.instance.id);
                let missing = TimingFactKind::MissingPeriod { of: self.of, activity: name, priority };
                self.report(at.clone(), missing);
            }
            if fields.period.is_none() || row.refusals.is_empty() {
                row.refusals.push(Refusal::reported(Reason::NoField(ActivityField::Period), at.clone()));
            }
        }
        if doubtful {
            row.forget(if missing { Doubt::PriorityAsPeriod } else { Doubt::AffinityAsPriority });
        }
        match (fields.deadline, row.deadline) {
            (None, _) => row.deadline = row.period,
            (Some(_), None) if row.refusals.is_empty() => {
                let unusable = Reason::UnusableField(ActivityField::Deadline);
                row.refusals.push(Refusal::reported(unusable, at));
            }
            (Some(_), None) => {}
            (Some(field), Some(deadline)) => {
                if let Some((of_period, period)) = fields.period.zip(row.period)
                    && deadline > period
                {
                    let written = match &of_period.value {
                        Expr::Literal(Literal::Int(text) | Literal::Float(text), _) => text.clone(),
                        _ => Name::default(),
                    };
                    let period_at = Location::Source(self.of, of_period.value_id);
                    self.report(
                        Location::Source(self.of, field.value_id),
                        TimingFactKind::DeadlineExceedsPeriod { deadline, period, written, period_at },
                    );
                    // Which of the two is the mistake is unknown.
                    row.deadline = Some(period);
                    row.is_late = true;
                }
            }
        }
        self.found.rows.push(row);
    }

    fn field<'a>(&mut self, row: &mut Row<'db>, fields: &mut Fields<'a>, written: &'a Field) {
        let at = Location::Source(self.of, written.name.id);
        let Some(field) = ActivityField::from_keyword(&written.name.name) else {
            let name = written.name.name.clone();
            row.refusals.push(Refusal::reported(Reason::UnknownField(name.clone()), at.clone()));
            self.report(at, TimingFactKind::UnknownField(name));
            fields.lost = true;
            return;
        };
        let slot = match field {
            ActivityField::Affinity => &mut fields.affinity,
            ActivityField::Priority => &mut fields.priority,
            ActivityField::Period => &mut fields.period,
            ActivityField::Deadline => &mut fields.deadline,
        };
        if let Some(first) = slot.replace(written) {
            let first = Location::Source(self.of, first.name.id);
            let (of, id, instance) = (self.of, written.name.id, row.instance.clone());
            let second = Reason::SecondField { field, instance: instance.clone() };
            row.refusals.push(Refusal::reported(second, at.clone()));
            self.report(at, TimingFactKind::DuplicateField { of, id, field, instance, first });
            match field {
                ActivityField::Affinity => row.cpus = None,
                ActivityField::Priority => row.priority = Priority::Unknown,
                ActivityField::Period => row.period = None,
                ActivityField::Deadline => row.deadline = None,
            }
            return;
        }
        let value = Location::Source(self.of, written.value_id);
        // A half-typed value is a syntax error, reported already.
        if written.value == Expr::Missing {
            row.refusals.push(Refusal::reported(Reason::DamagedField(field), value));
            if field == ActivityField::Affinity {
                row.cpus = None;
            }
            return;
        }
        match read_field(row, field, &written.value) {
            Ok(()) if field == ActivityField::Affinity => {
                self.affinities.insert(self.found.rows.len(), value);
            }
            Ok(()) => {}
            Err(expected) => {
                fields.misplaced |= matches!(field, ActivityField::Affinity | ActivityField::Priority);
                row.refusals.push(Refusal::reported(Reason::UnusableField(field), value.clone()));
                self.report(value, TimingFactKind::InvalidField(field, expected));
            }
        }
    }

    /// A priority below those of all other activities that may run where `activity` does; 1, where one has that already.
    fn free_priority(&self, activity: &Activity) -> u32 {
        let value = |of: &Activity, field: ActivityField| mask(&field_of(of, field)?.value);
        let cpus =
            |of: &Activity| value(of, ActivityField::Affinity).filter(|cpus| *cpus != 0).unwrap_or(u64::MAX);
        let others = deployment(self.db, self.of).into_iter().flat_map(|data| &data.activities);
        let others = others.filter(|other| cpus(other) & cpus(activity) != 0);
        let least = others.filter_map(|other| value(other, ActivityField::Priority)).min();
        let below = least.map_or(1, |least| least.saturating_sub(1)).clamp(1, 99);
        u32::try_from(below).unwrap_or(1)
    }

    /// Operations are served in the time of their owner, which this analysis does not count yet.
    fn served(&mut self, flat: &Flat<'db>) {
        let mut shells: FxHashMap<&Name, &Features<'db>> = FxHashMap::default();
        for instance in &flat.instances {
            let shell = instance.component.and_then(|component| shell_of(self.db, self.project, component));
            if let Some(shell) = shell {
                shells.insert(&instance.name, features_of(self.db, self.project, shell));
            }
        }
        // What the end of a connection is; none where that is not known.
        let kind = |(instance, feature): &(Name, Name)| {
            // Where some other feature of the shell was lost, its component is refused, and this one is what it is.
            match shells.get(instance)?.by_name.get(feature)?.as_slice() {
                [feature] => Some(feature.kind),
                _ => None,
            }
        };
        let mut serves: FxHashMap<&Name, &Name> = FxHashMap::default();
        // A connection that is not right may be meant for anybody who provides something.
        let has_wrong_operation = |decl: &Decl<'db>| {
            let errors = errors_in(self.db, self.project, *decl);
            let items = if errors.is_empty() { Vec::new() } else { items_of(self.db, *decl) };
            errors.iter().any(|error| item_at(&items, *decl, &error.at).is_some_and(|item| item.is_operation))
        };
        let mut lost =
            flat.link_completeness.is_incomplete() || flat.architectures.iter().any(has_wrong_operation);
        for Link { operation, source, target, .. } in &flat.links {
            let kinds = (kind(source), kind(target));
            let is_port = |kind: Option<FeatureKind>| kind.is_some_and(FeatureKind::is_port);
            if *operation && kinds == (Some(FeatureKind::Provided), Some(FeatureKind::Required)) {
                serves.entry(&source.0).or_insert(&source.1);
            } else {
                lost |= *operation || !is_port(kinds.0) || !is_port(kinds.1);
            }
        }
        for row in &mut self.found.rows {
            let Some(component) = row.component else { continue };
            let Some(features) = shells.get(&row.instance) else { continue };
            let core =
                core_of(self.db, self.project, component).and_then(|it| core_interface(self.db, it).as_ref());
            // Where its shell has an error, its component is refused for that.
            let provides =
                features.has_any(FeatureKind::Provided) || core.is_none_or(|core| core.defines_operations);
            if !provides {
                continue;
            }
            let at = row.at.clone();
            if let Some(feature) = serves.get(&row.instance) {
                row.refusals.push(Refusal::own(Reason::ServesOperation((*feature).clone()), at));
            } else if lost {
                row.refusals.push(Refusal::reported(Reason::MayServe, at));
            }
        }
    }

    fn synchronised(&mut self) {
        let platform = platform_of(self.db, self.project.workspace(self.db));
        for row in self.found.rows.iter_mut().filter(|row| row.priority != Priority::Background) {
            if platform.synchronised.iter().any(|name| *name == row.instance.as_str()) {
                row.refusals.push(Refusal::own(Reason::SynchronisedClock, row.at.clone()));
            }
        }
    }

    /// Which CPUs each activity may use, and what of that cannot be analysed.
    fn cpus(&mut self) {
        let platform = platform_of(self.db, self.project.workspace(self.db));
        let named = self.found.rows.iter().filter_map(|row| row.cpus).fold(0, |all, cpus| all | cpus);
        // An affinity that cannot be read may name one more: who may run there too is delayed by no more than here.
        let all = match platform.cpus {
            Some(64..) => u64::MAX,
            Some(cpus) => (1 << cpus) - 1,
            None if named == 0 => 1,
            None => named,
        };
        self.found.cpus = all;
        for (index, row) in self.found.rows.iter_mut().enumerate() {
            let Some(cpus) = row.cpus else { continue };
            let given = cpus != 0;
            let cpus = if given { cpus } else { all };
            row.cpus = Some(cpus);
            if row.priority == Priority::Background {
                continue;
            }
            let at = row.at.clone();
            if cpus & !all != 0 {
                let missing = NoSuchCpu { named: cpus, available: all };
                let affinity = self.affinities.get(&index).unwrap_or(&at).clone();
                self.found.facts.push(TimingFact::new(affinity, TimingFactKind::NoSuchCpu(missing)));
                row.refusals.push(Refusal::reported(Reason::NoSuchCpu(missing), at));
                // It may be meant for any other, or be another field's.
                row.forget(Doubt::NoSuchCpu);
            } else if cpus.count_ones() > 1 {
                row.refusals.push(Refusal::own(Reason::SeveralCpus { cpus, given }, at));
            }
        }
    }
}

/// An item of an architecture or of a deployment.
struct Item<'db> {
    /// Its first part.
    first: SourceId,
    /// The instances that it declares, connects, runs or sets a value of.
    instances: Vec<&'db Name>,
    /// Does it connect operations?
    is_operation: bool,
}

/// The items of an architecture or of a deployment, in the order of the text.
fn items_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<Item<'db>> {
    let item = |ends: &[&'db Option<Endpoint>], is_operation| {
        let ends: Vec<&NameRef> = ends.iter().filter_map(|end| Some(&end.as_ref()?.instance)).collect();
        let named = ends.iter().map(|end| &end.name).filter(|name| !name.is_empty());
        Some(Item { first: ends.first()?.id, instances: named.collect(), is_operation })
    };
    let other = |first, instances| Item { first, instances, is_operation: false };
    let mut items: Vec<Item<'db>> = Vec::new();
    if let Some(data) = architecture(db, of) {
        items.extend(data.connections.iter().filter_map(|it| item(&[&it.source, &it.target], false)));
        items.extend(data.operations.iter().filter_map(|it| item(&[&it.source, &it.target], true)));
        items.extend(data.settings.iter().filter_map(|it| item(&[&it.endpoint], false)));
        items.extend(data.instances.iter().map(|it| other(it.name.id, vec![&it.name.name])));
        items.extend(data.imports.iter().flatten().map(|it| other(it.id, Vec::new())));
    }
    if let Some(data) = deployment(db, of) {
        items.extend(data.settings.iter().filter_map(|it| item(&[&it.endpoint], false)));
        items.extend(data.activities.iter().map(|it| other(it.instance.id, vec![&it.instance.name])));
    }
    items.sort_by_key(|item| item.first);
    items
}

/// The item of `decl` in which a place is.
fn item_at<'a, 'db>(items: &'a [Item<'db>], decl: Decl<'db>, at: &Location<'db>) -> Option<&'a Item<'db>> {
    match at {
        Location::Source(of, id) if *of == decl => {
            items.get(items.partition_point(|item| item.first <= *id).checked_sub(1)?)
        }
        _ => None,
    }
}

/// The fields that an activity has, by name, and whether one was lost.
#[derive(Default)]
struct Fields<'a> {
    affinity: Option<&'a Field>,
    priority: Option<&'a Field>,
    period: Option<&'a Field>,
    deadline: Option<&'a Field>,
    lost: bool,
    /// Is there an affinity or a priority that cannot be one?
    misplaced: bool,
}

/// The first field of this name.
fn field_of(activity: &Activity, field: ActivityField) -> Option<&Field> {
    activity.fields.iter().find(|it| it.name.name == field.keyword())
}

/// Enters the value of a field; returns which values it takes where this one is invalid.
fn read_field(row: &mut Row<'_>, field: ActivityField, value: &Expr) -> Result<(), Expected> {
    match field {
        ActivityField::Affinity => row.cpus = Some(mask(value).ok_or(Expected::Cpus)?),
        ActivityField::Priority => {
            row.priority = match (value, whole_number(value)) {
                (Expr::Name(it), _) if it.name == "background" => Priority::Background,
                (_, Some(priority @ 1..=99)) => Priority::RealTime(priority),
                _ => return Err(Expected::Priority),
            }
        }
        ActivityField::Period => row.period = Some(positive(value)?),
        ActivityField::Deadline => row.deadline = Some(positive(value)?),
    }
    Ok(())
}

/// The CPUs that an affinity names, a bit each: up to 64, unlike other whole numbers.
///
/// `None` where `value` is not a literal of 64 bits.
pub fn mask(value: &Expr) -> Option<u64> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// INT.
fn whole_number(value: &Expr) -> Option<u32> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    u32::try_from(whole_number_of(text)?).ok()
}

fn positive(value: &Expr) -> Result<Time, Expected> {
    let time = milliseconds(value).map_err(Expected::Time)?;
    if time > Time::ZERO { Ok(time) } else { Err(Expected::PositiveTime) }
}

fn milliseconds(value: &Expr) -> Result<Time, NoTime> {
    let text = match value {
        Expr::Literal(Literal::Int(text), _) if whole_number(value).is_none() => {
            return Err(NoTime::TooLarge(text.clone()));
        }
        Expr::Literal(Literal::Int(text), _) if text.starts_with("0x") || text.starts_with("0X") => {
            return Err(NoTime::Hexadecimal);
        }
        Expr::Literal(Literal::Int(text) | Literal::Float(text), _) => text,
        Expr::Unary(UnaryOperator::Minus, ..) => return Err(NoTime::Negative),
        _ => return Err(NoTime::NotALiteral),
    };
    Time::parse(text, Unit::Milliseconds, Rounding::Exact).map_err(NoTime::Unreadable)
}
