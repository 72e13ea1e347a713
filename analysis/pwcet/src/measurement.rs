//! All measured executions of one codel or program: those of each instance are a sample of their own, and the time of the codel
//! is the longest of their bounds.
//!
//! Instances are not mixed: they may execute a codel with other inputs, or on other CPUs, and a mixture of two distributions is
//! none of the distributions that an estimate assumes.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::estimate::{Estimate, EstimateOptions, estimate};
use crate::refusal::{EstimateRefusal, NoBound, NoEstimate};
use crate::samples::{Samples, SamplesError, SeriesId};

/// What was measured of one codel or program.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The key in a timing table: of a codel, or of a program, which has a `/`.
    pub key: String,
    /// The instances, in the order of their names.
    pub instances: Vec<InstanceMeasurement>,
}

/// What was measured in one instance.
#[derive(Debug, Clone, PartialEq)]
pub struct InstanceMeasurement {
    /// The instance; empty if it is unknown.
    pub instance: String,
    /// The execution times in nanoseconds, in the order of recording, run after run.
    pub executions: Vec<u64>,
    /// The index of the first execution of each run.
    pub runs: Vec<usize>,
    /// The estimate.
    pub result: Result<Estimate, NoEstimate>,
}

impl Measurement {
    /// Returns the number of executions.
    pub fn count(&self) -> usize {
        self.instances.iter().map(|it| it.executions.len()).sum()
    }

    /// Returns the greatest execution time in nanoseconds.
    pub fn greatest(&self) -> u64 {
        self.instances.iter().flat_map(|it| &it.executions).copied().max().unwrap_or_default()
    }

    /// Returns the time of each level of the options, in nanoseconds: the longest upper bound of an instance. `None` for a level at
    /// which no instance has a bound, or one is [`withheld_by`](Self::withheld_by) an instance without one.
    pub fn times(&self) -> Vec<Option<f64>> {
        let time = |level: usize| match self.withheld_by(level) {
            Some(_) => None,
            None => self.instances.iter().filter_map(|it| it.bound(level)?.ok()).reduce(f64::max),
        };
        (0..)
            .take_while(|&level| self.instances.iter().any(|it| it.bound(level).is_some()))
            .map(time)
            .collect()
    }

    /// Returns the instance that leaves the codel without a time at a level. It has no bound there, and an execution in it took
    /// longer than all those in instances with a bound, or its tail has no bound. An instance without a bound that was never slower
    /// than the others is taken to be like them.
    pub fn withheld_by(&self, level: usize) -> Option<&InstanceMeasurement> {
        let greatest = |it: &InstanceMeasurement| it.executions.iter().copied().max();
        let bounded = self.instances.iter().filter(|it| matches!(it.bound(level), Some(Ok(_))));
        let longest = bounded.filter_map(greatest).max()?;
        let is_slower = |it: &InstanceMeasurement| match it.refusal(level) {
            None => false,
            // What is wrong is that there are too few executions.
            Some(
                EstimateRefusal::TooFew { .. }
                | EstimateRefusal::Constant { .. }
                | EstimateRefusal::TooCoarse { .. },
            ) => greatest(it) > Some(longest),
            Some(_) => true,
        };
        self.instances.iter().find(|it| is_slower(it))
    }
}

impl InstanceMeasurement {
    /// Returns the 95 % upper bound of a level of the options, in nanoseconds, or why there is none.
    pub fn bound(&self, level: usize) -> Option<Result<f64, NoBound>> {
        match &self.result {
            Ok(estimate) => estimate.levels.get(level).map(|it| it.bound),
            Err(refused) => refused.bounds.get(level).copied(),
        }
    }

    fn refusal(&self, level: usize) -> Option<EstimateRefusal> {
        self.bound(level)?.err().map(|it| it.refusal)
    }
}

/// Estimates each codel and program of these sample files whose key is `wanted`; those of several files together, run after run.
///
/// All these executions are in memory: 8 bytes for each.
///
/// # Errors
///
/// A file cannot be read, or has a run of an earlier one; with its index.
pub fn measure(
    files: &mut [Samples],
    wanted: impl Fn(&str) -> bool,
    options: &EstimateOptions,
) -> Result<Vec<Measurement>, (usize, SamplesError)> {
    for (index, file) in files.iter().enumerate() {
        if let Some(run) = files[..index].iter().find_map(|earlier| earlier.common_run(file)) {
            return Err((index, SamplesError::Repeated { run }));
        }
    }
    // The series of each codel in each instance, by key and instance.
    let mut names: BTreeMap<(String, String), Vec<(usize, SeriesId)>> = BTreeMap::new();
    for (index, file) in files.iter().enumerate() {
        for it in file.series().iter().filter(|it| wanted(&it.key)) {
            names.entry((it.key.clone(), it.instance.clone())).or_default().push((index, it.id));
        }
    }
    let mut read = Vec::with_capacity(names.len());
    for ((key, instance), series) in names {
        let (mut executions, mut runs) = (Vec::new(), Vec::new());
        for (index, id) in series {
            let Some(file) = files.get_mut(index) else { continue };
            let mut run = None;
            for it in file.executions(id).map_err(|error| (index, error))? {
                if run != Some(it.run) {
                    run = Some(it.run);
                    runs.push(executions.len());
                }
                executions.push(it.execution);
            }
        }
        read.push((key, instance, executions, runs));
    }
    let estimated = read.into_par_iter().map(|(key, instance, executions, runs)| {
        let result = estimate(&executions, options);
        (key, InstanceMeasurement { instance, executions, runs, result })
    });
    let mut measurements: Vec<Measurement> = Vec::new();
    for (key, instance) in estimated.collect::<Vec<_>>() {
        match measurements.last_mut().filter(|it| it.key == key) {
            Some(it) => it.instances.push(instance),
            None => measurements.push(Measurement { key, instances: vec![instance] }),
        }
    }
    Ok(measurements)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};
    use crate::samples::{SampledExecution, SamplesWriter};
    use crate::trace::Totals;

    fn options() -> EstimateOptions {
        EstimateOptions { levels: vec![1e-3, 1e-6], seed: 1 }
    }

    /// Writes a file with one run, in which each instance executes `plan` so often, with exponential times of this mean.
    fn file(name: &str, seed: u64, instances: &[(&str, usize, f64)]) -> Samples {
        let path = std::env::temp_dir().join(format!("mauve-measurement-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let mut writer = SamplesWriter::open(&path).unwrap();
        writer.begin(name, 0).unwrap();
        for (instance, count, mean) in instances {
            let series = writer.series("nav.plan", instance).unwrap();
            let mut random = generator(seed, *count as u64);
            for _ in 0..*count {
                let execution = (1e6 - mean * uniform(&mut random).ln()) as u64;
                writer.add(series, SampledExecution { execution, elapsed: None, end: None, run: 0 }).unwrap();
            }
        }
        writer.commit(&Totals::default()).unwrap();
        let samples = Samples::open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        samples
    }

    /// With a search in all series for each of them, this takes minutes.
    #[test]
    fn each_series_is_found_at_once() {
        const INSTANCES: usize = 150_000;
        let names: Vec<String> = (0..INSTANCES).map(|it| format!("a{it:06}")).collect();
        let instances: Vec<(&str, usize, f64)> = names.iter().map(|it| (it.as_str(), 1, 1.0)).collect();
        let found = measure(&mut [file("many", 1, &instances)], |_| true, &options()).unwrap();
        let [plan] = &found[..] else { panic!("{} codels", found.len()) };
        assert_eq!((plan.instances.len(), plan.count()), (INSTANCES, INSTANCES));
        assert!(plan.instances.iter().zip(&names).all(|(it, name)| it.instance == *name));
    }

    #[test]
    fn the_slowest_instance_gives_the_times() {
        let mut files =
            [file("a", 1, &[("left", 900, 1e5), ("right", 901, 4e5)]), file("b", 2, &[("left", 600, 1e5)])];
        let found = measure(&mut files, |key| key == "nav.plan", &options()).unwrap();
        let [plan] = &found[..] else { panic!("{found:?}") };
        let [left, right] = &plan.instances[..] else { panic!("{plan:?}") };
        assert_eq!((left.executions.len(), &left.runs[..], &right.runs[..]), (1500, &[0, 900][..], &[0][..]));
        let of = |it: &InstanceMeasurement| {
            it.result.as_ref().unwrap().levels.iter().map(|it| it.bound.ok()).collect::<Vec<_>>()
        };
        assert!(of(left) < of(right));
        assert_eq!(plan.times(), of(right));
        assert!(measure(&mut files, |key| key.contains('/'), &options()).unwrap().is_empty());
    }

    /// Executions that are too few for an estimate are not forgotten: if they are slow, nobody knows how slow the codel may be.
    #[test]
    fn a_slow_instance_without_an_estimate_takes_the_time_away() {
        let mut files = [file("c", 3, &[("left", 900, 1e5), ("right", 3, 9e7)])];
        let plan = measure(&mut files, |_| true, &options()).unwrap().remove(0);
        assert_eq!(plan.instances[1].refusal(0), Some(EstimateRefusal::TooFew { count: 3 }));
        assert_eq!((plan.times(), plan.withheld_by(1)), (vec![None; 2], Some(&plan.instances[1])));

        let mut files = [file("d", 3, &[("left", 900, 1e5), ("right", 3, 1e4)])];
        let plan = measure(&mut files, |_| true, &options()).unwrap().remove(0);
        let left = plan.instances[0].result.as_ref().unwrap();
        assert_eq!(plan.times(), left.levels.iter().map(|it| it.bound.ok()).collect::<Vec<_>>());
    }

    #[test]
    fn a_run_counts_once() {
        let one = || file("e", 4, &[("left", 300, 1e5)]);
        let found = measure(&mut [one(), one()], |_| true, &options());
        assert!(matches!(found, Err((1, SamplesError::Repeated { run: 0 }))), "{found:?}");
    }

    /// 4000 executions in 4 steps of 1 µs: 1e-3 is counted (4 should exceed it), 1e-6 is not.
    #[test]
    fn a_coarse_clock_has_the_levels_that_it_supports() {
        let coarse = |name: &str, slowest: u64| {
            let path = std::env::temp_dir().join(format!("mauve-measurement-{}-{name}", std::process::id()));
            let _ = std::fs::remove_file(&path);
            let mut writer = SamplesWriter::open(&path).unwrap();
            writer.begin(name, 0).unwrap();
            let series = writer.series("nav.plan", "right").unwrap();
            for index in 0..4000 {
                let execution = if index == 3321 { slowest } else { 10_000 + index % 3 * 1000 };
                writer.add(series, SampledExecution { execution, elapsed: None, end: None, run: 0 }).unwrap();
            }
            writer.commit(&Totals::default()).unwrap();
            let samples = Samples::open(&path).unwrap();
            std::fs::remove_file(&path).unwrap();
            samples
        };
        let plan = measure(&mut [coarse("f", 13_000)], |_| true, &options()).unwrap().remove(0);
        // At least one exceeds the quantile with 98 %, two only with 91 %: the greatest time, and one step.
        assert_eq!(plan.times(), [Some(14_000.0), None]);

        // Another instance has an estimate: its bound counts at 1e-6, unless an execution of the coarse one was slower than all.
        let mut files = [coarse("g", 13_000), file("h", 5, &[("left", 900, 1e5)])];
        let plan = measure(&mut files, |_| true, &options()).unwrap().remove(0);
        let left = plan.instances[0].result.as_ref().unwrap();
        assert_eq!(plan.times(), left.levels.iter().map(|it| it.bound.ok()).collect::<Vec<_>>());
        let mut files = [coarse("i", 90_000_000), file("j", 5, &[("left", 900, 1e5)])];
        let plan = measure(&mut files, |_| true, &options()).unwrap().remove(0);
        assert_eq!((plan.times()[1], plan.withheld_by(1)), (None, Some(&plan.instances[1])));
        assert!(plan.times()[0] > Some(9e7), "{:?}", plan.times());
    }
}
