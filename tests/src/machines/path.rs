//! One path through the programs of a component: which of its conditions hold, and what it costs.

use super::interpreter::Key;
use super::{Component, Times};
use crate::model::Signature;

/// One path.
pub(super) struct Path<'a> {
    component: &'a Component,
    times: &'a Times,
    /// Whether each condition so far holds. Those that come later do not.
    choices: Vec<bool>,
    met: usize,
    pub(super) cost: u64,
    /// The costs at the beginnings of the programs under way.
    begun: Vec<u64>,
}

impl<'a> Path<'a> {
    /// Returns the path of a period with these first choices.
    pub(super) fn new(component: &'a Component, times: &'a Times, choices: Vec<bool>) -> Path<'a> {
        Path { component, times, choices, met: 0, cost: times.overhead, begun: Vec::new() }
    }

    /// Returns the first choices of the next path, if there is one.
    pub(super) fn next(self) -> Option<Vec<bool>> {
        // The last condition that did not hold does, and those behind it are open again.
        let mut choices = self.choices;
        while choices.last() == Some(&true) {
            choices.pop();
        }
        *choices.last_mut()? = true;
        Some(choices)
    }

    pub(super) fn choose(&mut self) -> bool {
        if self.met == self.choices.len() {
            self.choices.push(false);
        }
        self.met += 1;
        self.choices[self.met - 1]
    }

    pub(super) fn begin(&mut self) {
        self.begun.push(self.cost);
    }

    /// A table may have a time for the program itself.
    pub(super) fn end(&mut self, key: Key<'_>) {
        let before = self.begun.pop().unwrap();
        if let Some(time) = self.times.programs.get(&Times::key(&self.component.name, key)) {
            self.cost = before + time;
        }
    }

    pub(super) fn codel(&mut self, codel: &Signature) {
        self.cost += self.times.codels[&format!("machines.{}", codel.name)];
    }
}
