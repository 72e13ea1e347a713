//! How long estimates take: a fit, one codel, and a robot of 50 codels on all CPUs.

#![allow(clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use mauve_pwcet::{EstimateOptions, Gpd, estimate};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};
use rayon::prelude::*;

/// Exponential times with a mean of 1 ms.
fn exponential(count: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut unit = || ((random.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64;
    (0..count).map(|_| -1e6 * unit().ln()).collect()
}

fn executions(count: usize, seed: u64) -> Vec<u64> {
    exponential(count, seed).into_iter().map(|it| 5_000_000 + it as u64).collect()
}

fn options() -> EstimateOptions {
    EstimateOptions { levels: vec![1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9], seed: 1 }
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fit");
    for count in [200, 2_000, 20_000] {
        let excesses = exponential(count, 1);
        group.bench_with_input(BenchmarkId::from_parameter(count), &excesses, |bencher, excesses| {
            bencher.iter(|| Gpd::fit(black_box(excesses)).unwrap());
        });
    }
    group.finish();

    let codel = executions(5_000, 1);
    criterion.bench_function("estimate 5000 executions", |bencher| {
        bencher.iter(|| estimate(black_box(&codel), &options()).unwrap());
    });

    let robot: Vec<Vec<u64>> = (0..50).map(|seed| executions(5_000, seed)).collect();
    criterion.bench_function("estimate 50 codels", |bencher| {
        bencher.iter(|| -> Vec<_> {
            robot.par_iter().map(|codel| estimate(black_box(codel), &options()).unwrap()).collect()
        });
    });
}

criterion_group!(all, benches);
criterion_main!(all);
