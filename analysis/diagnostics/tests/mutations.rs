//! Random texts near to models: whatever comes of it, nothing panics, the tree has the file's text, and every diagnostic
//! lies between two characters of its file.
//!
//! `MAUVE_MUTANTS=100000 cargo test --release -p mauve-diagnostics --test main mutations::` tries more, `MAUVE_SEED=7`
//! others.

use mauve_tests::search;

use crate::damaged::{Project, near};

/// The cases of a random model.
const OF_MODEL: u64 = 25;

fn mutants() -> u64 {
    search::cases("MAUVE_MUTANTS", 1500)
}

fn mutate(project: &Project, cases: (u64, u64)) {
    project.damage(
        cases,
        true,
        |texts, random| (0..=random.below(4)).map(|_| near(texts, random)).collect(),
        |damaged| drop(damaged.findings()),
    );
}

#[test]
fn mutants_of_the_samples_neither_panic_nor_lose_a_byte() {
    for name in ["p3dx", "p3dx_entry"] {
        mutate(&Project::sample(name), ((mutants() / 4).div_ceil(2), 0));
    }
}

#[test]
fn mutants_of_random_models_neither_panic_nor_lose_a_byte() {
    for model in 0..(mutants() * 3).div_ceil(OF_MODEL * 4) {
        mutate(&Project::random(model), (OF_MODEL, model));
    }
}
