//! A component whose jobs read and write at any statement, and what its data does: by trying all of it.

use std::collections::{BTreeMap, BTreeSet};

/// A statement of a program. All but [`Statement::Compute`] take no time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Statement {
    /// Executes for this long at most, and for 1 at least.
    Compute(u8),
    /// Reads the input into a variable.
    Read(usize),
    /// The same; without new data, goes to the last statement, which is [`Statement::Compute`].
    ReadOrSkip(usize),
    /// The second variable becomes the first one.
    Move(usize, usize),
    /// The second variable becomes a result of both.
    Merge(usize, usize),
    /// The variable becomes a constant.
    Clear(usize),
    /// Writes a variable to the output.
    Write(usize),
}

use Statement::{Clear, Compute, Merge, Move, Read, ReadOrSkip, Write};

pub(crate) const VARIABLES: usize = 2;

/// An edge of the state machine: what a job executes.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Edge {
    pub(crate) source: usize,
    pub(crate) target: usize,
    pub(crate) program: Vec<Statement>,
}

/// A component; it begins in state 0.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Core {
    pub(crate) edges: Vec<Edge>,
}

/// Returns the component with one state and these programs.
pub(crate) fn looping(programs: &[&[Statement]]) -> Core {
    machine(&programs.iter().map(|program| (0, 0, *program)).collect::<Vec<_>>())
}

pub(crate) fn machine(edges: &[(usize, usize, &[Statement])]) -> Core {
    let edge = |&(source, target, program): &(usize, usize, &[Statement])| Edge {
        source,
        target,
        program: program.to_vec(),
    };
    Core { edges: edges.iter().map(edge).collect() }
}

/// Returns the time of the statements of a program.
pub(crate) fn cost(program: &[Statement]) -> u64 {
    let of = |statement: &Statement| if let Compute(time) = statement { u64::from(*time) } else { 0 };
    program.iter().map(of).sum()
}

/// What is known of the passage of data through a component.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Facts {
    /// N.
    pub(crate) releases: Option<u32>,
    /// D.
    pub(crate) periods: Option<u32>,
    pub(crate) keeps: bool,
    /// The releases until the next read of the input, and the next write of the output.
    pub(crate) reads: Option<u32>,
    pub(crate) gap: Option<u32>,
    /// The most writes in one job.
    pub(crate) writes: u32,
    /// The greatest execution time up to a write of the data, for each edge that has one.
    pub(crate) written: Vec<u64>,
}

/// What data has reached: which variables, and whether it was read.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Config {
    state: usize,
    carries: [bool; VARIABLES],
    is_read: bool,
}

/// One way through a program.
#[derive(Clone, Debug)]
struct Way {
    config: Config,
    reads: u32,
    /// For each write, its statement, and whether it carries the data.
    writes: Vec<(usize, bool)>,
}

impl Core {
    fn states(&self) -> BTreeSet<usize> {
        let mut states = BTreeSet::from([0]);
        while let Some(edge) =
            self.edges.iter().find(|edge| states.contains(&edge.source) && !states.contains(&edge.target))
        {
            states.insert(edge.target);
        }
        states
    }

    /// Whether a job may start where the first one did.
    pub(crate) fn returns_to_start(&self) -> bool {
        let states = self.states();
        self.edges.iter().any(|edge| edge.target == 0 && states.contains(&edge.source))
    }

    /// Whether each job that writes ends with its first write.
    pub(crate) fn ends_with_write(&self) -> bool {
        self.edges.iter().all(|edge| {
            let rest = edge.program.iter().skip_while(|it| !matches!(it, Write(_)));
            !rest.into_iter().any(|it| matches!(it, Compute(_)))
        })
    }

    fn edges_of(&self, state: usize) -> impl Iterator<Item = &Edge> {
        self.edges.iter().filter(move |edge| edge.source == state)
    }

    /// Returns the ways through the rest of an edge, if data is there. From the `world`, all data is new.
    fn ways(edge: &Edge, at: usize, way: Way, world: bool, all: &mut Vec<Way>) {
        let Some(statement) = edge.program.get(at) else {
            let config = Config { state: edge.target, ..way.config };
            all.push(Way { config, ..way });
            return;
        };
        let mut next = way.clone();
        let carries = &mut next.config.carries;
        match *statement {
            Compute(_) => {}
            Move(from, to) => carries[to] = carries[from],
            Merge(from, to) => carries[to] |= carries[from],
            Clear(variable) => carries[variable] = false,
            Write(variable) => {
                let is_carried = carries[variable];
                next.writes.push((at, is_carried));
            }
            Read(variable) | ReadOrSkip(variable) => {
                carries[variable] = true;
                next.config.is_read = true;
                next.reads += 1;
                if matches!(statement, ReadOrSkip(_)) && way.config.is_read && !world {
                    Core::ways(edge, edge.program.len() - 1, next.clone(), world, all);
                }
            }
        }
        Core::ways(edge, at + 1, next, world, all);
    }

    /// Returns the ways of jobs in this configuration.
    fn jobs(&self, config: Config, world: bool) -> Vec<(&Edge, Way)> {
        let mut found = Vec::new();
        for edge in self.edges_of(config.state) {
            let mut all = Vec::new();
            Core::ways(edge, 0, Way { config, reads: 0, writes: Vec::new() }, world, &mut all);
            found.extend(all.into_iter().map(|way| (edge, way)));
        }
        found
    }

    /// Returns the ways of the job in progress after data arrived at any of its statements.
    fn arrivals(&self, is_read: bool, world: bool) -> Vec<(&Edge, Way)> {
        let mut found = Vec::new();
        for state in self.states() {
            let config = Config { state, carries: [false; VARIABLES], is_read };
            for edge in self.edges_of(state) {
                for at in 0..=edge.program.len() {
                    let mut all = Vec::new();
                    Core::ways(edge, at, Way { config, reads: 0, writes: Vec::new() }, world, &mut all);
                    found.extend(all.into_iter().map(|way| (edge, way)));
                }
            }
        }
        found
    }

    /// Returns the most jobs after the one in progress until a way `is_done`.
    fn longest(&self, is_read: bool, world: bool, is_done: &dyn Fn(&Way) -> bool) -> Option<u32> {
        let mut known = BTreeMap::new();
        let mut longest = 1;
        for (_, way) in self.arrivals(is_read, world) {
            if !is_done(&way) {
                longest = longest.max(self.from(way.config, world, is_done, &mut known)?);
            }
        }
        Some(longest)
    }

    fn from(
        &self,
        config: Config,
        world: bool,
        is_done: &dyn Fn(&Way) -> bool,
        known: &mut BTreeMap<Config, Option<u32>>,
    ) -> Option<u32> {
        if let Some(known) = known.get(&config) {
            return *known;
        }
        // While it is open, it is met again on a cycle only.
        known.insert(config, None);
        let mut longest = 1;
        for (_, way) in self.jobs(config, world) {
            if !is_done(&way) {
                longest = longest.max(1 + self.from(way.config, world, is_done, known)?);
            }
        }
        known.insert(config, Some(longest));
        Some(longest)
    }

    /// Returns what data from the input, or from the `world`, does.
    pub(crate) fn facts(&self, world: bool) -> Facts {
        let carries = |way: &Way| way.writes.iter().any(|(_, carries)| *carries);
        let ways = self.arrivals(true, world);
        let (keeps, written) = self.writes_of_data(world);
        Facts {
            releases: self.longest(false, world, &carries),
            periods: self.periods(world),
            keeps,
            reads: self.longest(true, world, &|way| way.reads > 0),
            gap: self.longest(true, world, &|way| !way.writes.is_empty()),
            writes: ways.iter().map(|(_, way)| way.writes.len() as u32).max().unwrap_or(0),
            written,
        }
    }

    /// Whether no write carries less than one before it, and the times of the writes that carry data.
    fn writes_of_data(&self, world: bool) -> (bool, Vec<u64>) {
        let (mut keeps, mut written) = (true, BTreeMap::new());
        let mut seen = BTreeSet::new();
        let mut open: Vec<(&Edge, Way, bool)> = Vec::new();
        open.extend(self.arrivals(false, world).into_iter().map(|(edge, way)| (edge, way, false)));
        while let Some((edge, way, mut was_written)) = open.pop() {
            for &(at, carries) in &way.writes {
                keeps &= carries || !was_written;
                was_written |= carries;
                if carries {
                    let place = self.edges.iter().position(|it| std::ptr::eq(it, edge));
                    let time = written.entry(place).or_insert(0);
                    *time = cost(&edge.program[..at]).max(*time);
                }
            }
            if seen.insert((way.config, was_written)) {
                let jobs = self.jobs(way.config, world).into_iter();
                open.extend(jobs.map(|(edge, way)| (edge, way, was_written)));
            }
        }
        (keeps, written.into_values().collect())
    }

    /// Returns the most periods from a read to a write of what was read.
    fn periods(&self, world: bool) -> Option<u32> {
        const MOST: u32 = 20;
        let mut most = 0;
        let mut open = vec![(0, [None; VARIABLES])];
        let mut seen = BTreeSet::new();
        while let Some((state, ages)) = open.pop() {
            if !seen.insert((state, ages)) {
                continue;
            }
            for edge in self.edges_of(state) {
                let older = ages.map(|age: Option<u32>| age.map(|age| (age + 1).min(MOST)));
                let mut ways = vec![(0, older)];
                while let Some((at, mut ages)) = ways.pop() {
                    let Some(statement) = edge.program.get(at) else {
                        open.push((edge.target, ages));
                        continue;
                    };
                    match *statement {
                        Compute(_) => {}
                        Move(from, to) => ages[to] = ages[from],
                        Merge(from, to) => ages[to] = ages[from].into_iter().chain(ages[to]).min(),
                        Clear(variable) => ages[variable] = None,
                        Write(variable) => most = most.max(ages[variable].unwrap_or(0)),
                        Read(variable) => ages[variable] = Some(0),
                        ReadOrSkip(variable) => {
                            ages[variable] = Some(0);
                            if !world {
                                ways.push((edge.program.len() - 1, ages));
                            }
                        }
                    }
                    ways.push((at + 1, ages));
                }
            }
        }
        (most < MOST).then_some(most)
    }
}
