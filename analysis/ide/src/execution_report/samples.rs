//! Few points that show many executions: parts of a recording, ranks and histograms. Their number does not grow with the sample.

use mauve_timing::greatest_common_divisor;

/// Consecutive executions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecordedPart {
    /// The index of the first one.
    pub(super) first: usize,
    /// How many there are.
    pub(super) count: usize,
    /// The least time.
    pub(super) least: u64,
    /// The greatest time.
    pub(super) greatest: u64,
    /// The mean time.
    pub(super) mean: f64,
    /// The index of the greatest time, if all earlier executions are shorter: a high-water mark at that point of the recording.
    pub(super) record: Option<usize>,
}

/// Returns the executions in at most `most` parts of about the same size.
///
/// Each part has its greatest time, so no high-water mark is higher than the parts show.
pub(super) fn parts(executions: &[u64], most: usize) -> Vec<RecordedPart> {
    let count = executions.len();
    let number = most.min(count);
    let mut seen = None;
    let part = |index: usize| {
        let (first, end) = (bound(count, number, index), bound(count, number, index + 1));
        let times = executions.get(first..end).unwrap_or_default();
        let (least, greatest) = (times.iter().min().copied()?, times.iter().max().copied()?);
        let position = times.iter().position(|&time| time == greatest)?;
        let record = (seen < Some(greatest)).then_some(first + position);
        seen = seen.max(Some(greatest));
        let mean = times.iter().map(|&time| time as f64).sum::<f64>() / times.len() as f64;
        Some(RecordedPart { first, count: times.len(), least, greatest, mean, record })
    };
    (0..number).filter_map(part).collect()
}

/// Returns where a part begins.
fn bound(count: usize, parts: usize, index: usize) -> usize {
    (count as u128 * index as u128 / parts.max(1) as u128) as usize
}

/// Returns about `most` ranks from 1 to `count`: the first ones all, then with equal distances on a logarithmic axis.
pub(super) fn ranks(count: usize, most: usize) -> Vec<usize> {
    let all = (most / 3).min(count);
    let mut ranks: Vec<usize> = (1..=all).collect();
    let rest = most - most / 3;
    if count > all {
        let factor = count as f64 / all.max(1) as f64;
        let rank =
            |step: usize| (all.max(1) as f64 * factor.powf(step as f64 / rest as f64)).round() as usize;
        ranks.extend((1..rest).map(rank).chain([count]));
    }
    ranks.dedup();
    ranks
}

/// How many executions have times in bins of one width.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Histogram {
    /// Where the first bin begins, in nanoseconds.
    pub(super) start: f64,
    /// The width of a bin.
    pub(super) width: f64,
    /// The number of executions in each bin.
    pub(super) counts: Vec<usize>,
    /// The number of executions above all bins: a long tail would leave no room for the others.
    pub(super) above: usize,
}

/// The most bins of a histogram.
const MOST_BINS: usize = 80;

/// Returns the histogram of ascending times with bins of the width of Freedman and Diaconis: 2 IQR / ∛n, a multiple of the clock's
/// resolution. `None` for no executions.
pub(super) fn histogram(ascending: &[u64]) -> Option<Histogram> {
    let count = ascending.len();
    let (&least, &greatest) = (ascending.first()?, ascending.last()?);
    let quantile =
        |part: f64| ascending.get(((count - 1) as f64 * part) as usize).copied().unwrap_or(greatest);
    let spread = (quantile(0.75) - quantile(0.25)) as f64;
    let resolution = resolution(ascending).max(1) as f64;
    let last = if spread > 0.0 && count >= 200 {
        (quantile(0.995) as f64).max(quantile(0.5) as f64 + 8.0 * spread).min(greatest as f64)
    } else {
        greatest as f64
    };
    // Times are in the middle of their steps.
    let start = least as f64 - resolution / 2.0;
    let length = last + resolution / 2.0 - start;
    let wanted = (2.0 * spread / (count as f64).cbrt()).max(length / MOST_BINS as f64);
    let width = (wanted / resolution).ceil().max(1.0) * resolution;
    let bins = ((length / width).ceil() as usize).clamp(1, MOST_BINS + 1);
    let mut counts = vec![0; bins];
    let mut above = 0;
    for &time in ascending {
        match counts.get_mut(((time as f64 - start) / width) as usize) {
            Some(count) => *count += 1,
            None => above += 1,
        }
    }
    Some(Histogram { start, width, counts, above })
}

/// Returns the greatest number that all differences of ascending times are multiples of; 0 if all are equal.
fn resolution(ascending: &[u64]) -> u64 {
    let differences = ascending.iter().zip(ascending.iter().skip(1)).map(|(before, time)| time - before);
    differences.fold(0, greatest_common_divisor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_all_executions_and_the_greatest_time() {
        let executions: Vec<u64> = (0..10_007).map(|index: u64| index * 7919 % 10_007).collect();
        let found = parts(&executions, 300);
        assert_eq!(found.len(), 300);
        assert_eq!(found.iter().map(|part| part.count).sum::<usize>(), executions.len());
        let records: Vec<usize> = found.iter().filter_map(|part| part.record).collect();
        let last = records.last().and_then(|&index| executions.get(index));
        assert_eq!(last, executions.iter().max());
        assert_eq!(
            parts(&[5, 5, 4], 10).iter().map(|part| part.record).collect::<Vec<_>>(),
            [Some(0), None, None]
        );
        assert!(parts(&[], 10).is_empty());
    }

    #[test]
    fn ranks_are_few_and_reach_both_ends() {
        for count in [1, 2, 49, 50, 51, 1000, 10_000_000] {
            let ranks = ranks(count, 150);
            assert!(
                ranks.len() <= 150 && ranks.first() == Some(&1) && ranks.last() == Some(&count),
                "{count}"
            );
            assert!(ranks.windows(2).all(|pair| pair[0] < pair[1]), "{count}: {ranks:?}");
        }
        assert!(ranks(0, 150).is_empty());
    }

    #[test]
    fn histograms_count_all_executions() {
        let mut coarse: Vec<u64> = (0..5000).map(|index| 1000 + 50 * (index * index % 17)).collect();
        coarse.sort_unstable();
        let mut heavy: Vec<u64> = (1..5000).map(|index| 1_000_000 / index).collect();
        heavy.sort_unstable();
        for times in [coarse, heavy, vec![7; 300], vec![1, 2, 1_000_000], vec![3], vec![0, u64::MAX]] {
            let found = histogram(&times).expect("times");
            assert!(found.counts.len() <= MOST_BINS + 1);
            assert_eq!(found.counts.iter().sum::<usize>() + found.above, times.len());
            assert!(found.above * 50 <= times.len(), "{found:?}");
        }
        assert_eq!(histogram(&[]), None);
    }
}
