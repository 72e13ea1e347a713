//! Lexing and parsing, in bytes a second: a generated project as one file, and the sample robot's longest model. And what
//! an edit of a long file costs, by what it touches. The time of a full parse excludes that of freeing the tree.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mauve_syntax::Tier;

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
        group.bench_function("parse", |b| {
            b.iter_with_large_drop(|| mauve_syntax::parse(black_box(text)));
        });
        group.finish();
    }
}

/// One library with one state machine, and as many small ones: long lists of children at the bottom and at the top.
fn edits(c: &mut Criterion) {
    for lines in [3_300, 10_000] {
        for files in [2, lines / 50] {
            let text: String = mauve_tests::generated_project(files, lines)
                .into_iter()
                .filter(|(path, _)| path.starts_with("/part"))
                .map(|(_, text)| text)
                .collect();
            let name = format!("{} KB in {} libraries", text.len() / 1000, files - 1);
            let mut group = c.benchmark_group(name);
            let parse = mauve_syntax::parse(&text);
            let middle = text.len() / 2;
            for (what, from, to, tier) in [
                ("name", "value = sense", "valuex = sense", Tier::Token),
                ("comment at the top", "// Part", "// The part", Tier::Token),
                ("statement", "value = sense", "x = 1; value = sense", Tier::Items),
                ("open statement", "write(command, value);", "write(command, value;", Tier::Items),
                ("open block", "write(command, value); }", "write(command, value); ", Tier::Items),
            ] {
                let from_middle = if tier == Tier::Token && what.starts_with("comment") { 0 } else { middle };
                let Some(at) = text.get(from_middle..).and_then(|text| text.find(from)) else { continue };
                let mut edited = text.clone();
                edited.replace_range(from_middle + at..from_middle + at + from.len(), to);
                assert_eq!(parse.reparse_by(&text, &edited).1, tier, "{what}");
                group
                    .bench_function(what, |b| b.iter(|| parse.reparse(black_box(&text), black_box(&edited))));
            }
            group.bench_function("whole", |b| {
                b.iter_with_large_drop(|| mauve_syntax::parse(black_box(&text)));
            });
            group.finish();
        }
    }
}

criterion_group!(all, benches, edits);
criterion_main!(all);
