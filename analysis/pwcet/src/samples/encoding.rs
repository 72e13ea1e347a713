//! Numbers in a variable number of bytes, and executions as differences: neighbours are similar.
//!
//! | of an execution | as |
//! |---|---|
//! | execution time | difference to the one before |
//! | elapsed time | difference to the execution time: what preempted it |
//! | time of the end | difference of the difference: a period repeats |
//!
//! Each block of executions begins without a predecessor, so that it can be read on its own.

/// Appends a number, 7 bits in a byte, the lowest first.
pub(super) fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Appends a text with its length.
pub(super) fn put_text(bytes: &mut Vec<u8>, text: &str) {
    put(bytes, text.len() as u64);
    bytes.extend(text.as_bytes());
}

/// Takes numbers and texts from the front of bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    /// Takes a number; none if it is incomplete or does not fit.
    pub(super) fn number(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let (byte, rest) = self.0.split_first()?;
            self.0 = rest;
            let bits = u64::from(byte & 0x7f);
            // The tenth byte has one bit.
            if bits << shift >> shift != bits {
                return None;
            }
            value |= bits << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.number()?).ok()?;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        std::str::from_utf8(text).ok()
    }
}

/// A signed difference, modulo 2⁶⁴, as a number that is small if the difference is.
fn zigzag(from: u64, to: u64) -> u64 {
    let difference = to.wrapping_sub(from) as i64;
    (difference << 1 ^ difference >> 63) as u64
}

fn un_zigzag(from: u64, value: u64) -> u64 {
    from.wrapping_add((value >> 1) ^ (value & 1).wrapping_neg())
}

/// One execution. Times are in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampledExecution {
    /// The CPU time.
    pub execution: u64,
    /// The time from its begin to its end.
    pub elapsed: Option<u64>,
    /// When it ended.
    pub end: Option<u64>,
    /// The index of its [`Run`](super::Run).
    pub run: u32,
}

/// Which of the optional times all executions of a block have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Has {
    pub(super) elapsed: bool,
    pub(super) end: bool,
}

impl Has {
    pub(super) fn of(it: &SampledExecution) -> Has {
        Has { elapsed: it.elapsed.is_some(), end: it.end.is_some() }
    }

    pub(super) fn bits(self) -> u64 {
        u64::from(self.elapsed) | u64::from(self.end) << 1
    }

    pub(super) fn of_bits(bits: u64) -> Option<Has> {
        (bits < 4).then_some(Has { elapsed: bits & 1 == 1, end: bits & 2 == 2 })
    }
}

/// Encodes or decodes the executions of a block one after the other.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Codec {
    /// Of the execution before; an absent end is 0.
    execution: u64,
    end: u64,
    interval: u64,
}

impl Codec {
    pub(super) fn put(&mut self, bytes: &mut Vec<u8>, it: &SampledExecution) {
        put(bytes, zigzag(self.execution, it.execution));
        if let Some(elapsed) = it.elapsed {
            put(bytes, zigzag(it.execution, elapsed));
        }
        if let Some(end) = it.end {
            put(bytes, zigzag(self.interval, end.wrapping_sub(self.end)));
        }
        self.next(it);
    }

    /// Takes an execution of this run that has these times.
    pub(super) fn take(&mut self, bytes: &mut Bytes<'_>, has: Has, run: u32) -> Option<SampledExecution> {
        let mut it = SampledExecution {
            execution: un_zigzag(self.execution, bytes.number()?),
            elapsed: None,
            end: None,
            run,
        };
        if has.elapsed {
            it.elapsed = Some(un_zigzag(it.execution, bytes.number()?));
        }
        if has.end {
            it.end = Some(self.end.wrapping_add(un_zigzag(self.interval, bytes.number()?)));
        }
        self.next(&it);
        Some(it)
    }

    fn next(&mut self, it: &SampledExecution) {
        let end = it.end.unwrap_or(0);
        // The first end is not an interval.
        self.interval = if self.end == 0 { 0 } else { end.wrapping_sub(self.end) };
        (self.execution, self.end) = (it.execution, end);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn executions() -> impl Strategy<Value = SampledExecution> {
        let time = prop_oneof![0_u64..1000, any::<u64>()];
        (time.clone(), time.clone(), time).prop_map(|(execution, elapsed, end)| SampledExecution {
            execution,
            elapsed: Some(elapsed),
            end: Some(end),
            run: 3,
        })
    }

    proptest! {
        #[test]
        fn numbers_are_read_as_they_were_written(values in proptest::collection::vec(any::<u64>(), 0..10)) {
            let mut bytes = Vec::new();
            values.iter().for_each(|value| put(&mut bytes, *value));
            let mut rest = Bytes(&bytes);
            for value in values {
                prop_assert_eq!(rest.number(), Some(value));
            }
            prop_assert_eq!(rest.number(), None);
        }

        #[test]
        fn executions_are_read_as_they_were_written(
            mut all in proptest::collection::vec(executions(), 0..20), bits in 0_u64..4,
        ) {
            let has = Has::of_bits(bits).unwrap();
            for it in &mut all {
                (it.elapsed, it.end) = (it.elapsed.filter(|_| has.elapsed), it.end.filter(|_| has.end));
            }
            let mut bytes = Vec::new();
            let mut codec = Codec::default();
            all.iter().for_each(|it| codec.put(&mut bytes, it));
            let (mut codec, mut rest) = (Codec::default(), Bytes(&bytes));
            for expected in all {
                prop_assert_eq!(Has::of(&expected), has);
                prop_assert_eq!(codec.take(&mut rest, has, 3), Some(expected));
            }
        }

        #[test]
        fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            let mut rest = Bytes(&bytes);
            let mut codec = Codec::default();
            while codec.take(&mut rest, Has { elapsed: true, end: true }, 0).is_some() {}
            Bytes(&bytes).text();
        }
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        assert_eq!(Bytes(&[0xff; 9]).number(), None);
        assert_eq!(Bytes(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 2]).number(), None);
        assert_eq!(Bytes(&[0xff; 20]).number(), None);
        assert_eq!(
            Bytes(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1]).number(),
            Some(u64::MAX)
        );
    }
}
