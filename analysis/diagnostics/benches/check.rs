//! A generated project of 200 files and about 10,000 lines: everything from nothing, and everything after an edit.

use std::hint::black_box;
use std::path::{Path, PathBuf};

use criterion::{Criterion, criterion_group, criterion_main};
use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, Workspace};

fn benches(c: &mut Criterion) {
    let project: Vec<(PathBuf, String)> = mauve_tests::generated_project(200, 10_000)
        .into_iter()
        .map(|(path, text)| (path.into(), text))
        .collect();
    let mut group = c.benchmark_group("200 files, 10,000 lines");
    group.sample_size(20);
    group.bench_function("cold", |b| {
        b.iter(|| {
            let db = Database::default();
            let workspace = Workspace::of_texts(&db, "/".into(), project.iter().cloned());
            workspace_diagnostics(&db, black_box(workspace)).len()
        });
    });
    for (name, path, from, to) in [
        ("a comment in a part", "/part7.mal", "library", "// a comment\nlibrary"),
        ("a program of a part", "/part7.mal", "next = 0;", "next = sense(1);"),
        ("a period of the deployment", "/root.mal", "period = 20", "period = 30"),
    ] {
        let mut db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), project.iter().cloned());
        assert!(
            workspace_diagnostics(&db, workspace)
                .iter()
                .all(|it| it.diagnostic.code.name == "deadline-missed")
        );
        let Some(file) = workspace.file(&db, Path::new(path)) else { continue };
        let old = file.text(&db).clone();
        let new = old.replacen(from, to, 1).into();
        let mut edited = false;
        group.bench_function(name, |b| {
            b.iter(|| {
                edited = !edited;
                file.set_text(&mut db, if edited { std::sync::Arc::clone(&new) } else { old.clone() });
                workspace_diagnostics(&db, workspace).len()
            });
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
