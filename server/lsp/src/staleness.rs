//! Which parts of the main loop's state are outdated: the workspaces, and what was published of the current generation.
//!
//! A *generation* is one state of what the client and the disk have. Each change of a database input begins a new one.
//! The main loop reports what happens by the transitions below, and asks [`Staleness`] what to do next:
//!
//! ```text
//!         outdate_workspaces           begin_load           await_search
//! Loaded ───────────────────▶ Outdated ──────────▶ Loaded ──────────────▶ Awaiting
//!                              ▲    ▲                │ fail_load            │    │
//!                  note_change │    └────────────────┼───────── end_search ─┘    │ stop
//!                              └── Failed, Stopped ◀─┴───────────────────────────┘
//! ```
//!
//! Beside that, a thread may search what has changed on the disk. Checks that the client waits for do not wait for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Maximum number of checks in a row that load the workspaces again because an included file was not read.
const MAX_LOADS_FOR_CHECKS: u32 = 3;

/// So many searches begin at once while events keep coming, and requests wait for them. From then on, each is followed by a pause
/// three times as long as what it causes takes, but not longer than this.
const AT_ONCE: u32 = 5;
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// For so long, a search waits for a check that the client waits for; and events keep coming where one follows within this time.
const PATIENCE: Duration = Duration::from_millis(500);

/// Whether the workspaces are those of the known folders and of the open documents.
#[derive(Debug, Default, PartialEq, Eq)]
enum LoadState {
    #[default]
    Loaded,
    /// Files were created, removed or changed: the workspaces must be loaded again.
    Outdated,
    /// A load needs the result of the next search.
    Awaiting,
    /// The user stopped the search. It is repeated after the next change.
    Stopped,
    /// Loading panicked. It is tried again after the next change.
    Failed,
}

/// The search of what has changed on the disk.
#[derive(Debug, Default)]
struct Searches {
    is_due: bool,
    /// The flag of the running search, when it began, and whether it takes long.
    running: Option<(Arc<AtomicBool>, Instant, bool)>,
    /// When the last one ended.
    end: Option<Instant>,
    /// How long it took, or what followed it.
    cost: Duration,
    in_a_row: u32,
}

#[derive(Debug, Default, PartialEq, Eq)]
enum HintState {
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
    load: LoadState,
    searches: Searches,
    current: Generation,
    /// Whether the client waits for a check, not only the disk has changed.
    is_requested: bool,
    /// Whether checks may start: the client is initialized.
    are_checks_allowed: bool,
    checking: Option<u64>,
    /// The generation of which diagnostics were published last.
    published: Option<u64>,
    /// The last generation whose hints were compared.
    compared: Option<u64>,
    hints: HintState,
    loads_for_checks: u32,
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
        if self.hints == HintState::Current {
            self.hints = HintState::Outdated;
        }
    }

    /// Begins a new generation that the user does not want to be analysed.
    pub(super) fn stop(&mut self) {
        self.bump_generation();
        self.current.is_stopped = true;
        if self.cancel_search() {
            self.load = LoadState::Stopped;
        }
    }

    /// Forgets what was loaded and published; a new generation is to be loaded.
    pub(super) fn begin_again(&mut self) {
        self.restart_load();
        self.bump_generation();
        (self.checking, self.published, self.compared) = (None, None, None);
        self.loads_for_checks = 0;
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
            LoadState::Loaded | LoadState::Stopped => !self.is_check_due(),
            LoadState::Failed => true,
            LoadState::Outdated | LoadState::Awaiting => false,
        };
        is_settled && self.checking.is_none() && !self.is_searching()
    }

    /// Whether the workspaces must be loaded again, at once or after a search.
    pub(super) fn is_outdated(&self) -> bool {
        self.load == LoadState::Outdated || self.searches.is_due
    }

    /// Notes that the workspaces must be loaded again.
    pub(super) fn outdate_workspaces(&mut self) {
        if self.load != LoadState::Awaiting {
            self.load = LoadState::Outdated;
        }
    }

    /// Notes that the client or the disk has changed something: a load that panicked, or was stopped, is tried again, and loads in
    /// a row are counted from here.
    pub(super) fn note_change(&mut self) {
        self.loads_for_checks = 0;
        if matches!(self.load, LoadState::Failed | LoadState::Stopped) {
            self.searches.is_due |= self.load == LoadState::Stopped;
            self.load = LoadState::Outdated;
        }
    }

    /// Begins the load that is due. Returns false if none is.
    pub(super) fn begin_load(&mut self) -> bool {
        let is_due = self.load == LoadState::Outdated;
        if is_due {
            self.load = LoadState::Loaded;
        }
        is_due
    }

    /// Notes that loading panicked. Workspaces that are outdated since are loaded again all the same.
    pub(super) fn fail_load(&mut self) {
        if self.load != LoadState::Outdated {
            self.load = LoadState::Failed;
        }
    }

    // Searching.

    /// Notes that the load needs the result of a search.
    pub(super) fn await_search(&mut self) {
        self.load = LoadState::Awaiting;
        self.searches.is_due = true;
    }

    /// Notes that a search must find out what has changed.
    pub(super) fn request_search(&mut self) {
        self.searches.is_due = true;
    }

    /// Whether a search is due, or a thread searches.
    pub(super) fn is_searching(&self) -> bool {
        self.searches.is_due || self.searches.running.is_some()
    }

    /// Whether the workspaces may lack files. While events keep coming, they are those of the last search.
    pub(super) fn are_files_missing(&self) -> bool {
        let is_loaded = !matches!(self.load, LoadState::Outdated | LoadState::Awaiting);
        !is_loaded || self.is_searching() && self.searches.in_a_row < AT_ONCE
    }

    /// Whether requests wait for a search.
    pub(super) fn is_awaited(&self) -> bool {
        self.are_files_missing() && self.is_searching() && !self.is_search_long()
    }

    /// Returns for how long no search begins, though one is due: what it finds would repeat a check that the client waits for. A
    /// load does not wait for that.
    pub(super) fn pause(&self, now: Instant) -> Option<Duration> {
        let is_due = self.searches.is_due && self.searches.running.is_none();
        let end = self.searches.end.filter(|_| is_due && self.load != LoadState::Awaiting)?;
        let pause = match self.searches.in_a_row >= AT_ONCE {
            _ if self.is_requested && (self.is_checking() || self.is_check_due()) => PATIENCE,
            true => LONGEST_PAUSE.min(3 * self.searches.cost),
            false => Duration::ZERO,
        };
        Some((end + pause).saturating_duration_since(now)).filter(|left| !left.is_zero())
    }

    /// Notes how long it took to load or to check what a search has found.
    pub(super) fn note_cost(&mut self, took: Duration) {
        self.searches.cost = self.searches.cost.max(took);
    }

    /// Begins the search that is due. The thread that searches stops when the returned flag is set.
    pub(super) fn begin_search(&mut self, now: Instant) -> Option<Arc<AtomicBool>> {
        let searches = &self.searches;
        if !searches.is_due || searches.running.is_some() || self.pause(now).is_some() {
            return None;
        }
        let latest = PATIENCE + LONGEST_PAUSE.min(3 * searches.cost);
        let follows = searches.end.is_some_and(|end| now.saturating_duration_since(end) <= latest);
        let in_a_row = if follows { searches.in_a_row.saturating_add(1) } else { 0 };
        let flag = Arc::new(AtomicBool::new(false));
        let running = Some((Arc::clone(&flag), now, false));
        let (end, cost) = (searches.end, Duration::ZERO);
        self.searches = Searches { is_due: false, running, in_a_row, end, cost };
        Some(flag)
    }

    /// Notes that the search that has this flag takes long: nothing waits for its result any more.
    pub(super) fn lengthen_search(&mut self, flag: &Arc<AtomicBool>) {
        if let Some((running, _, is_long)) = &mut self.searches.running
            && Arc::ptr_eq(running, flag)
        {
            *is_long = true;
        }
    }

    fn is_search_long(&self) -> bool {
        self.searches.running.as_ref().is_some_and(|(.., is_long)| *is_long)
    }

    /// Whether a load waits for a search that takes long.
    pub(super) fn is_load_late(&self) -> bool {
        self.load == LoadState::Awaiting && self.is_search_long()
    }

    /// Whether the workspaces are loaded.
    pub(super) fn is_loaded(&self) -> bool {
        self.load == LoadState::Loaded
    }

    /// Ends the search that has this flag. Returns false for one that was cancelled.
    pub(super) fn end_search(&mut self, flag: &Arc<AtomicBool>, now: Instant) -> bool {
        let is_it = |running: &mut (Arc<AtomicBool>, Instant, bool)| Arc::ptr_eq(&running.0, flag);
        let Some((_, begin, _)) = self.searches.running.take_if(is_it) else { return false };
        self.searches.end = Some(now);
        self.note_cost(now.saturating_duration_since(begin));
        if self.load == LoadState::Awaiting {
            self.load = LoadState::Outdated;
        }
        true
    }

    /// Cancels the search, if there is one; it is to be repeated. Returns whether there was one.
    fn cancel_search(&mut self) -> bool {
        let running = self.searches.running.take();
        if let Some((flag, ..)) = &running {
            flag.store(true, Ordering::Relaxed);
        }
        running.is_some()
    }

    /// Cancels the search, if there is one, and notes that the workspaces must be searched and loaded again.
    pub(super) fn restart_load(&mut self) {
        self.cancel_search();
        self.searches.is_due = true;
        self.load = LoadState::Outdated;
    }

    // Checking.

    /// Allows checks from now on.
    pub(super) fn allow_checks(&mut self) {
        self.are_checks_allowed = true;
    }

    /// Notes that the current generation must be checked, even where a check of it was published.
    pub(super) fn request_check(&mut self) {
        (self.current.is_check_due, self.is_requested) = (true, true);
    }

    /// Whether a check of the current generation is running.
    pub(super) fn is_checking(&self) -> bool {
        self.checking == Some(self.current.number)
    }

    fn is_check_due(&self) -> bool {
        self.are_checks_allowed && self.current.is_check_due
    }

    /// Begins the check of the current generation, if it is due and the workspaces are loaded. Where only the disk has changed,
    /// all changes are searched first.
    pub(super) fn begin_check(&mut self) -> bool {
        let is_loaded = matches!(self.load, LoadState::Loaded | LoadState::Stopped);
        let is_loaded = is_loaded && (self.is_requested || !self.is_searching());
        let is_due = is_loaded && self.is_check_due();
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
            self.current.is_check_due = true;
            self.outdate_workspaces();
        }
        is_loaded
    }

    /// Notes that the check of the current generation is published. Returns whether the client may show hints that no
    /// comparison has seen, or hints of a generation that is not analysed any more.
    pub(super) fn publish(&mut self) -> bool {
        self.published = Some(self.current.number);
        self.loads_for_checks = 0;
        self.is_requested = self.current.is_check_due;
        let is_outdated = self.hints == HintState::Outdated;
        if is_outdated {
            self.hints = HintState::Compared;
        }
        is_outdated || self.current.is_stopped
    }

    /// Notes that the hints of the current generation were compared with those of the generation that was compared before.
    pub(super) fn compare(&mut self) {
        self.compared = Some(self.current.number);
        if self.hints == HintState::Current {
            self.hints = HintState::Compared;
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
            self.hints = if is_current { HintState::Current } else { HintState::Compared };
            return !is_current;
        }
        let is_outdated = !is_current || self.hints == HintState::Outdated;
        self.hints = if is_outdated { HintState::Outdated } else { HintState::Current };
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
        assert!(!staleness.is_settled() && staleness.begin_load());
        staleness.bump_generation();
        assert!(staleness.begin_check());
        let generation = staleness.generation();
        assert!(!staleness.is_settled() && staleness.end_check(generation));
        assert!(!staleness.publish() && staleness.is_settled());
        staleness.compare();
        staleness
    }

    #[test]
    fn a_check_begins_once_the_workspaces_are_loaded() {
        let (mut staleness, now) = (Staleness::default(), Instant::now());
        staleness.outdate_workspaces();
        assert!(staleness.begin_load() && !staleness.begin_check() && staleness.is_settled());
        staleness.allow_checks();
        staleness.outdate_workspaces();
        assert!(!staleness.begin_check() && staleness.begin_load());
        staleness.await_search();
        staleness.request_check();
        let cancelled = staleness.begin_search(now).unwrap();
        assert!(!staleness.begin_check() && !staleness.begin_load());
        staleness.restart_load();
        assert!(cancelled.load(Ordering::Relaxed) && !staleness.end_search(&cancelled, now));
        assert!(staleness.begin_load() && staleness.begin_check() && !staleness.begin_check());
    }

    #[test]
    fn a_check_of_an_edit_does_not_wait_for_a_search_and_one_of_the_disk_does() {
        let (mut staleness, now) = (published(), Instant::now());
        staleness.request_search();
        staleness.bump_generation();
        assert!(!staleness.begin_check() && !staleness.is_settled());
        let flag = staleness.begin_search(now).unwrap();
        assert!(!staleness.begin_check());
        staleness.request_check();
        assert!(staleness.begin_check());
        // The search finds something, and a second search is due: the server still answers the edit.
        staleness.request_search();
        assert!(staleness.end_search(&flag, now));
        let generation = staleness.generation();
        staleness.bump_generation();
        assert!(!staleness.end_check(generation) && staleness.begin_check());
        assert!(staleness.end_check(staleness.generation()));
        staleness.publish();
        staleness.bump_generation();
        assert!(!staleness.begin_check());
        let flag = staleness.begin_search(now).unwrap();
        assert!(staleness.end_search(&flag, now) && staleness.begin_check());
    }

    #[test]
    fn searches_that_keep_coming_pause_and_nothing_waits_for_them() {
        let (mut staleness, mut now) = (published(), Instant::now());
        let took = Duration::from_millis(20);
        let search = |staleness: &mut Staleness, now: Instant| {
            staleness.request_search();
            let flag = staleness.begin_search(now)?;
            staleness.end_search(&flag, now + took).then_some(())
        };
        for _ in 0..=AT_ONCE {
            assert!(staleness.pause(now).is_none() && search(&mut staleness, now).is_some());
            now += took;
        }
        assert!(search(&mut staleness, now).is_none() && !staleness.is_awaited() && !staleness.is_settled());
        assert_eq!(staleness.pause(now), Some(3 * took));
        // A load that needs a search does not wait.
        staleness.await_search();
        assert!(staleness.is_awaited() && staleness.pause(now).is_none());
        // A check of what was found took longer.
        staleness.load = LoadState::Loaded;
        staleness.note_cost(2 * took);
        assert_eq!(staleness.pause(now), Some(6 * took));
        staleness.note_cost(LONGEST_PAUSE);
        assert_eq!(staleness.pause(now), Some(LONGEST_PAUSE));
        now += LONGEST_PAUSE + 2 * PATIENCE;
        assert!(search(&mut staleness, now).is_some());
        staleness.request_search();
        assert!(staleness.is_awaited());
    }

    #[test]
    fn a_search_does_not_repeat_a_check_that_the_client_waits_for() {
        let (mut staleness, now) = (published(), Instant::now());
        staleness.request_search();
        let flag = staleness.begin_search(now).unwrap();
        assert!(staleness.end_search(&flag, now));
        staleness.request_check();
        staleness.request_search();
        assert!(staleness.begin_search(now).is_none());
        assert!(staleness.begin_check() && staleness.begin_search(now).is_none());
        assert!(staleness.begin_search(now + PATIENCE).is_some(), "not for ever");
    }

    #[test]
    fn nothing_waits_for_a_long_search() {
        let (mut staleness, now) = (published(), Instant::now());
        staleness.await_search();
        let flag = staleness.begin_search(now).unwrap();
        assert!(staleness.is_awaited());
        staleness.lengthen_search(&Arc::default());
        assert!(staleness.is_awaited(), "that was another search");
        staleness.lengthen_search(&flag);
        assert!(staleness.is_load_late());
        assert!(staleness.is_searching() && !staleness.is_awaited());
        assert!(staleness.end_search(&flag, now) && staleness.begin_load() && !staleness.begin_load());
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
        staleness.note_change();
        assert!(staleness.load_for_check() && staleness.begin_load());
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
