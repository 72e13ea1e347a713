//! Which parts of the main loop's state are outdated: the workspaces, and what was published of the current generation.
//!
//! A *generation* is one state of what the client and the disk have. Each change of a database input begins a new one.
//! The main loop reports what happens by the transitions below, and asks [`Staleness`] what to do next:
//!
//! ```text
//!            outdate_workspaces             begin_load          begin_walk
//! Loaded ─────────────────────▶ Outdated ─────────────▶ Loaded ───────────▶ Walking
//!    ▲                           ▲    ▲                    │                   │
//!    │               note_change │    │ restart_load        │ fail_load         │ end_walk
//!    │               Failed or Stopped ◀───────────────────┴───────────── stop ──┤
//!    └─────────────────────────────────────────────────────────────────────────┘
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Maximum number of checks in a row that load the workspaces again because an included file was not read.
const MAX_LOADS_FOR_CHECKS: u32 = 3;

/// Maximum number of loads in a row that are repeated because a folder was read before it was watched.
pub(super) const MAX_LOADS_FOR_WATCHES: u32 = 3;

/// Whether the workspaces are those of the disk and of the open documents.
#[derive(Debug, Default)]
enum Load {
    #[default]
    Loaded,
    /// Files or folders were created, removed or changed: the workspaces must be loaded again.
    Outdated,
    /// A thread walks through folders, and the workspaces are loaded when it ends.
    Walking { cancelled: Arc<AtomicBool>, is_outdated: bool, is_long: bool },
    /// The user stopped the walk. It is repeated after the next change.
    Stopped,
    /// Loading panicked. It is tried again after the next change.
    Failed,
}

#[derive(Debug, Default, PartialEq, Eq)]
enum Hints {
    /// Nothing, or those of the compared generation: the next comparison finds what has changed.
    #[default]
    Compared,
    /// Those of the current generation, which are not compared yet.
    Current,
    /// Those of a generation that never was compared, or none because a change cancelled the request.
    Outdated,
}

#[derive(Debug, Default)]
struct Generation {
    number: u64,
    is_check_due: bool,
    is_stopped: bool,
}

/// What is outdated, see the module.
#[derive(Debug, Default)]
pub(super) struct Staleness {
    load: Load,
    current: Generation,
    /// Whether checks may start: the client is initialized.
    are_checks_allowed: bool,
    checking: Option<u64>,
    /// The generation of which diagnostics were published last.
    published: Option<u64>,
    /// The last generation whose hints were compared.
    compared: Option<u64>,
    hints: Hints,
    loads_for_checks: u32,
    loads_for_watches: u32,
}

impl Staleness {
    /// The number of the current generation.
    pub(super) fn generation(&self) -> u64 {
        self.current.number
    }

    /// Begins a new generation, which must be checked.
    pub(super) fn bump_generation(&mut self) {
        let number = self.current.number + 1;
        self.current = Generation { number, is_check_due: true, is_stopped: false };
        if self.hints == Hints::Current {
            self.hints = Hints::Outdated;
        }
    }

    /// Begins a new generation that the user does not want to be analysed.
    pub(super) fn stop(&mut self) {
        self.bump_generation();
        self.current.is_stopped = true;
        if let Load::Walking { cancelled, .. } = &self.load {
            cancelled.store(true, Ordering::Relaxed);
            self.load = Load::Stopped;
        }
    }

    /// Forgets what was loaded and published; a new generation is to be loaded.
    pub(super) fn begin_again(&mut self) {
        self.restart_load();
        self.bump_generation();
        (self.checking, self.published, self.compared) = (None, None, None);
        (self.loads_for_checks, self.loads_for_watches) = (0, 0);
    }

    /// Whether the user stopped the analysis of the current generation.
    pub(super) fn is_stopped(&self) -> bool {
        self.current.is_stopped
    }

    /// Whether the diagnostics of the current generation were published. Then all files that it needs are read, or cannot be.
    pub(super) fn is_published(&self) -> bool {
        self.published == Some(self.current.number)
    }

    // Loading.

    /// Whether nothing is left to do before the next event. Workspaces that could not be loaded are not checked.
    pub(super) fn is_settled(&self) -> bool {
        let is_settled = match self.load {
            Load::Loaded | Load::Stopped => !self.current.is_check_due || !self.are_checks_allowed,
            Load::Failed => true,
            Load::Outdated | Load::Walking { .. } => false,
        };
        is_settled && self.checking.is_none()
    }

    /// Whether the workspaces must be loaded again.
    pub(super) fn is_outdated(&self) -> bool {
        matches!(self.load, Load::Outdated | Load::Walking { is_outdated: true, .. })
    }

    /// Whether the workspaces must be loaded again, and can be: no walk must end first.
    pub(super) fn is_load_due(&self) -> bool {
        matches!(self.load, Load::Outdated)
    }

    /// Whether a thread walks through folders.
    pub(super) fn is_walking(&self) -> bool {
        matches!(self.load, Load::Walking { .. })
    }

    /// Notes that the workspaces must be loaded again.
    pub(super) fn outdate_workspaces(&mut self) {
        match &mut self.load {
            Load::Walking { is_outdated, .. } => *is_outdated = true,
            load => *load = Load::Outdated,
        }
    }

    /// Notes that the client or the disk has changed something: a load that panicked, or was stopped, is tried again, and loads in
    /// a row are counted from here.
    pub(super) fn note_change(&mut self) {
        (self.loads_for_checks, self.loads_for_watches) = (0, 0);
        if matches!(self.load, Load::Failed | Load::Stopped) {
            self.load = Load::Outdated;
        }
    }

    /// Begins the load that is due, in a new generation. Returns false if none is.
    pub(super) fn begin_load(&mut self) -> bool {
        let is_due = self.is_load_due();
        if is_due {
            self.load = Load::Loaded;
            self.bump_generation();
        }
        is_due
    }

    /// Begins a walk through folders. The thread that walks stops when the returned flag is set.
    pub(super) fn begin_walk(&mut self) -> Arc<AtomicBool> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let is_outdated = self.is_outdated();
        self.load = Load::Walking { cancelled: Arc::clone(&cancelled), is_outdated, is_long: false };
        cancelled
    }

    /// Notes that the walk that has this flag takes long: nothing waits for its result any more.
    pub(super) fn lengthen_walk(&mut self, flag: &Arc<AtomicBool>) {
        if let Load::Walking { cancelled, is_long, .. } = &mut self.load
            && Arc::ptr_eq(cancelled, flag)
        {
            *is_long = true;
        }
    }

    /// Whether requests wait for the result of a walk.
    pub(super) fn is_awaited(&self) -> bool {
        matches!(self.load, Load::Walking { is_long: false, .. })
    }

    /// Ends the walk that has this flag, in a new generation. Returns false for a walk that was cancelled.
    pub(super) fn end_walk(&mut self, flag: &Arc<AtomicBool>) -> bool {
        match &self.load {
            Load::Walking { cancelled, is_outdated, .. } if Arc::ptr_eq(cancelled, flag) => {
                self.load = if *is_outdated { Load::Outdated } else { Load::Loaded };
                self.bump_generation();
                true
            }
            _ => false,
        }
    }

    /// Cancels the walk, if there is one, and notes that the workspaces must be loaded again.
    pub(super) fn restart_load(&mut self) {
        if let Load::Walking { cancelled, .. } = &self.load {
            cancelled.store(true, Ordering::Relaxed);
        }
        self.load = Load::Outdated;
    }

    /// Notes that loading panicked. Workspaces that are outdated since are loaded again all the same.
    pub(super) fn fail_load(&mut self) {
        if !self.is_outdated() {
            self.load = Load::Failed;
        }
    }

    /// Notes that the folders of the loaded workspaces are watched. Where one `is_new`, its files may have changed between
    /// reading and watching: the workspaces are loaded again, a limited number of times.
    pub(super) fn folders_watched(&mut self, is_new: bool) {
        if is_new && self.loads_for_watches < MAX_LOADS_FOR_WATCHES {
            self.loads_for_watches += 1;
            self.outdate_workspaces();
        } else {
            self.loads_for_watches = 0;
        }
    }

    // Checking.

    /// Allows checks from now on.
    pub(super) fn allow_checks(&mut self) {
        self.are_checks_allowed = true;
    }

    /// Notes that the current generation must be checked, even where a check of it was published.
    pub(super) fn request_check(&mut self) {
        self.current.is_check_due = true;
    }

    /// Whether a check of the current generation is running.
    pub(super) fn is_checking(&self) -> bool {
        self.checking == Some(self.current.number)
    }

    /// Begins the check of the current generation, if it is due and the workspaces are loaded.
    pub(super) fn begin_check(&mut self) -> bool {
        let is_loaded = matches!(self.load, Load::Loaded | Load::Stopped);
        let is_due = self.are_checks_allowed && is_loaded && self.current.is_check_due;
        if is_due {
            self.current.is_check_due = false;
            self.checking = Some(self.current.number);
        }
        is_due
    }

    /// Ends the check of a generation. Returns whether that is the current one.
    pub(super) fn end_check(&mut self, generation: u64) -> bool {
        self.checking = self.checking.filter(|&checking| checking != generation);
        generation == self.current.number
    }

    /// Notes that a check found an included file that was not read. Returns whether the workspaces are loaded again for it,
    /// which is done a limited number of times; otherwise the check is to be published.
    pub(super) fn load_for_check(&mut self) -> bool {
        let is_loaded = self.loads_for_checks < MAX_LOADS_FOR_CHECKS;
        if is_loaded {
            self.loads_for_checks += 1;
            self.outdate_workspaces();
        }
        is_loaded
    }

    /// Notes that the check of the current generation is published. Returns whether the client may show hints that no
    /// comparison has seen, or hints of a generation that is not analysed any more.
    pub(super) fn publish(&mut self) -> bool {
        self.published = Some(self.current.number);
        self.loads_for_checks = 0;
        let is_outdated = self.hints == Hints::Outdated;
        if is_outdated {
            self.hints = Hints::Compared;
        }
        is_outdated || self.current.is_stopped
    }

    /// Notes that the hints of the current generation were compared with those of the generation that was compared before.
    pub(super) fn compare(&mut self) {
        self.compared = Some(self.current.number);
        if self.hints == Hints::Current {
            self.hints = Hints::Compared;
        }
    }

    /// Notes that the client was given the hints of `generation`, or none because a change cancelled the request. Returns
    /// whether it must ask again now. Before a check that is still to come, [`Staleness::publish`] says so.
    pub(super) fn hints_given(&mut self, generation: Option<u64>) -> bool {
        if generation.is_some() && generation == self.compared {
            return false;
        }
        let is_current = generation == Some(self.current.number);
        if self.is_published() {
            self.hints = if is_current { Hints::Current } else { Hints::Compared };
            return !is_current;
        }
        let is_outdated = !is_current || self.hints == Hints::Outdated;
        self.hints = if is_outdated { Hints::Outdated } else { Hints::Current };
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The workspaces are loaded, and the current generation is published.
    fn published() -> Staleness {
        let mut staleness = Staleness::default();
        staleness.allow_checks();
        staleness.outdate_workspaces();
        assert!(!staleness.is_settled() && staleness.begin_load() && staleness.begin_check());
        let generation = staleness.generation();
        assert!(!staleness.is_settled() && staleness.end_check(generation));
        assert!(!staleness.publish() && staleness.is_settled());
        staleness.compare();
        staleness
    }

    #[test]
    fn a_check_begins_once_the_workspaces_are_loaded() {
        let mut staleness = Staleness::default();
        staleness.outdate_workspaces();
        assert!(staleness.begin_load() && !staleness.begin_check() && staleness.is_settled());
        staleness.allow_checks();
        staleness.outdate_workspaces();
        assert!(!staleness.begin_check() && staleness.begin_load());
        let cancelled = staleness.begin_walk();
        assert!(!staleness.begin_check() && !staleness.begin_load());
        staleness.restart_load();
        assert!(cancelled.load(Ordering::Relaxed) && !staleness.end_walk(&cancelled));
        assert!(staleness.begin_load() && staleness.begin_check() && !staleness.begin_check());
    }

    #[test]
    fn a_change_during_a_walk_repeats_the_load() {
        let mut staleness = published();
        let flag = staleness.begin_walk();
        staleness.outdate_workspaces();
        assert!(staleness.is_walking() && staleness.is_outdated() && !staleness.begin_load());
        assert!(staleness.is_awaited());
        staleness.lengthen_walk(&Arc::default());
        assert!(staleness.is_awaited(), "that was another walk");
        staleness.lengthen_walk(&flag);
        assert!(staleness.is_walking() && !staleness.is_awaited());
        assert!(staleness.end_walk(&flag) && staleness.begin_load() && !staleness.begin_load());
    }

    #[test]
    fn a_load_that_panicked_is_tried_again_after_a_change() {
        let mut staleness = published();
        staleness.bump_generation();
        staleness.fail_load();
        assert!(!staleness.begin_check() && !staleness.begin_load());
        staleness.note_change();
        assert!(staleness.begin_load() && staleness.begin_check());
    }

    #[test]
    fn loads_in_a_row_are_limited() {
        let mut staleness = published();
        for _ in 0..MAX_LOADS_FOR_CHECKS {
            assert!(staleness.load_for_check() && staleness.begin_load());
        }
        assert!(!staleness.load_for_check() && !staleness.begin_load());
        for _ in 0..MAX_LOADS_FOR_WATCHES {
            staleness.folders_watched(true);
            assert!(staleness.begin_load());
        }
        staleness.folders_watched(true);
        assert!(!staleness.begin_load());
        staleness.note_change();
        assert!(staleness.load_for_check() && staleness.begin_load());
        staleness.folders_watched(true);
        assert!(staleness.begin_load());
    }

    #[test]
    fn hints_of_another_generation_are_requested_again_once() {
        let mut staleness = published();
        let first = staleness.generation();
        assert!(!staleness.hints_given(Some(first)));
        assert!(staleness.hints_given(None), "no check is to come");
        staleness.bump_generation();
        assert!(!staleness.hints_given(Some(first)), "the check compares these");
        assert!(!staleness.hints_given(Some(first + 1)) && !staleness.publish());
        staleness.compare();
        staleness.bump_generation();
        assert!(!staleness.hints_given(Some(first + 2)));
        staleness.bump_generation();
        assert!(!staleness.hints_given(Some(first + 3)) && staleness.publish());
        staleness.stop();
        assert!(staleness.is_stopped() && !staleness.is_published() && staleness.publish());
        staleness.bump_generation();
        assert!(!staleness.is_stopped() && !staleness.publish());
    }

    #[test]
    fn hints_that_were_not_compared_are_requested_again() {
        let mut staleness = published();
        let first = staleness.generation();
        staleness.bump_generation();
        assert!(!staleness.publish() && !staleness.hints_given(Some(first + 1)));
        // The change cancels the comparison. The next one is with the hints of the first generation.
        staleness.bump_generation();
        assert!(staleness.publish() && !staleness.hints_given(Some(first + 2)));
        staleness.compare();
        staleness.bump_generation();
        assert!(!staleness.publish());
    }
}
