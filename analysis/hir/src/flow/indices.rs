//! Sets of indices.

/// A set of small indices, as bits.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Indices(Vec<u64>);

impl Indices {
    /// Returns the set of all indices before `end`.
    pub(super) fn before(end: usize) -> Indices {
        Indices(vec![u64::MAX; end.div_ceil(64)]).below(end)
    }

    pub(super) fn insert(&mut self, index: usize) {
        if self.0.len() <= index / 64 {
            self.0.resize(index / 64 + 1, 0);
        }
        if let Some(word) = self.0.get_mut(index / 64) {
            *word |= 1 << (index % 64);
        }
    }

    pub(super) fn remove(&mut self, index: usize) {
        if let Some(word) = self.0.get_mut(index / 64) {
            *word &= !(1 << (index % 64));
        }
    }

    pub(super) fn contains(&self, index: usize) -> bool {
        self.0.get(index / 64).is_some_and(|word| word & (1 << (index % 64)) != 0)
    }

    pub(super) fn add(&mut self, others: &Indices) {
        self.0.resize(self.0.len().max(others.0.len()), 0);
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word |= other);
    }

    pub(super) fn intersect(&mut self, others: &Indices) {
        self.0.truncate(others.0.len());
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word &= other);
    }

    /// Returns the set without the indices from `end` on.
    pub(super) fn below(mut self, end: usize) -> Indices {
        self.0.truncate(end.div_ceil(64));
        if let Some(word) = self.0.get_mut(end / 64) {
            *word &= (1 << (end % 64)) - 1;
        }
        self.0.shrink_to_fit();
        self
    }
}
