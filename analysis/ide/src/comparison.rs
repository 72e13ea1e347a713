//! The figures of a deployment in two states beside each other: before and after an edit, or of two revisions.
//!
//! ```text
//! project, deployment → [`Figures`] ─┐
//! the same, changed   → [`Figures`] ─┴→ [`Comparison`]: a row for each activity and each chain
//! ```
//!
//! Figures belong to no database, so that the states may come from two. A client may keep them as a text, for the state in which it
//! began.

use std::cmp::Reverse;
use std::path::PathBuf;

use mauve_diagnostics::{
    errors_of, first_error, known_utilisation, reasons_of, reasons_of_chain, timing_reason,
};
use mauve_hir::item_tree::Name;
use mauve_hir::{Chain, Decl, Hosts, Located, ModelDb, Project, accepted, config_of, file_and_line};
use mauve_timing::{CpuLoad, LockUser, Priority, Status, Time};
use mauve_wcrt::chains::{ChainEnd, ChainReport, chains_of};
use mauve_wcrt::{
    ActivityReport, Footing, Origin, PREFIX_OF_TOPICS, Query, executed_times, execution_times, is_throttled,
    origin_of, response_times,
};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::{HintStatus, TIGHT_SLACK, chain_figure, met};

/// All figures of a deployment in one state.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Figures {
    /// The deployment.
    pub deployment: String,
    /// The root file of its project.
    pub root: PathBuf,
    /// The significance level.
    pub level: String,
    /// The number of errors in its project: with an error, nothing is proved.
    pub errors: usize,
    /// The first of them: `robot.mal:3: …`.
    pub error: Option<String>,
    /// Why nothing is analysed.
    pub not_analysed: Vec<String>,
    /// In the order of the deployment.
    pub activities: Vec<Figure>,
    /// The declared chains, then those from each source to each sink.
    pub chains: Vec<Figure>,
    /// The utilisation of each CPU that is used: `CPU 1`, `99.4 %`.
    pub cpus: Vec<(String, String)>,
    /// The execution time of each codel and program, by its key in timing tables.
    pub times: Vec<(String, Option<Time>)>,
    /// What the figures assume besides these times and the fields of activities, by name, with its value.
    pub assumptions: Vec<(String, String)>,
}

/// The figure of an activity or a chain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figure {
    /// The instance, or the name of the chain.
    pub name: String,
    /// Whether it is met. That of a chain without a limit is [`Status::Background`].
    pub status: Status,
    /// The response time, or the latency.
    pub time: Option<Time>,
    /// The deadline, or the limit of the latency.
    pub limit: Option<Time>,
    /// In the one form of a figure, as for a hint.
    pub shown: String,
    /// The colour of the hint.
    pub hint: HintStatus,
    /// Why there is no time.
    pub reasons: Vec<String>,
    /// Whether `mauve.toml` accepts that it is not met, with this time.
    is_accepted: bool,
    /// The fields that are compared, each with its value: of an activity, the component alone where it is not declared; of a declared
    /// chain, what it names.
    fields: Vec<(String, String)>,
    /// What a chain without a declaration keeps, where its instances are not renamed: its ends, then the instances on its way.
    way: Vec<[String; 2]>,
}

/// Instead of a value of a field.
const UNKNOWN: &str = "unknown";
const NONE: &str = "none";

/// A renamed activity keeps its component, and at least two of these fields.
const KEPT: [&str; 3] = ["period", "priority", "CPU"];

/// Two states of a deployment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Comparison {
    /// The state before; none if the deployment is new.
    pub before: Option<Figures>,
    /// The state after; none if the deployment is gone.
    pub after: Option<Figures>,
    /// A row for each activity: those after in their order, then those that are gone.
    pub activities: Vec<Compared>,
    /// The same for chains.
    pub chains: Vec<Compared>,
    /// Why the states are not compared: which files cannot be read.
    pub unread: Vec<String>,
}

/// An activity or a chain in two states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Compared {
    /// Before; none if it is new.
    pub before: Option<Figure>,
    /// After; none if it is gone.
    pub after: Option<Figure>,
    /// Whether it may be later by as much as it is.
    pub is_tolerated: bool,
}

/// What happened to a figure, the worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FigureChange {
    /// It was met, and is not now.
    Missed,
    /// It was not known, and is not met.
    FoundMissed,
    /// That it is not met was accepted, and is not now.
    Unaccepted,
    /// It had a time, or was known not to be met, and is not known now.
    Lost,
    /// The latency had a limit, and has none now.
    Unlimited,
    /// It is not there any more.
    Gone,
    /// It was not there, and is not met.
    NewMissed,
    /// The time is longer. What is above is worse too.
    Later,
    /// The time is longer, within the tolerance.
    Tolerated,
    /// The time is the same, the deadline or the limit is later.
    Relaxed,
    /// It was not there.
    New,
    /// It was not met, and is now.
    Met,
    /// It had no time, and has one now.
    Found,
    /// The time is shorter.
    Earlier,
    /// The time is the same, the deadline or the limit is earlier.
    Tightened,
    /// The figure is the same, another field is not.
    OtherFields,
    /// Time and limit are the same.
    Same,
}

impl FigureChange {
    /// Returns its name in documents, and what is said of it in a table.
    fn said(self) -> (&'static str, &'static str) {
        match self {
            FigureChange::Missed => ("missed", "no longer met"),
            FigureChange::FoundMissed => ("found-missed", "known to be missed"),
            FigureChange::Unaccepted => ("unaccepted", "no longer accepted"),
            FigureChange::Lost => ("lost", "not known now"),
            FigureChange::Unlimited => ("unlimited", "has no limit now"),
            FigureChange::Gone => ("gone", "gone"),
            FigureChange::NewMissed => ("new-missed", "new, not met"),
            FigureChange::Later => ("later", "later"),
            FigureChange::Tolerated => ("tolerated", "later, within the tolerance"),
            FigureChange::Relaxed => ("relaxed", "relaxed"),
            FigureChange::New => ("new", "new"),
            FigureChange::Met => ("met", "met now"),
            FigureChange::Found => ("found", "has a figure now"),
            FigureChange::Earlier => ("earlier", "earlier"),
            FigureChange::Tightened => ("tightened", "tightened"),
            FigureChange::OtherFields => ("fields", ""),
            FigureChange::Same => ("same", ""),
        }
    }

    /// Returns its name in documents, such as `found-missed`.
    pub fn name(self) -> &'static str {
        self.said().0
    }

    /// Returns what is said of it in a table.
    pub fn words(self) -> &'static str {
        self.said().1
    }
}

impl Figures {
    /// Returns the figures of a deployment.
    pub fn of<'db>(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        deployment: Decl<'db>,
        query: Query,
    ) -> Figures {
        let report = response_times(db, project, deployment, query);
        let config = config_of(db, project.workspace(db));
        let footings = report.footings();
        let activity = |(it, footing): (&ActivityReport<'db>, Footing)| {
            let forms = figure(db, it, footing, TIGHT_SLACK);
            let mut fields = vec![("component", it.component_name.to_string())];
            let acceptance = accepted(db, project, deployment, &it.instance);
            if (it.priority, it.period, it.deadline) != (Priority::Unknown, None, None) {
                fields.extend(fields_of(it, &report.hosts));
                let accepted = acceptance.map(|it| {
                    let until = it.until.map_or_else(String::new, |until| format!(" until {until}"));
                    format!("\"{}\"{until}", it.reason)
                });
                fields.push(("accepted", accepted.unwrap_or_else(|| NONE.to_owned())));
            }
            Figure {
                name: it.instance.to_string(),
                status: it.verdict,
                time: it.response,
                limit: it.deadline.filter(|_| it.verdict != Status::Background),
                shown: forms.text().to_owned(),
                hint: forms.status,
                reasons: if it.response.is_some() { Vec::new() } else { reasons_of(db, it) },
                is_accepted: acceptance.is_some_and(|of| of.holds(it.response)),
                fields: in_lines(fields),
                way: Vec::new(),
            }
        };
        let chain = |it: &ChainReport<'db>| {
            let reasons = reasons_of_chain(db, it);
            let reason = reasons.first().map_or("", String::as_str);
            let forms = chain_figure((it.latency, it.limit), reason, TIGHT_SLACK);
            let end = |it: &ChainEnd<'db>| {
                [it.instance.to_string(), it.shown(db).replacen(it.instance.as_str(), "", 1)]
            };
            let steps = it.steps.iter().map(|step| [step.instance.to_string(), String::new()]);
            // A declared chain keeps its name.
            let ends = it.ends.iter().filter(|_| it.declared.is_none());
            let way = ends.flat_map(|ends| ends.iter().map(end).chain(steps.clone())).collect();
            Figure {
                name: it.name.to_string(),
                status: match (it.latency, it.limit) {
                    (None, Some(_)) => Status::NoBound,
                    (None, None) => Status::NotAnalysed,
                    (Some(_), None) => Status::Background,
                    (Some(_), Some(_)) if it.is_within_limit() => Status::Met,
                    (Some(_), Some(_)) => Status::Missed,
                },
                time: it.latency,
                limit: it.limit,
                shown: forms.text().to_owned(),
                hint: forms.status,
                reasons,
                is_accepted: false,
                fields: in_lines(
                    it.declared.and_then(|it| config.chains.get(it)).map_or_else(Vec::new, fields_of_chain),
                ),
                way,
            }
        };
        let times = executed_times(db, project, deployment, query.level).iter();
        let of_cpu = |load: &CpuLoad| (report.hosts.names(load.cpus), known_utilisation(load));
        Figures {
            deployment: deployment.qualified(db),
            root: project.root(db).path(db).clone(),
            level: query.level.to_string(),
            errors: errors_of(db, project),
            error: first_error(db, project)
                .map(|it| format!("{}: {}", file_and_line(db, project.workspace(db), &it.at), it.message)),
            not_analysed: report.not_analysed.iter().map(|it| timing_reason(db, &it.reason)).collect(),
            activities: report.activities.iter().zip(footings).map(activity).collect(),
            chains: chains_of(db, project, deployment, query).all.iter().map(chain).collect(),
            cpus: report.cpus.iter().map(of_cpu).collect(),
            times: times.map(|it| (it.of.key(db), it.time(db, query.level))).collect(),
            assumptions: assumptions_of(db, project, deployment, query),
        }
    }

    /// Returns the same where slack below this share of the deadline, in percent, is little.
    pub fn with_tight_slack(mut self, percent: u32) -> Figures {
        for it in self.activities.iter_mut().chain(&mut self.chains) {
            let (Status::Met, Some(time), Some(limit)) = (it.status, it.time, it.limit) else { continue };
            let (mark, hint) = met(time, limit, percent);
            if let Some(rest) = it.shown.strip_prefix(['✓', '!']) {
                (it.shown, it.hint) = (format!("{mark}{rest}"), hint);
            }
        }
        self
    }

    /// Replaces a text in all messages, such as the name of a folder.
    pub fn replace(&mut self, from: &str, to: &str) {
        let figures = self.activities.iter_mut().chain(&mut self.chains);
        let of_figures = figures.flat_map(|it| it.reasons.iter_mut().chain([&mut it.shown]));
        let all = self.not_analysed.iter_mut().chain(&mut self.error).chain(of_figures);
        all.for_each(|text| *text = text.replace(from, to));
    }

    /// Gives the instances in the assumptions other names.
    fn rename(&mut self, renamed: &FxHashMap<&str, &str>) {
        let topic = format!("[access] {PREFIX_OF_TOPICS}");
        for (name, value) in &mut self.assumptions {
            if let Some((instance, port)) = name.strip_prefix(&topic).and_then(|it| it.split_once('.'))
                && let Some(new) = renamed.get(instance)
            {
                *name = format!("{topic}{new}.{port}");
            }
            if name.starts_with("[locks.") {
                let new = |word| *renamed.get(word).unwrap_or(&word);
                *value = value.split(' ').map(new).collect::<Vec<_>>().join(" ");
            }
        }
    }

    /// Returns whether every deadline is proved.
    pub fn schedulable(&self) -> bool {
        self.errors == 0
            && self.not_analysed.is_empty()
            && self.activities.iter().all(|it| it.status.is_met())
    }

    /// Returns how many deadlines are met, and how many there are.
    pub fn met(&self) -> (usize, usize) {
        let counted = self.activities.iter().filter(|it| it.status != Status::Background);
        (counted.clone().filter(|it| it.status.is_met()).count(), counted.count())
    }
}

impl Comparison {
    /// Compares two states. One of them may be missing.
    pub fn of(mut before: Option<Figures>, after: Option<Figures>) -> Comparison {
        let figures = |of: fn(&Figures) -> &Vec<Figure>| {
            [&before, &after].map(|it| it.as_ref().map_or_else(Vec::new, |it| of(it).clone()))
        };
        let row = |(before, after)| Compared { before, after, is_tolerated: false };
        let name = |it: &Figure| Some(vec![it.name.clone()]);
        // One more field than the component may be different, not two: another activity could have come in its place.
        let but = |left_out: &'static str| {
            move |it: &Figure| {
                let is_kept = |(field, _): &&(String, String)| {
                    field == "component" || KEPT.contains(&&**field) && field != left_out
                };
                Some(it.fields.iter().filter(is_kept).map(|(_, value)| value.clone()).collect())
            }
        };
        let [any_period, any_priority, any_cpu] = KEPT.map(but);
        let by_fields: [PairingPass<'_, Figure>; 5] = [
            (false, &name),
            (true, &|it| Some(it.fields.iter().map(|(_, value)| value.clone()).collect())),
            (true, &any_period),
            (true, &any_priority),
            (true, &any_cpu),
        ];
        let activities: Vec<Compared> =
            paired(figures(|it| &it.activities), &by_fields).into_iter().map(row).collect();
        // A chain has the names of its instances: the new ones count.
        let renamed: FxHashMap<&str, &str> =
            activities.iter().filter_map(|it| Some((it.was()?, it.name()))).collect();
        let way = |it: &Figure, most: usize| {
            let new_name = |name: &String| {
                renamed.get(name.as_str()).map_or_else(|| name.clone(), |it| (*it).to_owned())
            };
            let parts =
                it.way.iter().take(most).flat_map(|[instance, end]| [new_name(instance), end.clone()]);
            Some(parts.collect::<Vec<_>>()).filter(|it| !it.is_empty())
        };
        let by_way: [PairingPass<'_, Figure>; 3] =
            [(false, &name), (true, &|it| way(it, usize::MAX)), (true, &|it| way(it, 2))];
        let chains = paired(figures(|it| &it.chains), &by_way).into_iter().map(row).collect();
        before.iter_mut().for_each(|it| it.rename(&renamed));
        Comparison { before, after, activities, chains, unread: Vec::new() }
    }

    /// Compares the deployments of two states: by project and name; those that are left, by name alone, as in a project that has
    /// moved; at last the only one that is left on each side, if they have an activity in common. The others are new or gone.
    pub fn of_all(before: Vec<Figures>, after: Vec<Figures>) -> Vec<Comparison> {
        let project = |it: &Figures| Some(vec![it.root.display().to_string(), it.deployment.clone()]);
        let passes: [PairingPass<'_, Figures>; 3] = [
            (false, &project),
            (false, &|it| Some(vec![it.deployment.clone()])),
            (true, &|_| Some(Vec::new())),
        ];
        let has_activity_of = |one: &Figures, other: &Figures| {
            one.activities.iter().any(|it| other.activities.iter().any(|other| it.name == other.name))
        };
        let pair = |pair: Pair<Figures>| match pair {
            (Some(old), Some(new)) if old.deployment != new.deployment && !has_activity_of(&old, &new) => {
                vec![Comparison::of(None, Some(new)), Comparison::of(Some(old), None)]
            }
            (old, new) => vec![Comparison::of(old, new)],
        };
        let mut all: Vec<Comparison> = paired([before, after], &passes).into_iter().flat_map(pair).collect();
        all.sort_by_key(|it| it.after.is_none());
        all
    }

    /// Returns the name of the deployment before, if it was renamed.
    pub fn was(&self) -> Option<&str> {
        let (before, after) = self.before.as_ref().zip(self.after.as_ref())?;
        (before.deployment != after.deployment).then_some(before.deployment.as_str())
    }

    /// Marks what is later within a tolerance, which depends on the time before.
    pub fn tolerating(mut self, tolerance: &dyn Fn(Time) -> Time) -> Comparison {
        for row in self.activities.iter_mut().chain(&mut self.chains) {
            let time = |it: &Option<Figure>| it.as_ref().and_then(|it| it.time).unwrap_or_default();
            let (before, after) = (time(&row.before), time(&row.after));
            row.is_tolerated = after.checked_sub(before).is_some_and(|more| more <= tolerance(before));
        }
        self
    }

    /// Returns the same without figures, if there are reasons: files of a state cannot be read, so nothing is better, worse or the same.
    pub fn without_unread(self, unread: Vec<String>) -> Comparison {
        let Some(known) = self.state().filter(|_| !unread.is_empty()) else { return self };
        let (deployment, root, level) = (known.deployment.clone(), known.root.clone(), known.level.clone());
        let state = Some(Figures { deployment, root, level, ..Figures::default() });
        Comparison { unread, ..Comparison::of(state.clone(), state) }
    }

    /// Returns whether the states are not compared.
    pub fn is_unread(&self) -> bool {
        !self.unread.is_empty()
    }

    /// Returns the state after; before, if the deployment is gone.
    pub fn state(&self) -> Option<&Figures> {
        self.after.as_ref().or(self.before.as_ref())
    }

    /// Returns the significance level: `1e-4`, or `1e-4 → 1e-6`.
    pub fn level(&self) -> String {
        let states = [&self.before, &self.after].into_iter().flatten();
        let mut levels: Vec<&str> = states.map(|it| it.level.as_str()).collect();
        levels.dedup();
        levels.join(" → ")
    }

    /// Returns all rows.
    pub fn rows(&self) -> impl Iterator<Item = &Compared> {
        self.activities.iter().chain(&self.chains)
    }

    /// Returns whether nothing is different.
    pub fn is_same(&self) -> bool {
        !self.is_unread()
            && self.rows().all(|it| it.change() == FigureChange::Same && it.was().is_none())
            && self.assumptions().is_empty()
            && self.before.as_ref().map(|it| &it.level) == self.after.as_ref().map(|it| &it.level)
            && self.before.as_ref().map(|it| it.errors) == self.after.as_ref().map(|it| it.errors)
    }

    /// Returns whether anything got worse: a figure, or nothing is proved now.
    pub fn is_worse(&self) -> bool {
        let is_sound = |state: &Option<Figures>| {
            state.as_ref().is_none_or(|it| it.errors == 0 && it.not_analysed.is_empty())
        };
        self.after.is_none()
            || self.rows().any(Compared::is_worse)
            || is_sound(&self.before) && !is_sound(&self.after)
    }

    /// Says why nothing is proved or analysed now, or was proved before.
    pub fn unproved(&self) -> Vec<String> {
        let errors = |state: &Option<Figures>| state.as_ref().map_or(0, |it| it.errors);
        let counted = |errors| if errors == 1 { "1 error".to_owned() } else { format!("{errors} errors") };
        let first = self.after.as_ref().and_then(|it| it.error.as_ref());
        let first = first.map_or_else(String::new, |it| format!(": {it}"));
        let said = match (errors(&self.before), errors(&self.after)) {
            (_, after @ 1..) => Some(format!("not proved: the project has {}{first}", counted(after))),
            (before @ 1.., 0) => {
                Some(format!("before, nothing was proved: the project had {}", counted(before)))
            }
            (0, 0) => None,
        };
        let lost = self.after.iter().flat_map(|it| &it.not_analysed);
        let all = self
            .unread
            .iter()
            .cloned()
            .chain(said)
            .chain(lost.map(|why| format!("nothing is analysed: {why}")));
        // A key of mauve.toml may have line breaks.
        all.map(|it| it.replace(char::is_control, "\u{fffd}")).collect()
    }

    /// Returns the execution times that are different, by their keys, before and after: the greatest differences first.
    pub fn times(&self) -> Vec<(&str, [Option<Time>; 2])> {
        let both = self.beside(|it| &it.times);
        let both = both.into_iter().filter_map(|(key, [before, after])| Some((key, [*before?, *after?])));
        let mut different: Vec<_> = both.filter(|(_, [before, after])| before != after).collect();
        different.sort_by_key(|(_, [before, after])| {
            let both = before.zip(*after);
            Reverse(both.map_or(u64::MAX, |(before, after)| before.as_nanos().abs_diff(after.as_nanos())))
        });
        different
    }

    /// Returns the assumptions that are different, by name, before and after; none on a side that does not make it.
    pub fn assumptions(&self) -> Vec<(&str, [Option<&str>; 2])> {
        if self.before.is_none() || self.after.is_none() {
            return Vec::new();
        }
        let both = self.beside(|it| &it.assumptions).into_iter();
        let different = both.filter(|(_, [before, after])| before != after);
        different.map(|(name, values)| (name, values.map(|it| it.map(String::as_str)))).collect()
    }

    /// Returns named values of both states beside each other: those after in their order, then those that are gone.
    pub(crate) fn beside<T>(&self, of: fn(&Figures) -> &[(String, T)]) -> Vec<(&str, [Option<&T>; 2])> {
        let states = [&self.before, &self.after].map(|it| it.iter().flat_map(of).collect());
        let name: PairingPass<'_, &(String, T)> = (false, &|it| Some(vec![it.0.clone()]));
        let pairs = paired(states, &[name]).into_iter().map(|(before, after)| [before, after]);
        let named = pairs.filter_map(|pair| Some((pair.iter().flatten().next()?.0.as_str(), pair)));
        named.map(|(name, pair)| (name, pair.map(|it| it.map(|it| &it.1)))).collect()
    }

    /// Returns `8 → 9 of 9 deadlines met`.
    pub fn verdict(&self) -> String {
        let met = |state: &Option<Figures>| state.as_ref().map(Figures::met);
        match (met(&self.before), met(&self.after)) {
            _ if self.is_unread() => "not compared, since files cannot be read".to_owned(),
            (Some((before, all)), Some((after, of))) if all == of && before == after => {
                format!("{after} of {of} deadlines met, as before")
            }
            (Some((before, all)), Some((after, of))) if all == of => {
                format!("{before} → {after} of {of} deadlines met")
            }
            (Some((before, all)), Some((after, of))) => {
                format!("{before} of {all} → {after} of {of} deadlines met")
            }
            (None, Some((after, of))) => format!("new: {after} of {of} deadlines met"),
            (_, None) => "gone".to_owned(),
        }
    }
}

impl Compared {
    /// Returns its name after; before, if it is gone.
    pub fn name(&self) -> &str {
        self.after.as_ref().or(self.before.as_ref()).map_or("", |it| &it.name)
    }

    /// Returns its name before, if it was renamed.
    pub fn was(&self) -> Option<&str> {
        let before = self.before.as_ref()?;
        (self.after.is_some() && before.name != self.name()).then_some(&before.name)
    }

    /// Returns what happened to it.
    pub fn change(&self) -> FigureChange {
        let is_open = |it: &Figure| !it.status.is_met() && it.limit.is_some();
        let (before, after) = match (&self.before, &self.after) {
            (Some(before), Some(after)) => (before, after),
            (None, Some(after)) if is_open(after) => return FigureChange::NewMissed,
            (None, _) => return FigureChange::New,
            (Some(_), None) => return FigureChange::Gone,
        };
        let is_unknown = |it: &Figure| it.status == Status::NotAnalysed;
        let is_unlimited = |it: &Figure| it.limit.is_none();
        match (before.time, after.time) {
            _ if is_unknown(before) && is_open(after) && !is_unknown(after) => FigureChange::FoundMissed,
            _ if !is_open(before) && is_open(after) => FigureChange::Missed,
            _ if before.is_accepted && !after.is_accepted && is_open(after) => FigureChange::Unaccepted,
            // In the background, nothing is proved.
            (Some(_), None) => FigureChange::Lost,
            _ if is_unknown(after) && !is_unknown(before) && is_open(before) => FigureChange::Lost,
            (_, Some(_)) if !is_unlimited(before) && is_unlimited(after) => FigureChange::Unlimited,
            _ if is_open(before) && after.status.is_met() => FigureChange::Met,
            (Some(_), Some(_)) if is_unlimited(before) && !is_unlimited(after) => FigureChange::Met,
            (None, Some(_)) => FigureChange::Found,
            (one, other) if other > one && self.is_tolerated => FigureChange::Tolerated,
            (one, other) if other > one => FigureChange::Later,
            (one, other) if other < one => FigureChange::Earlier,
            _ if before.limit < after.limit => FigureChange::Relaxed,
            _ if before.limit > after.limit => FigureChange::Tightened,
            _ if !self.fields().is_empty() => FigureChange::OtherFields,
            _ => FigureChange::Same,
        }
    }

    /// Returns whether its deadline or limit is later now.
    pub fn is_relaxed(&self) -> bool {
        let [before, after] = [&self.before, &self.after].map(|it| it.as_ref().and_then(|it| it.limit));
        before.is_some() && after.is_some() && before < after
    }

    /// Returns whether it got worse: later by more than is tolerated, no longer met, or without its figure.
    pub fn is_worse(&self) -> bool {
        match self.change() {
            // What had neither a figure nor a limit proved nothing.
            FigureChange::Gone => {
                self.before.as_ref().is_some_and(|it| it.time.is_some() || it.limit.is_some())
            }
            change => change <= FigureChange::Later,
        }
    }

    /// Returns the fields that are different: `period 100 → 50 ms`, `priority 3 → 5`.
    pub fn fields(&self) -> Vec<String> {
        let [before, after] =
            [&self.before, &self.after].map(|it| it.as_ref().map_or(&[][..], |it| &it.fields));
        // An activity that is not declared has no fields.
        if before.len() != after.len() || before.len() < 2 {
            return Vec::new();
        }
        let both: Vec<_> =
            before.iter().zip(after).map(|((field, old), (_, new))| (field, [old, new])).collect();
        // The deadline is the period, unless both are given.
        let period = both.iter().find(|(field, _)| *field == "period").map(|it| it.1);
        let is_said = |field: &str, values| field != "deadline" || period != Some(values);
        let changed = both.iter().filter(|(field, values)| values[0] != values[1] && is_said(field, *values));
        changed.map(|(field, [before, after])| format!("{field} {before} → {after}")).collect()
    }

    /// Returns the figure, as it was and is: `✓ 53 → 47 / 100 ms`, or `✗ 53 / 50 → ✓ 47 / 100 ms` where the deadlines are different.
    pub fn figure(&self) -> String {
        let (before, after) = match (&self.before, &self.after) {
            (Some(before), Some(after)) if before.shown != after.shown => (&before.shown, &after.shown),
            (_, Some(figure)) | (Some(figure), None) => return figure.shown.clone(),
            (None, None) => return String::new(),
        };
        // The mark, the time, and what is behind it.
        let parts = |shown: &str| {
            let (mark, figure) = shown.split_at_checked(shown.find(|it: char| it.is_ascii_digit())?)?;
            let (time, rest) = figure.split_once(' ')?;
            let is_figure = matches!(mark.trim_end_matches("≤ ").trim_end(), "" | "✓" | "!" | "✗");
            is_figure.then(|| [mark, time, rest].map(str::to_owned))
        };
        match (parts(before), parts(after)) {
            (Some([_, one, rest]), Some([mark, other, same])) if rest == same => {
                format!("{mark}{one} → {other} {rest}")
            }
            (Some(_), Some(_)) if after.ends_with(" ms") => {
                format!("{} → {after}", before.strip_suffix(" ms").unwrap_or(before))
            }
            _ => format!("{before} → {after}"),
        }
    }

    /// Returns the two figures: `✗ 113 / 100 ms`, `✓ 53 / 100 ms`; `–` where it does not exist.
    pub fn shown(&self) -> [String; 2] {
        [&self.before, &self.after]
            .map(|it| it.as_ref().map_or_else(|| "–".to_owned(), |figure| figure.shown.clone()))
    }
}

/// Returns the fields of a declared activity, besides its component.
fn fields_of(it: &ActivityReport<'_>, hosts: &Hosts) -> Vec<(&'static str, String)> {
    let priority = match it.priority {
        Priority::RealTime(priority) => priority.to_string(),
        Priority::Background => "background".to_owned(),
        Priority::Unknown => UNKNOWN.to_owned(),
    };
    let cpus = it.cpus.map_or_else(|| UNKNOWN.to_owned(), |cpus| hosts.names(cpus));
    let time = |time: Option<Time>| time.map_or_else(|| UNKNOWN.to_owned(), |it| it.to_string());
    let clock = if it.clock > 0 { format!(" on clock {}", it.clock) } else { String::new() };
    let wait = it.waits.as_ref().zip(it.demand.machine()).map(|(waits, machine)| {
        let times = waits.times.map_or_else(String::new, |it| format!(" in {it}"));
        format!("{}{times}", waits.greatest(machine))
    });
    let or_none = |it: Option<String>| it.unwrap_or_else(|| NONE.to_owned());
    vec![
        ("priority", priority),
        ("CPU", cpus.trim_start_matches("CPUs ").trim_start_matches("CPU ").to_owned()),
        ("period", time(it.period)),
        ("deadline", time(it.deadline)),
        ("releases", if it.is_sporadic { "sporadic" } else { "periodic" }.to_owned()),
        ("burst", it.burst().to_string()),
        ("jitter", it.jitter.to_string()),
        ("offset", time(it.offset) + &clock),
        ("thread", it.thread.as_ref().map_or_else(|| "its own".to_owned(), Name::to_string)),
        ("order", format!("{:?}", it.order).to_lowercase()),
        ("preemptive", (!it.is_not_preempted).to_string()),
        ("wait", or_none(wait)),
    ]
}

/// Returns what a declared chain names.
fn fields_of_chain(of: &Chain) -> Vec<(&'static str, String)> {
    let names = |all: &[Located]| match all {
        [] => NONE.to_owned(),
        all => all.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", "),
    };
    let [from, to] = [&of.from, &of.to].map(|it| names(it.as_slice()));
    let (through, states, answers) = (names(&of.through), names(&of.states), names(&of.answers));
    vec![("from", from), ("to", to), ("through", through), ("while", states), ("answers", answers)]
}

/// Returns names and values for a line each: strings of mauve.toml may have line breaks.
fn in_lines(all: Vec<(impl Into<String>, String)>) -> Vec<(String, String)> {
    let line = |text: String| text.replace(char::is_control, "\u{fffd}");
    all.into_iter().map(|(name, value)| (line(name.into()), line(value))).collect()
}

/// Returns what the figures of a deployment assume besides the fields of its activities and the times that these execute: of the
/// platform, of times that are not measured, of waits, accesses and locks.
fn assumptions_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<(String, String)> {
    let report = response_times(db, project, deployment, query);
    let config = config_of(db, project.workspace(db));
    let throttling = match is_throttled(db, project.workspace(db)) {
        Some(true) => "on",
        Some(false) => "off",
        None => "assumed to be off",
    };
    let mut all = vec![("real-time throttling".to_owned(), throttling.to_owned())];
    all.extend(report.others().iter().map(|it| {
        let (period, cost) = (it.period.unwrap_or_default(), it.greatest_cost().unwrap_or_default());
        let priority = it.priority.real_time().map_or_else(|| UNKNOWN.to_owned(), |it| it.to_string());
        let cpus = report.hosts.names(it.cpus.unwrap_or_default());
        let burst = if it.burst() > 1 { format!("{} × ", it.burst()) } else { String::new() };
        let jitter = if it.jitter > Time::ZERO { format!(", jitter {}", it.jitter) } else { String::new() };
        let value = format!("{burst}{cost} every {period}{jitter}, priority {priority}, {cpus}");
        (format!("[[platform.other]] {}", it.name), value)
    }));
    all.extend(report.locks().iter().map(|lock| {
        let user = |it: &LockUser| {
            let name = report.activities.get(it.task).map_or("", |it| it.instance.as_str());
            format!("{name} {}", it.held.map_or_else(|| UNKNOWN.to_owned(), |it| it.to_string()))
        };
        let users: Vec<String> = lock.users.iter().map(user).collect();
        (format!("[locks.{}]", lock.name), format!("{}, held by {}", lock.protocol.name(), users.join(", ")))
    }));
    let hosts = config.hosts.iter().enumerate().map(|(host, it)| (Some(host), format!(" on {}", it.name)));
    for (host, place) in hosts.chain(config.hosts.is_empty().then(|| (None, String::new()))) {
        let times = execution_times(db, project, deployment, host, query.level);
        let waits = times.waits.iter().map(|(codel, time)| (format!("[wait] {}", codel.qualified(db)), time));
        let ports = times.accesses.iter();
        let ports = ports.map(|(of, port, time)| (format!("[access] {}.{port}", of.qualified(db)), time));
        let topics = times.topics.iter();
        let topics = topics.map(|(topic, time)| (format!("[access] {PREFIX_OF_TOPICS}{topic}"), time));
        let here = std::iter::once(("[overhead] per wake-up".to_owned(), &times.overhead));
        let here = here.chain(waits).chain(ports).chain(topics);
        all.extend(here.map(|(name, time)| (name + &place, time.to_string())));
    }
    for it in executed_times(db, project, deployment, query.level) {
        let is_assumed =
            it.tables.iter().any(|of| origin_of(db, *of, &it.of, query.level) == Origin::Assumed);
        all.extend(is_assumed.then(|| (format!("time of {}", it.of.key(db)), "assumed".to_owned())));
    }
    let links = config.links.iter().map(|it| (format!("[link.\"{}\"] latency", it.name), it.latency));
    let of_hosts = links.chain([("[clocks] ptp".to_owned(), config.ptp)]);
    all.extend(of_hosts.filter_map(|(name, time)| Some((name, time?.to_string()))));
    in_lines(all)
}

/// Before and after.
type Pair<T> = (Option<T>, Option<T>);

/// Whether only the lone ones of a key are paired, and the key, if there is one.
type PairingPass<'a, T> = (bool, &'a dyn Fn(&T) -> Option<Vec<String>>);

/// Pairs those of two states that have one key, in their order: those that are left after each pass by the next one. Returns the new
/// ones in their order, then those that are gone.
fn paired<T>([old, new]: [Vec<T>; 2], passes: &[PairingPass<'_, T>]) -> Vec<Pair<T>> {
    let mut old: Vec<Option<T>> = old.into_iter().map(Some).collect();
    let mut pairs: Vec<Pair<T>> = new.into_iter().map(|it| (None, Some(it))).collect();
    for (is_lone, key) in passes {
        let mut left: FxHashMap<Vec<String>, [Vec<usize>; 2]> = FxHashMap::default();
        let gone = old.iter().map(Option::as_ref).enumerate().map(|it| (0, it));
        let new = pairs.iter().map(|(before, after)| after.as_ref().filter(|_| before.is_none()));
        for (side, (index, it)) in gone.chain(new.enumerate().map(|it| (1, it))) {
            if let Some(key) = it.and_then(key) {
                left.entry(key).or_default().get_mut(side).into_iter().for_each(|it| it.push(index));
            }
        }
        let is_free = |sides: &[Vec<usize>; 2]| !is_lone || sides.iter().all(|it| it.len() == 1);
        for (from, to) in left.into_values().filter(is_free).flat_map(|[from, to]| from.into_iter().zip(to)) {
            if let (Some(before), Some((place, _))) = (old.get_mut(from), pairs.get_mut(to)) {
                *place = before.take();
            }
        }
    }
    pairs.extend(old.into_iter().flatten().map(|gone| (Some(gone), None)));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::{Expect, expect};
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    const MODEL: &str = "shell Out { output port scan: int } shell In { input port scan: int }
        codel look(): int codel plan(in scan: int): int codel drive(in to: int): void
        core Looks(Out) { update = { write(scan, look()); } }
        core Plans(In) { var seen: int; update = { read(scan, seen); drive(plan(seen)); } }
        component Laser(Out, Looks) component Pilot(In, Plans)
        architecture A { instance laser: Laser instance pilot: Pilot connection laser.scan -> pilot.scan }
        deployment D { architecture A
          activity laser { priority = 2 period = 20 }
          activity pilot { priority = 1 period = 50 deadline = 40 } }";

    fn figures(model: &str, table: &str) -> Figures {
        figures_with(model, table, "platform.rt_throttling = false\n")
    }

    fn figures_with(model: &str, table: &str, config: &str) -> Figures {
        let db = Database::default();
        let config = &*format!("{config}[timing]\ntables = [\"t.toml\"]");
        let files = [("/m.mal", model), ("/mauve.toml", config), ("/t.toml", table)];
        let files = files.map(|(path, text)| (path.into(), text.to_owned()));
        let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        Figures::of(&db, project, of, Query::shown(&db, project, of))
    }

    fn check(change: impl Fn(&str) -> String, table: &str, expected: Expect) {
        let (before, after) = (figures(MODEL, TABLE), figures(&change(MODEL), table));
        let found = Comparison::of(Some(before), Some(after));
        let row = |it: &Compared| {
            let [before, after] = it.shown();
            let was = it.was().map_or_else(String::new, |was| format!(" (was {was})"));
            format!("{}{was}: {before} → {after} {}\n", it.name(), it.change().name())
        };
        let rows: String = found.rows().map(row).collect();
        let verdict = found.verdict();
        let is_worse = found.tolerating(&|before| Time::from_nanos(before.as_nanos() / 4)).is_worse();
        expected.assert_eq(&format!("{verdict}\n{rows}worse: {is_worse}\n"));
    }

    const TABLE: &str = "[codel]\nlook = 5\nplan = 12\ndrive = 1\n";

    #[test]
    fn a_figure_may_be_later_within_the_tolerance() {
        check(
            |it| it.to_owned(),
            "[codel]\nlook = 6\nplan = 12\ndrive = 1\n",
            expect![[r#"
                2 of 2 deadlines met, as before
                laser: ✓ 5 / 20 ms → ✓ 6 / 20 ms later
                pilot: ✓ 18 / 40 ms → ✓ 19 / 40 ms later
                laser.scan -> pilot.drive: ≤ 88 ms → ≤ 89 ms later
                worse: false
            "#]],
        );
        check(
            |it| it.to_owned(),
            "[codel]\nlook = 5\nplan = 31\ndrive = 1\n",
            expect![[r#"
                2 → 1 of 2 deadlines met
                laser: ✓ 5 / 20 ms → ✓ 5 / 20 ms same
                pilot: ✓ 18 / 40 ms → ✗ 47 / 40 ms missed
                laser.scan -> pilot.drive: ≤ 88 ms → ≤ 117 ms later
                worse: true
            "#]],
        );
    }

    #[test]
    fn a_lost_figure_is_worse() {
        check(
            |it| it.to_owned(),
            "[codel]\nlook = 5\nplan = 12\n",
            expect![[r#"
                2 → 1 of 2 deadlines met
                laser: ✓ 5 / 20 ms → ✓ 5 / 20 ms same
                pilot: ✓ 18 / 40 ms → ? no time for drive missed
                laser.scan -> pilot.drive: ≤ 88 ms → ? `pilot` is not analysed: no t… lost
                worse: true
            "#]],
        );
    }

    #[test]
    fn what_was_not_known_and_is_missed_is_worse() {
        let unknown = || Some(figures(MODEL, "[codel]\nlook = 5\nplan = 12\n"));
        let overloaded = || Some(figures(MODEL, "[codel]\nlook = 5\nplan = 60\ndrive = 1\n"));
        let worse = |before, after| {
            let found = Comparison::of(before, after);
            let change = found.activities[1].change().name();
            (change, found.tolerating(&|_| Time::from_nanos(u64::MAX)).is_worse())
        };
        assert_eq!(worse(unknown(), overloaded()), ("found-missed", true));
        assert_eq!(worse(overloaded(), unknown()), ("lost", true));
        assert_eq!(worse(unknown(), Some(figures(MODEL, TABLE))), ("met", false));
    }

    #[test]
    fn renamed_instances_and_their_chains_are_the_same() {
        let renamed = |it: &str| it.replace("laser", "lidar");
        check(
            renamed,
            TABLE,
            expect![[r#"
                2 of 2 deadlines met, as before
                lidar (was laser): ✓ 5 / 20 ms → ✓ 5 / 20 ms same
                pilot: ✓ 18 / 40 ms → ✓ 18 / 40 ms same
                lidar.scan -> pilot.drive (was laser.scan -> pilot.drive): ≤ 88 ms → ≤ 88 ms same
                worse: false
            "#]],
        );
        // With another period too, the only one of its component.
        check(
            |it| renamed(it).replace("period = 20", "period = 25"),
            TABLE,
            expect![[r#"
                2 of 2 deadlines met, as before
                lidar (was laser): ✓ 5 / 20 ms → ✓ 5 / 25 ms relaxed
                pilot: ✓ 18 / 40 ms → ✓ 18 / 40 ms same
                lidar.scan -> pilot.drive (was laser.scan -> pilot.drive): ≤ 88 ms → ≤ 93 ms later
                worse: false
            "#]],
        );
    }

    /// Assumptions that name a renamed instance are those of its new name.
    #[test]
    fn assumptions_of_a_renamed_instance_are_the_same() {
        let hosts = "locks.bus = { codels = [\"look\"], protocol = \"ceiling\", held = \"1 ms\" }
            ros2 = { discovery = \"subnet\", gateway = { priority = 20, period = \"5 ms\" } }
            host.eyes = { activities = [\"laser\"], cpus = 1 }
            host.head = { activities = [\"pilot\"], cpus = 1 }\n";
        let table = format!("{TABLE}[access]\n\"ros2.laser.scan\" = 1\n\"ros2.pilot.scan\" = 1\n");
        let named = |name: &str| {
            let [model, table, hosts] = [MODEL, &*table, hosts].map(|it| it.replace("laser", name));
            Some(figures_with(&model, &table, &hosts))
        };
        let found = Comparison::of(named("laser"), named("lidar"));
        assert!(
            found
                .before
                .as_ref()
                .is_some_and(|it| it.assumptions.iter().any(|(name, _)| name.contains("ros2.lidar.scan")))
        );
        assert_eq!((found.activities[0].was(), found.assumptions()), (Some("laser"), Vec::new()));
    }

    #[test]
    fn a_missed_deadline_that_is_not_accepted_any_more_is_worse() {
        let model = MODEL.replace("deadline = 40", "deadline = 15");
        let with = |model: &str, table: &str, accepted: &str| {
            Some(figures_with(model, table, &format!("deployment.D.accept = {{ pilot = {accepted} }}\n")))
        };
        let change = |before, after| {
            let found = Comparison::of(before, after);
            (found.activities[1].change().name(), found.is_worse())
        };
        let slower = TABLE.replace("12", "13");
        let until = "{ until = \"18 ms\", reason = \"known\" }";
        let renamed = model.replace("pilot", "driver");
        assert_eq!(change(with(&model, TABLE, until), with(&model, TABLE, until)), ("same", false));
        assert_eq!(change(with(&model, TABLE, until), with(&model, &slower, until)), ("unaccepted", true));
        assert_eq!(
            change(with(&model, TABLE, "\"known\""), with(&renamed, TABLE, "\"known\"")),
            ("unaccepted", true)
        );
    }

    /// A renamed instance keeps its component and two of priority, CPU and period; with less, another activity has come in its place.
    #[test]
    fn a_component_alone_is_not_a_renamed_instance() {
        let model = |name: &str, fields: &str| {
            let model = MODEL.replace("laser", name).replace("priority = 2 period = 20", fields);
            Some(figures(&model, TABLE))
        };
        let fields = |priority: u32, cpu: u32, period: u32| {
            format!("priority = {priority} cpus = [{cpu}] period = {period}")
        };
        for (other, is_renamed) in [
            (fields(2, 1, 20), true),
            (fields(3, 1, 20), true),
            (fields(2, 2, 20), true),
            (fields(2, 1, 25), true),
            (fields(3, 2, 20), false),
            (fields(3, 1, 25), false),
            (fields(2, 2, 25), false),
            (fields(3, 2, 25), false),
        ] {
            let found = Comparison::of(model("laser", &fields(2, 1, 20)), model("lidar", &other));
            let was = found.activities[0].was();
            assert_eq!(
                (was, found.activities.len()),
                (is_renamed.then_some("laser"), if is_renamed { 2 } else { 3 }),
                "{other}"
            );
            // The bound of `laser` is gone.
            let gone = found.activities.iter().any(|it| it.change() == FigureChange::Gone && it.is_worse());
            assert_eq!(gone, !is_renamed, "{other}");
        }
    }

    /// Whatever a bound depends on is named where it changes.
    #[test]
    fn each_changed_assumption_is_named() {
        let base = "platform.rt_throttling = false\n";
        let figures = |config: &str, table: &str, model: &str| {
            Some(figures_with(model, table, &format!("{config}{base}")))
        };
        let with = |config: &str| figures(config, TABLE, MODEL);
        let table = |more: &str| figures("", &format!("{TABLE}{more}"), MODEL);
        let activity = |fields: &str| figures("", TABLE, &MODEL.replace("period = 50", fields));
        let placed =
            |fields: &str| figures("platform.cpus = 2\n", TABLE, &MODEL.replace("period = 50", fields));
        let chain = "chains.c = { from = \"laser\", to = \"drive\", through = [\"laser.scan\"] }\n";
        let other = "platform.other = [{ name = \"net\", priority = 90, cpus = [1], period = \"10 ms\", time = \"1 ms\" }]\n";
        let lock = |protocol: &str| {
            with(&format!(
                "locks.bus = {{ codels = [\"look\", \"drive\"], protocol = \"{protocol}\", held = \"1 ms\" }}\n"
            ))
        };
        for (before, after, expected) in [
            (with(""), with(other), "[[platform.other]] net: none → 1 ms every 10 ms, priority 90, CPU 1"),
            (
                with(other),
                with(&other.replace("1 ms\" }", "1.5 ms\" }")),
                "[[platform.other]] net: 1 ms every 10 ms, priority 90, CPU 1 → 1.5 ms every 10 ms, priority 90, CPU 1",
            ),
            (
                with(""),
                Some(figures_with(MODEL, TABLE, "platform.rt_throttling = true\n")),
                "real-time throttling: off → on",
            ),
            (with(""), Some(figures_with(MODEL, TABLE, "")), "real-time throttling: off → assumed to be off"),
            (
                with(""),
                lock("inheritance"),
                "[locks.bus]: none → inheritance, held by laser 1 ms, pilot 1 ms",
            ),
            (
                lock("inheritance"),
                lock("ceiling"),
                "[locks.bus]: inheritance, held by laser 1 ms, pilot 1 ms → ceiling, held by laser 1 ms, pilot 1 ms",
            ),
            (table(""), table("[wait]\nplan = 2\n"), "[wait] plan: none → 2 ms; pilot: wait none → 2 ms"),
            (table(""), table("[access]\n\"Pilot.scan\" = 1\n"), "[access] Pilot.scan: none → 1 ms"),
            (table(""), table("[overhead]\ndispatch = 1\n"), "[overhead] per wake-up: 0 ms → 1 ms"),
            (
                figures("", "[codel]\nlook = 5\nplan = 12\n", MODEL),
                figures("assume.codel = \"1 ms\"\n", "[codel]\nlook = 5\nplan = 12\n", MODEL),
                "time of drive: none → assumed",
            ),
            (
                table(""),
                figures("", &TABLE.replace("drive = 1", "drive = 1 # assumed"), MODEL),
                "time of drive: none → assumed",
            ),
            (
                with(""),
                with("deployment.D.accept = { pilot = \"known\" }\n"),
                "pilot: accepted none → \"known\"",
            ),
            (
                with("deployment.D.accept = { pilot = \"known\" }\n"),
                with("deployment.D.accept = { pilot = { until = \"30 ms\", reason = \"known\" } }\n"),
                "pilot: accepted \"known\" → \"known\" until 30 ms",
            ),
            (
                with(""),
                with("clocks.synchronised = [\"laser\", \"pilot\"]\n"),
                "laser: offset unknown → 0 ms; pilot: offset unknown → 0 ms",
            ),
            (activity("period = 50"), activity("period = 50 jitter = 3"), "pilot: jitter 0 ms → 3 ms"),
            (activity("period = 50"), activity("period = 50 burst = 2"), "pilot: burst 1 → 2"),
            (
                placed("period = 50 cpus = none"),
                placed("period = 50 cpus = [2]"),
                "pilot: priority unknown → 1; pilot: CPU unknown → 2",
            ),
            (placed("period = 50 cpus = [1, 2]"), placed("period = 50 cpus = [2]"), "pilot: CPU 1 and 2 → 2"),
            (
                with(chain),
                with(&chain.replace("through = [\"laser.scan\"]", "answers = [\"pilot.scan\"]")),
                "c: through laser.scan → none; c: answers none → pilot.scan",
            ),
        ] {
            let found = Comparison::of(before, after);
            let assumptions = found.assumptions().into_iter().map(|(name, values)| {
                let [before, after] = values.map(|it| it.unwrap_or("none"));
                format!("{name}: {before} → {after}")
            });
            let fields = found
                .rows()
                .flat_map(|row| row.fields().into_iter().map(|it| format!("{}: {it}", row.name())));
            let said = assumptions.chain(fields).collect::<Vec<_>>().join("; ");
            assert_eq!(said, expected);
            assert!(!found.is_same(), "{expected}");
        }
    }

    #[test]
    fn what_is_gone_or_new_is_said() {
        check(
            |it| it.replace("activity laser { priority = 2 period = 20 }", ""),
            TABLE,
            expect![[r#"
                2 → 0 of 2 deadlines met
                pilot: ✓ 18 / 40 ms → ? see laser missed
                laser: ✓ 5 / 20 ms → ? no activity lost
                laser.scan -> pilot.drive: ≤ 88 ms → ? `laser` has no activity lost
                worse: true
            "#]],
        );
        let second = |it: &str| {
            it.replace("connection", "instance other: Laser connection")
                .replace("activity pilot", "activity other { priority = 3 period = 5 } activity pilot")
        };
        check(
            second,
            TABLE,
            expect![[r#"
                2 of 2 → 1 of 3 deadlines met
                laser: ✓ 5 / 20 ms → ✗ CPU 1 overloaded (125.0 %) missed
                other: – → ! 5 / 5 ms new
                pilot: ✓ 18 / 40 ms → ✗ CPU 1 overloaded (151.0 %) missed
                laser.scan -> pilot.drive: ≤ 88 ms → ? `laser` has no bound on its r… lost
                worse: true
            "#]],
        );
    }
}
