//! Random components are executed by an interpreter that knows nothing of the analyser: every path through a period.
//! Conditions of literals have their values; any other condition is true or false. No period costs more than its edge of
//! the state machine, and some period costs as much: what programs cost is safe, and exact. A condition that joins a
//! constant and a call may make an edge cost more than any period, and never less.
//!
//! `MAUVE_LIBRARIES` is the number of libraries of [`COMPONENTS`] components, each with a seed of its own.

use std::collections::BTreeMap;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, core_of, names_of, product_of, projects};
use mauve_tests::machines::{Library, Times, edges};
use mauve_tests::{Options, random_model_of};

/// Components of a library.
const COMPONENTS: usize = 20;

/// The edges of the analyser as the interpreter names them. Of parallel edges, the greatest cost.
fn analysed(machine: &str) -> BTreeMap<String, u64> {
    let mut edges: BTreeMap<String, u64> = BTreeMap::new();
    for line in machine.lines() {
        let (edge, cost) = line.split_once(": ").unwrap();
        let cost = cost.strip_suffix(" ms").unwrap_or_else(|| panic!("{line}"));
        let greatest = edges.entry(edge.to_owned()).or_default();
        *greatest = cost.parse::<u64>().unwrap().max(*greatest);
    }
    edges
}

fn product_in(db: &Database, workspace: Workspace, component: &str) -> bool {
    let project = projects(db, workspace)[0];
    let of = names_of(db, project).anywhere(Kind::Component, component)[0];
    let core = core_of(db, project, of).unwrap();
    product_of(db, project, core).has_values()
}

/// Calls `check` with the costs of the edges of random components: those of the interpreter, those of the analyser, and a
/// name and text for a failure.
fn check_costs(
    constant_operands: bool,
    check: impl Fn(&BTreeMap<String, u64>, &BTreeMap<String, u64>, &dyn Fn() -> String),
) {
    let libraries = std::env::var("MAUVE_LIBRARIES").map_or(25, |count| count.parse().unwrap());
    let options = Options { statements: 4, constant_operands, ..Options::components(COMPONENTS) };
    let mut compared = 0;
    for seed in 0..libraries {
        let model = random_model_of(seed, options);
        let (library, times) = (Library::of(&model, seed), Times::of(&model));
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), model.texts());
        for component in &library.components {
            // Some components have too many paths.
            let Some(expected) = edges(&library, component, &times) else { continue };
            let one = Library { codels: library.codels.clone(), components: vec![component.clone()] };
            let text = || format!("seed {seed}, {times:?}\n{}", one.text());
            let machine = crate::common::machine_in(&db, workspace, &component.name);
            assert!(!machine.contains("refused: "), "{machine}{}", text());
            compared += 1;
            // The values of its variables exclude paths: `products.rs`.
            if product_in(&db, workspace, &component.name) {
                for (edge, cost) in analysed(&machine) {
                    assert!(expected.get(&edge).is_some_and(|free| *free >= cost), "{edge}: {}", text());
                }
                continue;
            }
            check(&expected, &analysed(&machine), &text);
        }
    }
    assert!(compared > libraries * COMPONENTS as u64 * 9 / 10, "{compared} compared");
}

#[test]
fn each_edge_costs_what_its_worst_period_does() {
    check_costs(false, |expected, found, text| assert_eq!(found, expected, "{}", text()));
}

#[test]
fn no_period_costs_more_than_its_edge() {
    check_costs(true, |expected, found, text| {
        for (edge, cost) in expected {
            assert!(found.get(edge).is_some_and(|bound| bound >= cost), "{edge}: {}", text());
        }
    });
}
