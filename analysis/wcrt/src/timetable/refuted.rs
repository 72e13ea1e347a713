//! What recordings refuted: the files of `[timing] observed`, compared with the tables. What a refuted time is for has no time until
//! a table, a wait or a newer recording mends it.

use std::sync::Arc;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, Location, ModelDb, names_of, platform_of};
use mauve_timing::{
    LEAST_WAIT, LEAST_WORK, Level, Observed, ObservedError, ObservedTimes, TableSection, Time, Times,
    UNSUSPICIOUS,
};

use super::{IMPROBABLE, TimeSlot, TimetableBuilder, files_in, timed_by, topics_of};
use crate::fact::{Recorded, TimingFactKind};
use crate::reason::{PREFIX_OF_TOPICS, TableFault, Timed, UnusableTime};
use crate::table_set::TableSet;

/// Reads a file of `[timing] observed`, and returns what is wrong with it.
#[salsa::tracked(returns(ref))]
pub fn observed_in(db: &dyn ModelDb, file: File) -> (Arc<Observed>, Vec<ObservedError>) {
    let (observed, errors) = Observed::parse(file.text(db));
    (Arc::new(observed), errors)
}

/// Returns what recordings showed of the response times of an instance, by the files of `[timing] observed` beside these tables.
pub fn observed_responses<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, instance: &str) -> ObservedTimes {
    let files = files_in(db, tables, true);
    let mut all = ObservedTimes::default();
    let found = files.files.iter().filter_map(|&file| observed_in(db, file).0.responses.get(instance));
    found.for_each(|it| all.add(it));
    all
}

impl<'db> TimetableBuilder<'db> {
    /// Compares the entries of the tables, which are all read, with what recordings showed.
    pub(super) fn observed(&mut self, files: &[File], host: Option<&Name>) {
        let db = self.db;
        for &file in files {
            let (observed, errors) = observed_in(db, file);
            for error in errors {
                let at = Location::of_span(file, &error.span);
                self.fault(at, TableFault::Observed(error.kind.clone()));
            }
            for (key, codel) in &observed.codels {
                for decl in names_of(db, self.project).by_key(Kind::Codel, key) {
                    self.observed_codel(file, *decl, codel);
                }
            }
            let topics = topics_of(db, self.project);
            let programs = observed.programs.iter().map(|it| (TableSection::Program, it));
            let accesses = observed.accesses.iter().map(|it| (TableSection::Access, it));
            for (section, (key, times)) in programs.chain(accesses) {
                let topic = key.strip_prefix(PREFIX_OF_TOPICS).filter(|it| topics.contains(*it));
                let found = match topic.filter(|_| section == TableSection::Access) {
                    Some(topic) => vec![Timed::Topic(topic.into())],
                    None => timed_by(db, self.project, section, key),
                };
                found.into_iter().for_each(|of| self.observed_time(file, of, times));
            }
            for (thread, work) in observed.work.iter().filter(|(_, it)| it.greatest >= LEAST_WORK) {
                // What another host has is not on this one. A recording that belongs to no host may be that of any.
                let is_here = |only: &Option<Name>| only.is_none() || only.as_ref() == host;
                let mut others = platform_of(db, self.project.workspace(db)).others.iter();
                if others.any(|(other, only)| *other.name == **thread && is_here(only)) {
                    continue;
                }
                let at = Location::of_span(file, &work.span);
                let per_second = Time::from_nanos(work.greatest);
                self.report(
                    at,
                    TimingFactKind::Recorded(Recorded::WorkElsewhere { thread: thread.clone(), per_second }),
                );
            }
        }
    }

    fn observed_codel(&mut self, file: File, codel: Decl<'db>, observed: &ObservedTimes) {
        self.observed_time(file, Timed::Codel(codel), observed);
        let of = Timed::Wait(codel);
        let wait = Time::from_nanos(observed.wait);
        let times = ObservedTimes { greatest: observed.wait, ..observed.clone() };
        let (name, is_known) = (codel.qualified(self.db), times.is_wait_known);
        let waiting = |written| Recorded::WaitingCodel { codel: name.clone(), wait, written, is_known, file };
        let recorded = match self.times.slots.get(&of).map(Vec::as_slice) {
            Some([slot]) => match (self.refuted(slot, &times), slot.waits.filter(|it| times.times > *it)) {
                (Some(written), _) => waiting(Some(written)),
                (None, Some(written)) => {
                    Recorded::WaitsOften { codel: name, times: times.times, written, file }
                }
                (None, None) => return,
            },
            None if is_known && (1..=LEAST_WAIT).contains(&times.greatest) => {
                Recorded::BriefWait { codel: name, wait, executions: times.executions, file }
            }
            None if times.greatest > UNSUSPICIOUS || is_known && times.greatest > 0 => waiting(None),
            _ => return,
        };
        if !matches!(recorded, Recorded::BriefWait { .. }) {
            self.times.refuted.insert(of.clone(), UnusableTime::Refuted(of, wait));
        }
        let at = self.location_of(&Timed::Codel(codel), file, &times.span);
        self.report(at, TimingFactKind::Recorded(recorded));
    }

    fn observed_time(&mut self, file: File, of: Timed<'db>, times: &ObservedTimes) {
        let observed = Time::from_nanos(times.greatest);
        let written = match (self.times.slots.get(&of).map(Vec::as_slice), &of) {
            (Some([slot]), _) => self.refuted(slot, times),
            (Some(_), _) => None,
            (None, Timed::Codel(_)) => self.times.assume.filter(|assumed| observed > *assumed),
            (None, Timed::Access(..)) if times.greatest > UNSUSPICIOUS => Some(Time::ZERO),
            (None, _) => None,
        };
        let Some(written) = written else { return };
        self.times.refuted.insert(of.clone(), UnusableTime::Refuted(of.clone(), observed));
        let at = self.location_of(&of, file, &times.span);
        self.report(at, TimingFactKind::Recorded(Recorded::RefutedTime { of, observed, written, file }));
    }

    /// Returns the time of an entry that is refuted. A time for every level is, by one longer execution; one of a level, if that is
    /// improbable in so many executions.
    fn refuted(&self, slot: &TimeSlot, observed: &ObservedTimes) -> Option<Time> {
        let is_longer = |time: &Time| observed.greatest > time.as_nanos();
        match slot.times.as_ref()? {
            Times::Always(time) => Some(*time).filter(is_longer),
            Times::PerLevel(times) => {
                let is_improbable =
                    |level: &Level| level.as_f64() * (observed.executions as f64) < IMPROBABLE;
                let all = slot.levels.iter().zip(times);
                all.filter(|(level, _)| is_improbable(level)).map(|(_, time)| *time).find(is_longer)
            }
        }
    }

    /// Returns where a table has this, or what was observed of it.
    fn location_of(&self, of: &Timed<'db>, file: File, span: &std::ops::Range<usize>) -> Location<'db> {
        let written = self.locations.get(of).and_then(|all| all.first());
        written.map_or(Location::of_span(file, span), |(at, _)| at.clone())
    }
}
