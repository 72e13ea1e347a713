//! Random components that count and switch modes are walked by an interpreter that knows nothing of the analyser, from each
//! reachable value of their variables: each step is an edge of the state machine with values, which costs no less; and no edge
//! costs more than without values.
//!
//! `MAUVE_PRODUCTS` is the number of components.

use std::collections::BTreeSet;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_tests::machines::{Library, Times, Walk, WalkStep, counting, edges, walk};
use mauve_timing::{StateMachine, Time};
use mauve_wcrt::{Psm, first_tables, psm_of};

use crate::common::LEVEL;

/// Whether a state of the machine stands for a place.
fn is_at(psm: &Psm<'_>, number: usize, (state, values): &(String, Vec<(String, String)>)) -> bool {
    let (own, known) = psm.text_state(number);
    let mut known = known.split(", ").filter(|it| !it.is_empty());
    psm.state(own) == state
        && known.all(|it| {
            let (name, value) = it.split_once(" = ").unwrap();
            values.iter().any(|(other, it)| other == name && it == value)
        })
}

/// Returns the first step that no edge covers, with the states that the machine may be in before.
fn uncovered<'a>(psm: &Psm<'_>, walk: &'a Walk) -> Option<(&'a WalkStep, String)> {
    let at = |place: usize| {
        let all = 0..psm.machine.states() as usize;
        all.filter(move |number| is_at(psm, *number, &walk.places[place])).map(move |it| (place, it))
    };
    let mut open: Vec<(usize, usize)> = walk.starts.iter().flat_map(|place| at(*place)).collect();
    let mut seen: BTreeSet<(usize, usize)> = open.iter().copied().collect();
    while let Some((place, number)) = open.pop() {
        for step in walk.steps.iter().filter(|step| step.source == place) {
            let covers = |index: usize, edge: &mauve_timing::Edge| {
                let of_text = &psm.edges.all[psm.text_edge(index).unwrap()];
                let name = of_text.transition.as_ref().map_or("stay", |name| name.as_str());
                edge.source as usize == number
                    && step.transition.as_deref() == Some(name)
                    && edge.cost >= Time::from_nanos(step.cost * 1_000_000)
                    && is_at(psm, edge.target as usize, &walk.places[step.target])
            };
            let edges = psm.machine.edges().iter().enumerate().filter(|(index, edge)| covers(*index, edge));
            let mut after: Vec<usize> = edges.map(|(_, edge)| edge.target as usize).collect();
            // A call between two periods changes nothing that is known.
            if step.transition.is_none() && is_at(psm, number, &walk.places[step.target]) {
                after.push(number);
            }
            if after.is_empty() {
                return Some((step, psm.state_with_values(number)));
            }
            for next in after.into_iter().map(|number| (step.target, number)) {
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
    }
    None
}

/// Returns the machine where each condition on a variable may hold or not; none where there are too many paths.
fn free(psm: &Psm<'_>, library: &Library, times: &Times) -> Option<StateMachine> {
    let costs = edges(library, &library.components[0], times)?;
    let edge = |edge: &mauve_hir::Edge| {
        let name = edge.transition.as_ref().map_or("stay", |name| name.as_str());
        let key = format!("{} {name} {}", psm.state(edge.source), psm.state(edge.target));
        let cost = Time::from_nanos(costs[&key] * 1_000_000);
        mauve_timing::Edge { source: edge.source as u32, target: edge.target as u32, cost }
    };
    StateMachine::new(psm.states.len() as u32, psm.edges.all.iter().map(edge).collect()).ok()
}

fn mean(machine: &StateMachine) -> f64 {
    let mean = machine.greatest_cycle_mean();
    mean.cost.as_nanos() as f64 / mean.length as f64
}

#[test]
fn each_step_of_a_random_component_is_an_edge_that_costs_no_less() {
    let count = std::env::var("MAUVE_PRODUCTS").map_or(200, |count| count.parse().unwrap());
    let (mut followed, mut steps, mut refused, mut ratios) = (0, 0, 0, Vec::new());
    for seed in 0..count {
        let (library, times, model) = counting(seed);
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), model.texts());
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Component, "K")[0];
        let tables = first_tables(&db, project, of);
        let text = || model.texts().into_iter().map(|(_, text)| text).collect::<String>();
        let psm = match psm_of(&db, tables, of, LEVEL) {
            Ok(psm) => psm,
            Err(_) => {
                refused += 1;
                continue;
            }
        };
        let free = free(psm, &library, &times);
        for (time, free) in psm.longest_times().zip(free.iter().flat_map(StateMachine::edges)) {
            assert!(time.is_none_or(|time| time <= free.cost), "seed {seed}\n{}", text());
        }
        let found = walk(&library, &library.components[0], &times, (seed % 3) as i64);
        steps += found.steps.len();
        if let Some((step, state)) = uncovered(psm, &found) {
            let (before, after) = (&found.places[step.source], &found.places[step.target]);
            panic!("seed {seed}, {state}: {step:?} from {before:?} to {after:?}\n{}", text());
        }
        followed += usize::from(psm.product.is_some());
        if let Some(free) = free.filter(|it| psm.product.is_some() && mean(it) > 0.0) {
            ratios.push(mean(&psm.machine) / mean(&free));
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (sum, middle) = (ratios.iter().sum::<f64>(), ratios[ratios.len() / 2]);
    let tighter = ratios.iter().filter(|it| **it < 0.999).count();
    println!(
        "{count} components, {refused} refused, {followed} with values, {tighter} of them with a lower utilisation; \
         mean ratio {:.3}, median {middle:.3}, least {:.3}; {steps} steps",
        sum / ratios.len() as f64,
        ratios[0]
    );
    assert!(
        followed as u64 * 2 > count && refused as u64 * 20 <= count && tighter * 5 > followed,
        "{followed} {refused} {tighter}"
    );
    assert!(ratios.iter().all(|it| *it <= 1.000_001));
}
