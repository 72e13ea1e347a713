//! The trace bound T⁺ of a periodic state machine: the greatest demand of n consecutive periods (paper, eq. 13–18).

use crate::cycle_mean::Adjacency;
use crate::{CycleMean, NoBoundReason, StateMachine, Time};

/// M(n), the greatest total cost of any n consecutive edges of a machine, from any of its states.
///
/// With y₀ = 0 and yₙ₊₁\[s\] = max over the edges (s, t) of their cost + yₙ\[t\], yₙ\[s\] is the greatest total of n
/// edges from s, and M(n) = max yₙ: the n-th max-plus power of the cost matrix, applied from the right. (Paper,
/// eq. 13–16, keep the greatest trace by the state where it ends. By the state where it starts, every entry is a
/// number, since every state has an edge: no −∞ is needed for states that nothing enters.) T⁺ has the increments
/// M(n) − M(n − 1), eq. 18. M is subadditive and never decreases.
///
/// The bound is extended on demand, in O(|E|) per step. From n = 64 on, it searches for a period; once a period is
/// proved, M(n) takes O(1) for every n.
///
/// ```
/// use mauve_timing::{Edge, StateMachine, Time, TraceBound};
///
/// let edge = |source, target, cost| Edge { source, target, cost: Time::from_nanos(cost) };
/// let machine = StateMachine::new(2, vec![edge(0, 0, 1), edge(0, 1, 9), edge(1, 0, 1)])?;
/// let mut bound = TraceBound::new(&machine);
/// let demands: Vec<u64> = (1..=6).map(|n| bound.demand(n).map_or(0, Time::as_nanos)).collect();
/// assert_eq!(demands, [9, 10, 19, 20, 29, 30]);
/// # Ok::<(), mauve_timing::MachineError>(())
/// ```
pub struct TraceBound<'a> {
    machine: &'a StateMachine,
    interrupt: &'a dyn Fn(),
    greatest: u64,
    /// An edge of the greatest cost can be taken in every period: M(n) = n × greatest.
    greatest_repeats: bool,
    /// M(0), M(1), …, as far as computed.
    totals: Vec<u64>,
    recurrence: Option<Recurrence>,
    period: Option<Laps<Front>>,
}

/// The budget of a bound, in edges and states: about 50 ms, and 10 MB.
const BUDGET: u64 = 1 << 24;
/// The number of steps between two calls of `interrupt`: about 200 µs.
const INTERRUPT_EACH: u64 = 1 << 16;
/// The first n at which the search for a period begins.
const FIRST_SEARCH: u64 = 64;
/// The longest period that is searched.
const LONGEST_PERIOD: usize = 256;
/// The maximum number of values in the vectors that are kept for the search.
const LONGEST_HISTORY: usize = 1 << 20;

impl<'a> TraceBound<'a> {
    /// Creates the bound of `machine` in O(1); allocates only when the demand of two periods is computed.
    pub fn new(machine: &'a StateMachine) -> TraceBound<'a> {
        TraceBound::interruptible(machine, &|| ())
    }

    /// Creates a bound that calls `interrupt` regularly during long computations; it may unwind.
    pub(crate) fn interruptible(machine: &'a StateMachine, interrupt: &'a dyn Fn()) -> TraceBound<'a> {
        let greatest = machine.greatest_cost().as_nanos();
        let greatest_repeats = machine.greatest_repeats();
        TraceBound {
            machine,
            interrupt,
            greatest,
            greatest_repeats,
            totals: Vec::new(),
            recurrence: None,
            period: None,
        }
    }

    /// M(n), the greatest demand of `n` consecutive periods. M(0) is 0.
    ///
    /// `Overflow` if it comes within one edge of 2⁶⁴ ns, `Budget` if the budget (which depends on the machine only)
    /// is exhausted before a period is found. Then it is an error for every greater n too.
    pub fn demand(&mut self, n: u64) -> Result<Time, NoBoundReason> {
        if self.greatest_repeats || n <= 1 {
            return self.greatest.checked_mul(n).map(Time::from_nanos).ok_or(NoBoundReason::Overflow);
        }
        loop {
            let known = usize::try_from(n).ok().and_then(|n| self.totals.get(n));
            if let Some(&total) = known {
                return Ok(Time::from_nanos(total));
            }
            if let Some(period) = &self.period {
                return period.demand(n).map(Time::from_nanos).ok_or(NoBoundReason::Overflow);
            }
            self.step()?;
        }
    }

    /// λ, the increment of M in the long run: see [`StateMachine::greatest_cycle_mean`].
    pub(crate) fn greatest_cycle_mean(&self) -> CycleMean {
        self.machine.interruptible_cycle_mean(self.interrupt)
    }

    /// (n₀, c) such that M(n + c) = M(n) + c·λ for every n ≥ n₀; `None` if no such pair is found within the budget.
    pub(crate) fn regularity(&mut self) -> Option<(u64, u64)> {
        if self.greatest_repeats {
            return Some((0, 1));
        }
        loop {
            if let Some(period) = &self.period {
                return period.regularity();
            }
            self.step().ok()?;
        }
    }

    fn step(&mut self) -> Result<(), NoBoundReason> {
        if self.totals.is_empty() {
            self.totals.push(0);
        }
        let recurrence = self.recurrence.get_or_insert_with(|| Recurrence::new(Adjacency::new(self.machine)));
        // No entry is greater than the last total: this is the only sum that needs a check.
        let last = self.totals.last().copied().unwrap_or(0);
        if last.checked_add(self.greatest).is_none() {
            return Err(NoBoundReason::Overflow);
        }
        self.totals.push(recurrence.step(self.interrupt)?);
        self.period = recurrence.look_for_period().map(|period| period.laps(front));
        Ok(())
    }
}

/// The vectors yₙ, and the search for a period in them.
pub(crate) struct Recurrence {
    successors: Adjacency,
    n: u64,
    /// yₙ.
    current: Vec<u64>,
    next: Vec<u64>,
    spent: u64,
    search: TraceSearch,
}

/// From y at `start` on, keeps vectors until there are `rows`; then searches for a period.
struct TraceSearch {
    start: u64,
    longest: usize,
    history: Vec<u64>,
}

impl TraceSearch {
    fn new(start: u64, states: usize) -> TraceSearch {
        let longest = (start as usize / 2).min(LONGEST_PERIOD).min(LONGEST_HISTORY / 2 / states);
        TraceSearch { start, longest, history: Vec::new() }
    }

    /// Returns the number of vectors to keep: 2c + 1 show that the difference over c steps is constant for c further
    /// steps.
    fn rows(&self) -> usize {
        2 * self.longest + 1
    }
}

impl Recurrence {
    pub(crate) fn new(successors: Adjacency) -> Recurrence {
        let states = successors.states();
        Recurrence {
            successors,
            n: 0,
            current: vec![0; states],
            next: vec![0; states],
            spent: 0,
            search: TraceSearch::new(FIRST_SEARCH, states),
        }
    }

    /// yₙ, of the last step.
    pub(crate) fn values(&self) -> &[u64] {
        &self.current
    }

    /// One step of the recurrence: the next M. The caller has checked that it fits 64 bits. Calls `interrupt` now and then:
    /// steps are too short to call it each time.
    pub(crate) fn step(&mut self, interrupt: &dyn Fn()) -> Result<u64, NoBoundReason> {
        let spent = self.spent / INTERRUPT_EACH;
        self.spent += self.successors.arcs.len() as u64 + self.current.len() as u64 + 8;
        if self.spent > BUDGET {
            return Err(NoBoundReason::Budget);
        }
        if self.spent / INTERRUPT_EACH != spent {
            interrupt();
        }
        let mut total = 0;
        let mut begin = 0;
        for (next, &end) in self.next.iter_mut().zip(&self.successors.first[1..]) {
            let mut greatest = 0;
            for &(target, cost) in &self.successors.arcs[begin..end as usize] {
                greatest = greatest.max(self.current[target as usize] + cost);
            }
            *next = greatest;
            total = total.max(greatest);
            begin = end as usize;
        }
        std::mem::swap(&mut self.current, &mut self.next);
        self.n += 1;
        Ok(total)
    }

    pub(crate) fn look_for_period(&mut self) -> Option<Period> {
        if self.n < self.search.start {
            return None;
        }
        let states = self.current.len();
        self.search.history.extend_from_slice(&self.current);
        let rows = self.search.rows();
        if self.search.history.len() < rows * states {
            return None;
        }
        let first = self.n + 1 - rows as u64;
        let found = (1..=self.search.longest).find_map(|length| {
            // The last 2c + 1 vectors, since irregular ones are at the start.
            let unused = rows - (2 * length + 1);
            let vectors = &self.search.history[unused * states..];
            Period::prove(&self.successors, vectors, first + unused as u64, length)
        });
        if found.is_none() {
            // Again when n has doubled; the present vector may be the first of the next search.
            self.search = TraceSearch::new(self.search.start.saturating_mul(2), states);
            if self.n >= self.search.start {
                self.search.history.extend_from_slice(&self.current);
            }
        }
        found
    }
}

/// Proof that the vectors repeat for ever: yₘ₊꜀\[s\] = yₘ\[s\] + K\[s\] for every m ≥ `base`.
///
/// It is enough that this holds for m = base, …, base + c, and that K\[t\] ≤ K\[s\] on every edge (s, t). Suppose that
/// it holds up to some m ≥ base + c. Then yₘ₊₁₊꜀\[s\] = max (cost + yₘ\[t\] + K\[t\]) ≤ yₘ₊₁\[s\] + K\[s\]. And some edge
/// (s, t) gives the greatest sum yₘ₊₁\[s\] = cost + yₘ\[t\] = cost + yₘ₋꜀\[t\] + K\[t\] ≤ yₘ₊₁₋꜀\[s\] + K\[t\], where the left side
/// is yₘ₊₁₋꜀\[s\] + K\[s\]: so K\[t\] = K\[s\], and yₘ₊₁₊꜀\[s\] ≥ cost + yₘ\[t\] + K\[t\] = yₘ₊₁\[s\] + K\[s\].
///
/// K differs between states if parts of the machine cannot be reached again.
pub(crate) struct Period {
    base: u64,
    /// yₙ for n = `base`, …, `base` + c − 1.
    vectors: Vec<u64>,
    /// K, by state.
    gains: Vec<u64>,
}

impl Period {
    /// `vectors` are y at `base`, `base` + 1, …, `base` + 2c, for c = `length`.
    fn prove(successors: &Adjacency, vectors: &[u64], base: u64, length: usize) -> Option<Period> {
        let states = successors.states();
        let value = |step: usize, state: usize| vectors[step * states + state];
        let mut gains = Vec::new();
        for state in 0..states {
            // y never decreases, as no cost is negative.
            let gain = value(length, state) - value(0, state);
            if (1..=length).any(|step| value(step + length, state) - value(step, state) != gain) {
                return None;
            }
            gains.push(gain);
        }
        for state in 0..states {
            if successors.of(state).iter().any(|&(target, _)| gains[target as usize] > gains[state]) {
                return None;
            }
        }
        let vectors = vectors[..length * states].to_vec();
        Some(Period { base, vectors, gains })
    }

    /// Returns the base, c, and K by state.
    pub(crate) fn form(&self) -> (u64, u64, &[u64]) {
        let length = self.vectors.len().checked_div(self.gains.len()).unwrap_or(0);
        (self.base, length as u64, &self.gains)
    }

    /// Returns what is computed from the entries (yₙ\[s\], K\[s\]) of each of the c steps.
    pub(crate) fn laps<F>(&self, of_step: impl Fn(&mut dyn Iterator<Item = (u64, u64)>) -> F) -> Laps<F> {
        let gains = || self.gains.iter().copied();
        let steps = self.vectors.chunks_exact(self.gains.len());
        let steps = steps.map(|values| of_step(&mut values.iter().copied().zip(gains())));
        Laps { base: self.base, steps: steps.collect() }
    }
}

/// What follows from a [`Period`] for each of the c remainders of n − base.
pub(crate) struct Laps<F> {
    base: u64,
    steps: Vec<F>,
}

impl<F> Laps<F> {
    /// Returns the step of n ≥ `base`, and the number of laps before it.
    pub(crate) fn at(&self, n: u64) -> (&F, u64) {
        let length = self.steps.len() as u64;
        let after = n.saturating_sub(self.base);
        (&self.steps[(after % length) as usize], after / length)
    }
}

/// The entries (yₙ\[s\], K\[s\]) that can ever be the greatest.
type Front = Vec<(u64, u64)>;

fn front(entries: &mut dyn Iterator<Item = (u64, u64)>) -> Front {
    let mut entries: Vec<(u64, u64)> = entries.collect();
    entries.sort_unstable_by_key(|&(value, gain)| std::cmp::Reverse((gain, value)));
    let mut front = Front::new();
    for (value, gain) in entries {
        // An entry with a smaller gain must have a greater value.
        if front.last().is_none_or(|&(ahead, _)| value > ahead) {
            front.push((value, gain));
        }
    }
    front
}

impl Laps<Front> {
    /// Returns the n from which on the entries with the greatest gain are the maximum, so that M has that gain; and c.
    fn regularity(&self) -> Option<(u64, u64)> {
        let length = self.steps.len() as u64;
        let mut laps = 0;
        for front in &self.steps {
            // Sorted by decreasing gain and increasing value.
            let (&(slow_start, most), others) = front.split_first()?;
            for &(value, gain) in others {
                laps = laps.max((value - slow_start).div_ceil(most - gain));
            }
        }
        let start = self.base.checked_add(length.checked_mul(laps)?)?;
        Some((start, length))
    }

    /// M(n), n ≥ base; `None` on overflow.
    fn demand(&self, n: u64) -> Option<u64> {
        let (front, laps) = self.at(n);
        let mut total = 0;
        for &(value, gain) in front {
            total = total.max(gain.checked_mul(laps)?.checked_add(value)?);
        }
        Some(total)
    }
}

/// One path of `n` edges of `machine` whose total is M(n), as indices into its edges: for explanations.
///
/// `None` for n > 10,000, for more than 10⁷ states × n, and where the total exceeds 2⁶⁴ ns.
pub fn worst_trace(machine: &StateMachine, n: usize) -> Option<Vec<usize>> {
    const LONGEST: usize = 10_000;
    const MOST_CHOICES: usize = 10_000_000;
    let states = machine.states() as usize;
    if n > LONGEST || states.checked_mul(n)? > MOST_CHOICES {
        return None;
    }
    // For each number of remaining periods, the best edge of each state.
    let mut choices: Vec<u32> = Vec::with_capacity(states * n);
    let mut current = vec![0u64; states];
    for _ in 0..n {
        let mut next = vec![None; states];
        for (index, edge) in (0u32..).zip(machine.edges()) {
            let total = edge.cost.as_nanos().checked_add(current[edge.target as usize])?;
            let best = &mut next[edge.source as usize];
            if best.is_none_or(|(greatest, _)| total > greatest) {
                *best = Some((total, index));
            }
        }
        for (current, best) in current.iter_mut().zip(next) {
            let (total, index) = best?;
            *current = total;
            choices.push(index);
        }
    }
    let mut state = 0;
    for candidate in 1..states {
        if current[candidate] > current[state] {
            state = candidate;
        }
    }
    let mut trace = Vec::with_capacity(n);
    for to_go in (0..n).rev() {
        let edge = *choices.get(to_go * states + state)? as usize;
        trace.push(edge);
        state = machine.edges()[edge].target as usize;
    }
    Some(trace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{brute_force_demand, machine, machines};
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    fn check(machine: StateMachine, expected: Expect) {
        let mut bound = TraceBound::new(&machine);
        let demands: Vec<String> = (1..=6).map(|n| bound.demand(n).unwrap().as_nanos().to_string()).collect();
        expected.assert_eq(&demands.join(" "));
    }

    /// The definition, with nothing kept and nothing proved.
    fn plain_demands(machine: &StateMachine, n: usize) -> Vec<u64> {
        let mut current = vec![0u64; machine.states() as usize];
        let mut demands = vec![0];
        for _ in 0..n {
            let mut next = vec![0; current.len()];
            for edge in machine.edges() {
                let entry = &mut next[edge.source as usize];
                *entry = edge.cost.as_nanos().checked_add(current[edge.target as usize]).unwrap().max(*entry);
            }
            current = next;
            demands.push(current.iter().copied().max().unwrap());
        }
        demands
    }

    #[test]
    fn a_heavy_edge_that_must_leave_its_state_counts_every_other_period() {
        check(machine(2, &[(0, 0, 1), (0, 1, 9), (1, 0, 1)]), expect!["9 10 19 20 29 30"]);
    }

    #[test]
    fn a_heavy_edge_that_repeats() {
        check(machine(2, &[(0, 0, 9), (0, 1, 9), (1, 0, 1)]), expect!["9 18 27 36 45 54"]);
    }

    #[test]
    fn a_heavy_start_that_never_comes_again() {
        check(machine(3, &[(0, 1, 9), (1, 2, 8), (2, 2, 1)]), expect!["9 17 18 19 20 21"]);
    }

    #[test]
    fn parallel_edges_count_as_the_greatest() {
        check(machine(2, &[(0, 1, 3), (0, 1, 5), (1, 0, 4), (1, 0, 2)]), expect!["5 9 14 18 23 27"]);
    }

    #[test]
    fn a_period_for_each_state() {
        // From 1, that gains 9 a period, nothing leads to 0, that could only gain 7.
        let machine = machine(2, &[(0, 0, 7), (0, 1, 6), (1, 1, 9)]);
        let mut bound = TraceBound::new(&machine);
        for n in 0..10_000 {
            assert_eq!(bound.demand(n).unwrap().as_nanos(), 9 * n);
        }
    }

    #[test]
    fn different_gains_are_proved_without_a_repeating_greatest_edge() {
        // 0 repeats 4; 1 and 2 alternate 9 and 1, and reach 0 only.
        let machine = machine(3, &[(1, 2, 9), (2, 1, 1), (1, 0, 9), (0, 0, 4)]);
        let mut bound = TraceBound::new(&machine);
        assert_eq!(bound.demand(1_000_001).unwrap().as_nanos(), 5_000_009);
        assert!(bound.period.is_some());
        assert!(bound.totals.len() < 200);
    }

    #[test]
    fn a_better_way_that_pays_late() {
        // From 0: 5000 and then 100 a period, or 4000 and then 101: the same after 1001.
        let machine = machine(3, &[(0, 2, 5000), (2, 2, 100), (0, 1, 4000), (1, 1, 101)]);
        let mut bound = TraceBound::new(&machine);
        let plain = plain_demands(&machine, 3000);
        for (n, demand) in (0..).zip(plain) {
            assert_eq!(bound.demand(n).unwrap().as_nanos(), demand);
        }
    }

    #[test]
    fn a_fast_part_that_is_ahead_late() {
        // 5000 and then 100 a period, or 101 from the start, in parts of which neither reaches the other.
        let fast = machine(3, &[(0, 2, 5000), (2, 2, 100), (1, 1, 101)]);
        let mut bound = TraceBound::new(&fast);
        let plain = plain_demands(&fast, 6000);
        for (n, demand) in (0..).zip(plain) {
            assert_eq!(bound.demand(n).unwrap().as_nanos(), demand);
        }
        let (start, length) = bound.regularity().unwrap();
        assert_eq!((start, length), (4900, 1));
        // 5001 and then 1 a period, or 3: the same after 2500.
        let slow = machine(3, &[(0, 2, 5001), (2, 2, 1), (1, 1, 3)]);
        assert_eq!(TraceBound::new(&slow).regularity(), Some((2500, 1)));
    }

    #[test]
    fn a_demand_that_does_not_fit() {
        let huge = StateMachine::single(Time::from_nanos(u64::MAX / 2));
        assert!(TraceBound::new(&huge).demand(2).is_ok());
        assert_eq!(TraceBound::new(&huge).demand(3), Err(NoBoundReason::Overflow));
        let huge = machine(2, &[(0, 1, u64::MAX / 4), (1, 0, 0)]);
        let mut bound = TraceBound::new(&huge);
        assert!(bound.demand(6).is_ok());
        assert_eq!(bound.demand(8), Err(NoBoundReason::Overflow));
        assert_eq!(bound.demand(u64::MAX), Err(NoBoundReason::Overflow));
        let slow = machine(2, &[(0, 1, 2), (1, 0, 0)]);
        assert_eq!(TraceBound::new(&slow).demand(u64::MAX).map(Time::as_nanos), Err(NoBoundReason::Overflow));
        assert_eq!(TraceBound::new(&slow).demand(u64::MAX - 1).map(Time::as_nanos), Ok(u64::MAX - 1));
    }

    #[test]
    fn a_budget_and_not_a_wrong_number() {
        // The only cycle is longer than any period that is looked for.
        let states = 1000;
        let edges: Vec<_> =
            (0..states).map(|state| (state, (state + 1) % states, u64::from(state))).collect();
        let ring = machine(states, &edges);
        let mut bound = TraceBound::new(&ring);
        assert_eq!(bound.demand(2000).unwrap().as_nanos(), 999_000);
        assert_eq!(bound.demand(1_000_000), Err(NoBoundReason::Budget));
        assert_eq!(bound.demand(1_000_000), Err(NoBoundReason::Budget));
        assert!(bound.demand(2000).is_ok());
    }

    #[test]
    fn a_trace_of_the_greatest_total() {
        let machine = machine(3, &[(0, 1, 9), (1, 2, 8), (2, 2, 1), (2, 2, 2)]);
        assert_eq!(worst_trace(&machine, 4), Some(vec![0, 1, 3, 3]));
        assert_eq!(worst_trace(&machine, 0), Some(vec![]));
        assert_eq!(worst_trace(&machine, 10_001), None);
    }

    #[test]
    fn a_trace_of_the_first_of_equals() {
        let machine = machine(2, &[(0, 0, 5), (0, 0, 5), (1, 1, 5)]);
        assert_eq!(worst_trace(&machine, 2), Some(vec![0, 0]));
    }

    #[test]
    fn a_trace_that_is_too_long() {
        let loops = |states: u32| machine(states, &(0..states).map(|it| (it, it, 1)).collect::<Vec<_>>());
        assert_eq!(worst_trace(&loops(1), 10_000), Some(vec![0; 10_000]));
        assert_eq!(worst_trace(&loops(1), 10_001), None);
        assert_eq!(worst_trace(&loops(1000), 10_000), Some(vec![0; 10_000]));
        assert_eq!(worst_trace(&loops(1001), 10_000), None);
    }

    #[test]
    fn a_long_computation_can_be_interrupted() {
        let states = 1009;
        let edges: Vec<(u32, u32, u64)> =
            (0..states).map(|state| (state, (state + 1) % states, u64::from(state * state % 7))).collect();
        let ring = machine(states, &edges);
        let looks = std::cell::Cell::new(0);
        let look = || looks.set(looks.get() + 1);
        assert_eq!(TraceBound::interruptible(&ring, &look).demand(1 << 40), Err(NoBoundReason::Budget));
        assert_eq!(looks.get(), BUDGET / INTERRUPT_EACH - 1);
    }

    proptest! {
        #[test]
        fn equals_the_greatest_of_all_paths(machine in machines(4, 10), n in 0..6u64) {
            let expected = (0..machine.states()).map(|state| brute_force_demand(&machine, state, n)).max();
            prop_assert_eq!(Some(TraceBound::new(&machine).demand(n).unwrap().as_nanos()), expected);
        }

        #[test]
        fn is_subadditive_and_never_decreases(machine in machines(5, 20), m in 0..40u64, n in 0..40u64) {
            let mut bound = TraceBound::new(&machine);
            let mut demand = |n| bound.demand(n).unwrap().as_nanos();
            prop_assert!(demand(m + n) <= demand(m) + demand(n));
            prop_assert!(demand(m) <= demand(m + n));
        }

        #[test]
        fn the_extension_equals_the_recurrence(machine in machines(5, 12)) {
            let mut bound = TraceBound::new(&machine);
            let plain = plain_demands(&machine, 10_000);
            for n in (0..200).chain((200..10_000).step_by(37)) {
                prop_assert_eq!(bound.demand(n).unwrap().as_nanos(), plain[n as usize]);
            }
            prop_assert!(bound.totals.len() < 2000, "no period of {:?}", machine);
        }

        #[test]
        fn is_regular_in_the_long_run(machine in machines(5, 12), n in 0..1000u64) {
            let mut bound = TraceBound::new(&machine);
            let (start, length) = bound.regularity().unwrap();
            let mut demand = |n| bound.demand(n).unwrap().as_nanos();
            let gain = demand(start + n + length) - demand(start + n);
            let mean = machine.greatest_cycle_mean();
            prop_assert_eq!(gain * mean.length, mean.cost.as_nanos() * length);
        }

        #[test]
        fn a_worst_trace_is_a_path_of_the_greatest_total(machine in machines(5, 20), n in 0..40usize) {
            let trace = worst_trace(&machine, n).unwrap();
            let edges: Vec<_> = trace.iter().map(|&edge| &machine.edges()[edge]).collect();
            prop_assert!(edges.windows(2).all(|pair| pair[0].target == pair[1].source));
            let total: u64 = edges.iter().map(|edge| edge.cost.as_nanos()).sum();
            prop_assert_eq!(edges.len(), n);
            prop_assert_eq!(total, TraceBound::new(&machine).demand(n as u64).unwrap().as_nanos());
        }
    }
}
