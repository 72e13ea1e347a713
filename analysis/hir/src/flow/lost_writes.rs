//! The writes to ports that a later write of the same period overwrites.

use crate::body::{BodyId, ProgramIn};
use crate::item_tree::{HookKind, MethodKind, Name};
use crate::structure::{StateStructure, Structure};

use super::program::{ProgramFlow, Write};
use super::programs::CoreFlow;

/// Returns the writes of a core that every path overwrites in the same period.
pub(super) fn lost_writes<'a, 'db>(core: &'db Structure, programs: &CoreFlow<'a, 'db>) -> Vec<&'a Write> {
    let operations = (0..core.operations.len()).map(|index| BodyId::Operation(index as u32));
    let bodies = operations.chain(core.hook(HookKind::Update));
    let mut lost: Vec<&Write> =
        bodies.flat_map(|body| lost_in(programs.get(body, ProgramIn::Whole))).collect();
    for (index, state) in programs.states().iter().enumerate() {
        lost_in_state(index, state, programs, &mut lost);
    }
    lost.sort();
    lost.dedup();
    lost
}

fn lost_in(program: Option<&ProgramFlow>) -> impl Iterator<Item = &Write> {
    program.into_iter().flat_map(|program| &program.writes.lost)
}

/// Returns the last writes of a program to the ports for which `is_written` holds: those that are written after it.
fn lost_after(
    program: Option<&ProgramFlow>,
    is_written: impl Fn(&Name) -> bool,
) -> impl Iterator<Item = &Write> {
    let last = program.into_iter().flat_map(|program| &program.writes.last);
    last.filter(move |(_, port)| is_written(port))
}

/// Adds the writes in a state that the programs after them overwrite. The programs of a period are `run`, then `exit`, an effect
/// and `entry`, or `handle`.
fn lost_in_state<'a, 'db>(
    index: usize,
    state: &StateStructure,
    programs: &CoreFlow<'a, 'db>,
    lost: &mut Vec<&'a Write>,
) {
    let method = |kind| programs.method(index, kind);
    let [entry, run, handle, exit] =
        [MethodKind::Entry, MethodKind::Run, MethodKind::Handle, MethodKind::Exit].map(method);
    let effect = |number| programs.of_state(index, ProgramIn::Effect(number as u32));
    let next_entry = |number: usize| -> Option<&'a ProgramFlow> {
        programs.method(programs.target(state.transitions.get(number)?)?, MethodKind::Entry)
    };
    // The transitions that may fire.
    let always = state.transitions.iter().position(|transition| !transition.has_guard);
    let fire = 0..always.map_or(state.transitions.len(), |always| always + 1);
    let writes = |program: Option<&ProgramFlow>, port: &Name| {
        program.is_some_and(|program| program.writes.include(port))
    };
    let after_exit = |port: &Name| {
        let fires = |number| writes(effect(number), port) || writes(next_entry(number), port);
        !fire.is_empty() && fire.clone().all(fires)
    };
    let after_run = |port: &Name| {
        let leaves = fire.is_empty() || writes(exit, port) || after_exit(port);
        leaves && (always.is_some() || writes(handle, port))
    };
    [entry, run, handle, exit].into_iter().for_each(|program| lost.extend(lost_in(program)));
    lost.extend(lost_after(run, after_run));
    lost.extend(lost_after(exit, after_exit));
    for number in fire.clone() {
        let effect = effect(number);
        lost.extend(lost_in(effect));
        lost.extend(lost_after(effect, |port| writes(next_entry(number), port)));
    }
}
