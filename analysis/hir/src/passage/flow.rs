//! Where data may flow in a core, whatever its conditions are: which passages there are.

use super::graph::{JobGraph, JobNode, NodeOperand, NodeStep, SHARED_SLOTS, Slots, bits};

const SHARED: Slots = (1 << SHARED_SLOTS) - 1;

impl<'db> JobGraph<'db> {
    /// Returns the nodes after a node, with the slots that are kept.
    pub(super) fn next(&self, node: &JobNode) -> impl Iterator<Item = (usize, Slots)> + use<> {
        let (next, kept) = match node.step {
            NodeStep::End(state) => ([self.starts.get(state).copied(), None], SHARED),
            _ => (node.next, Slots::MAX),
        };
        next.into_iter().flatten().map(move |next| (next as usize, kept))
    }

    /// Returns, for each node, the slots that may carry data from `source` before it.
    pub(super) fn carried(&self, source: u16) -> Vec<Slots> {
        let mut carried: Vec<Slots> = vec![0; self.nodes.len()];
        let own = self.nodes.iter().enumerate().filter(|(_, node)| node.source == Some(source));
        let mut open: Vec<usize> = own.map(|(index, _)| index).collect();
        while let Some(index) = open.pop() {
            let (Some(node), Some(&before)) = (self.nodes.get(index), carried.get(index)) else { continue };
            let after = node.after(before, node.source == Some(source));
            for (next, kept) in self.next(node) {
                let Some(slots) = carried.get_mut(next) else { continue };
                if after & kept & !*slots != 0 {
                    *slots |= after & kept;
                    open.push(next);
                }
            }
        }
        carried
    }

    /// Finds the cells whose values matter.
    pub(super) fn find_live(&mut self) {
        let used = |operand| if let NodeOperand::Cell(cell) = operand { bits(cell) } else { 0 };
        // Those of shared variables and ports.
        let shared = (0..self.domains.len() as u8).fold(0, |all, cell| all | bits(cell));
        let mut before: Vec<u128> = vec![0; self.nodes.len()];
        let mut is_changed = true;
        while std::mem::take(&mut is_changed) {
            for (index, node) in self.nodes.iter().enumerate().rev() {
                let after = |(next, _): (usize, _)| before.get(next).copied().unwrap_or_default();
                let mut live = self.next(node).map(after).fold(0, |live, it| live | it);
                if let NodeStep::End(_) = node.step {
                    live &= shared;
                }
                if let NodeStep::Read(Some(cell)) = node.step {
                    live &= !bits(cell);
                }
                if let Some((cell, operand)) = node.value
                    && live & bits(cell) != 0
                {
                    live = live & !bits(cell) | used(operand);
                }
                if let NodeStep::Branch(left, right) = node.step {
                    live |= used(left) | used(right);
                }
                if let Some(before) = before.get_mut(index) {
                    is_changed |= *before != live;
                    *before = live;
                }
            }
        }
        self.live = before;
    }

    /// Returns, for each node, the first one from it on that may matter to data on its way.
    pub(super) fn skips(&self, source: Option<u16>, sink: Option<u16>, wanted: &[Slots]) -> Vec<u32> {
        let mut skips: Vec<u32> = (0..self.nodes.len() as u32).collect();
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let [next, other] = node.next.map(|next| next.and_then(|next| skips.get(next as usize)).copied());
            let live = next.and_then(|next| self.live.get(next as usize)).copied().unwrap_or_default();
            let cell = match node.step {
                NodeStep::Read(cell) => cell,
                _ => node.value.map(|(cell, _)| cell),
            };
            let matters = match node.step {
                NodeStep::End(_) => true,
                NodeStep::Branch(..) => next != other,
                NodeStep::Plain | NodeStep::Read(_) => {
                    cell.is_some_and(|cell| live & bits(cell) != 0)
                        || source.is_some() && node.source == source
                        || sink.is_some() && node.sink == sink
                        || node.to & wanted.get(index).copied().unwrap_or_default() != 0
                }
            };
            if let (false, Some(next), Some(skip)) = (matters, next, skips.get_mut(index)) {
                *skip = next;
            }
        }
        skips
    }

    /// Returns, for each node, the slots whose data after it may come to `sink`.
    pub(super) fn wanted(&self, sink: u16) -> Vec<Slots> {
        let mut before: Vec<Slots> = vec![0; self.nodes.len()];
        let mut wanted: Vec<Slots> = vec![0; self.nodes.len()];
        let mut is_changed = true;
        while std::mem::take(&mut is_changed) {
            // All successors but the first node of the next job are later.
            for (index, node) in self.nodes.iter().enumerate().rev() {
                let after = self.next(node).fold(0, |after, (next, kept)| {
                    after | before.get(next).copied().unwrap_or_default() & kept
                });
                let own = if node.sink == Some(sink) { node.from } else { 0 };
                let all = node.before(after) | own;
                if let (Some(before), Some(wanted)) = (before.get_mut(index), wanted.get_mut(index)) {
                    is_changed |= *before != all;
                    (*before, *wanted) = (all, after);
                }
            }
        }
        wanted
    }
}

impl JobNode {
    /// Returns the slots that may carry data after it.
    fn after(&self, before: Slots, is_source: bool) -> Slots {
        let kept = if matches!(self.step, NodeStep::Read(_)) { before } else { before & !self.to };
        if is_source || before & self.from != 0 { kept | self.to } else { kept }
    }

    /// Returns the slots before it whose data comes to any of the slots `after` it.
    fn before(&self, after: Slots) -> Slots {
        let kept = if matches!(self.step, NodeStep::Read(_)) { after } else { after & !self.to };
        if after & self.to != 0 { kept | self.from } else { kept }
    }
}
