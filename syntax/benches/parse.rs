//! Lexing and parsing, in bytes a second: a generated project as one file, and the sample robot's longest model.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn benches(c: &mut Criterion) {
    let generated: String = mauve_tests::generated_project(200, 10_000)
        .into_iter()
        .filter(|(path, _)| path.ends_with(".mal"))
        .map(|(_, text)| text)
        .collect();
    let navigation = mauve_tests::models().join("p3dx/components/navigation.mal");
    let navigation = std::fs::read_to_string(navigation).unwrap_or_default();
    for (name, text) in [("generated", &generated), ("navigation", &navigation)] {
        let mut group = c.benchmark_group(name);
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function("lex", |b| b.iter(|| mauve_syntax::lex(black_box(text))));
        group.bench_function("parse", |b| b.iter(|| mauve_syntax::parse(black_box(text))));
        group.finish();
    }
}

criterion_group!(all, benches);
criterion_main!(all);
