//! Sets of CPUs.

use std::fmt;
use std::ops::{BitAnd, BitOr, BitOrAssign, Sub};

use serde::{Serialize, Serializer};

/// A set of CPUs: bit n of the number for CPU n.
///
/// ```
/// use mauve_timing::CpuSet;
///
/// let set = CpuSet(0b101);
/// assert_eq!((set.len(), set.first(), set - CpuSet::of(0)), (2, Some(0), CpuSet::of(2)));
/// assert!(set.meets(CpuSet::first_few(1)) && !set.contains(1));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct CpuSet(pub u128);

impl CpuSet {
    /// The number of CPUs that a set can have.
    pub const MOST: u32 = u128::BITS;
    /// No CPU.
    pub const NONE: CpuSet = CpuSet(0);
    /// Each CPU.
    pub const ALL: CpuSet = CpuSet(u128::MAX);

    /// Returns the set of one CPU; no CPU if there is none of this number.
    pub fn of(cpu: u32) -> CpuSet {
        CpuSet(1_u128.checked_shl(cpu).unwrap_or_default())
    }

    /// Returns the CPUs from 0 to `count` - 1.
    pub fn first_few(count: u32) -> CpuSet {
        (0..count.min(CpuSet::MOST)).collect()
    }

    /// Returns the number of CPUs.
    pub fn len(self) -> u32 {
        self.0.count_ones()
    }

    /// Whether the set has no CPU.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the set has exactly one CPU.
    pub fn is_one(self) -> bool {
        self.0.is_power_of_two()
    }

    /// Whether the set has this CPU.
    pub fn contains(self, cpu: u32) -> bool {
        self.meets(CpuSet::of(cpu))
    }

    /// Whether the sets have a CPU in common.
    pub fn meets(self, other: CpuSet) -> bool {
        self.0 & other.0 != 0
    }

    /// Returns the least number of a CPU.
    pub fn first(self) -> Option<u32> {
        self.iter().next()
    }

    /// Returns the numbers of the CPUs, ascending.
    pub fn iter(self) -> impl Iterator<Item = u32> {
        let next = |rest: &u128| Some(rest & (rest - 1)).filter(|rest| *rest != 0);
        std::iter::successors(Some(self.0).filter(|bits| *bits != 0), next).map(u128::trailing_zeros)
    }

    /// Returns a set for each CPU, ascending.
    pub fn each(self) -> impl Iterator<Item = CpuSet> {
        self.iter().map(CpuSet::of)
    }
}

impl BitAnd for CpuSet {
    type Output = CpuSet;

    fn bitand(self, other: CpuSet) -> CpuSet {
        CpuSet(self.0 & other.0)
    }
}

impl BitOr for CpuSet {
    type Output = CpuSet;

    fn bitor(self, other: CpuSet) -> CpuSet {
        CpuSet(self.0 | other.0)
    }
}

impl BitOrAssign for CpuSet {
    fn bitor_assign(&mut self, other: CpuSet) {
        *self = *self | other;
    }
}

/// The CPUs that only the first set has.
impl Sub for CpuSet {
    type Output = CpuSet;

    fn sub(self, other: CpuSet) -> CpuSet {
        CpuSet(self.0 & !other.0)
    }
}

impl FromIterator<CpuSet> for CpuSet {
    fn from_iter<T: IntoIterator<Item = CpuSet>>(sets: T) -> CpuSet {
        sets.into_iter().fold(CpuSet::NONE, CpuSet::bitor)
    }
}

impl FromIterator<u32> for CpuSet {
    fn from_iter<T: IntoIterator<Item = u32>>(cpus: T) -> CpuSet {
        cpus.into_iter().map(CpuSet::of).collect()
    }
}

/// Above this number of CPUs, those in a row are shown as `3 to 9`.
const MOST_LISTED: u32 = 8;

/// As users number them, from 1.
///
/// ```
/// use mauve_timing::CpuSet;
///
/// assert_eq!(CpuSet(0b1).to_string(), "CPU 1");
/// assert_eq!(CpuSet(0b1011).to_string(), "CPUs 1, 2 and 4");
/// assert_eq!((CpuSet::first_few(96) - CpuSet::of(1)).to_string(), "CPUs 1 and 3 to 96");
/// ```
impl fmt::Display for CpuSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<u32> = self.iter().map(|cpu| cpu + 1).collect();
        let is_short = self.len() <= MOST_LISTED;
        let rows = numbers.chunk_by(|one, next| !is_short && one + 1 == *next);
        let numbers: Vec<String> = rows
            .map(|row| match row {
                [first, .., last] => format!("{first} to {last}"),
                row => row.iter().map(u32::to_string).collect(),
            })
            .collect();
        match numbers.as_slice() {
            [one] if self.is_one() => write!(f, "CPU {one}"),
            [row] => write!(f, "CPUs {row}"),
            [rest @ .., last] => write!(f, "CPUs {} and {last}", rest.join(", ")),
            [] => f.write_str("no CPU"),
        }
    }
}

/// As a number where readers of JSON have integers of 64 bits, and as text in hexadecimal beyond.
impl Serialize for CpuSet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match u64::try_from(self.0) {
            Ok(bits) => serializer.serialize_u64(bits),
            Err(_) => serializer.serialize_str(&format!("{:#x}", self.0)),
        }
    }
}

/// Groups what has CPUs by the CPUs that it shares, directly or through others: each group with all its CPUs.
///
/// ```
/// use mauve_timing::{CpuSet, sharing_cpus};
/// let groups = sharing_cpus([(CpuSet(1), 'a'), (CpuSet(4), 'b'), (CpuSet(3), 'c')]);
/// assert_eq!(groups, [(CpuSet(4), vec!['b']), (CpuSet(3), vec!['a', 'c'])]);
/// ```
pub fn sharing_cpus<T>(all: impl IntoIterator<Item = (CpuSet, T)>) -> Vec<(CpuSet, Vec<T>)> {
    let mut groups: Vec<(CpuSet, Vec<T>)> = Vec::new();
    for (cpus, it) in all {
        let mut joined = (cpus, Vec::new());
        for (others, members) in groups.extract_if(.., |group| group.0.meets(cpus)) {
            joined.0 |= others;
            joined.1.extend(members);
        }
        joined.1.push(it);
        groups.push(joined);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_up_to_128_cpus() {
        let ends = CpuSet::of(0) | CpuSet::of(127);
        assert_eq!(ends.iter().collect::<Vec<_>>(), [0, 127]);
        assert_eq!(ends.each().collect::<CpuSet>(), ends);
        assert_eq!((CpuSet::of(128), CpuSet::NONE.first()), (CpuSet::NONE, None));
        assert_eq!((CpuSet::first_few(96).len(), CpuSet::first_few(200)), (96, CpuSet::ALL));
        assert_eq!((CpuSet::ALL - ends).len(), 126);
        assert!(CpuSet::of(64).is_one() && !ends.is_one() && !CpuSet::NONE.is_one());
    }

    #[test]
    fn more_than_64_bits_are_text_in_json() {
        let json = |set: CpuSet| serde_json::to_string(&set).unwrap();
        assert_eq!([json(CpuSet(3)), json(CpuSet::of(63))], ["3", "9223372036854775808"]);
        assert_eq!(json(CpuSet::of(95)), "\"0x800000000000000000000000\"");
    }
}
