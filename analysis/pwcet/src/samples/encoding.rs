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

/// Which of the optional times all executions of a block have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Has {
    pub(super) elapsed: bool,
    pub(super) end: bool,
}

impl Has {
    pub(super) fn bits(self) -> u64 {
        u64::from(self.elapsed) | u64::from(self.end) << 1
    }

    pub(super) fn of_bits(bits: u64) -> Option<Has> {
        (bits < 4).then_some(Has { elapsed: bits & 1 == 1, end: bits & 2 == 2 })
    }
}

/// The times of one execution, absent ones as 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Times {
    pub(super) execution: u64,
    pub(super) elapsed: u64,
    pub(super) end: u64,
}

/// Encodes or decodes the executions of a block one after the other.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Codec {
    last: Times,
    last_interval: u64,
}

impl Codec {
    pub(super) fn put(&mut self, bytes: &mut Vec<u8>, times: Times, has: Has) {
        put(bytes, zigzag(self.last.execution, times.execution));
        if has.elapsed {
            put(bytes, zigzag(times.execution, times.elapsed));
        }
        if has.end {
            put(bytes, zigzag(self.last_interval, times.end.wrapping_sub(self.last.end)));
        }
        self.next(times);
    }

    pub(super) fn take(&mut self, bytes: &mut Bytes<'_>, has: Has) -> Option<Times> {
        let execution = un_zigzag(self.last.execution, bytes.number()?);
        let elapsed = if has.elapsed { un_zigzag(execution, bytes.number()?) } else { 0 };
        let end = match has.end {
            true => self.last.end.wrapping_add(un_zigzag(self.last_interval, bytes.number()?)),
            false => 0,
        };
        let times = Times { execution, elapsed, end };
        self.next(times);
        Some(times)
    }

    fn next(&mut self, times: Times) {
        // The first end is not an interval.
        self.last_interval = if self.last.end == 0 { 0 } else { times.end.wrapping_sub(self.last.end) };
        self.last = times;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn times() -> impl Strategy<Value = Times> {
        let time = prop_oneof![0_u64..1000, any::<u64>()];
        (time.clone(), time.clone(), time).prop_map(|(execution, elapsed, end)| Times {
            execution,
            elapsed,
            end,
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
            all in proptest::collection::vec(times(), 0..20), bits in 0_u64..4,
        ) {
            let has = Has::of_bits(bits).unwrap();
            let mut bytes = Vec::new();
            let mut codec = Codec::default();
            all.iter().for_each(|times| codec.put(&mut bytes, *times, has));
            let (mut codec, mut rest) = (Codec::default(), Bytes(&bytes));
            for times in all {
                let expected = Times {
                    elapsed: if has.elapsed { times.elapsed } else { 0 },
                    end: if has.end { times.end } else { 0 },
                    ..times
                };
                prop_assert_eq!(codec.take(&mut rest, has), Some(expected));
            }
        }

        #[test]
        fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            let mut rest = Bytes(&bytes);
            let mut codec = Codec::default();
            while codec.take(&mut rest, Has { elapsed: true, end: true }).is_some() {}
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
