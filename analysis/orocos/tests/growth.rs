//! The size of generated files grows linearly with the model.

use std::fmt::Write as _;

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::packages;

/// The sizes of all files and of the exported state machine of the packages of a model.
fn sizes(model: &str) -> [usize; 2] {
    let db = Database::default();
    let texts = [("/robot.mal", model), ("/mauve.toml", "assume.codel = \"1 us\"\n")];
    let texts = texts.map(|(path, text)| (path.into(), text.to_owned()));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let packages = packages(&db, projects(&db, workspace)[0], None).unwrap();
    let files = packages.iter().flat_map(|package| &package.files);
    let machines = files.clone().filter(|file| file.path.ends_with(".psm.json"));
    let exported = machines.map(|file| file.text.len()).sum();
    [files.map(|file| file.text.len()).sum(), exported]
}

/// A model with `core` in its only component, and `more` in its architecture and its deployment.
fn model(core: &str, [instances, activities]: [&str; 2]) -> String {
    format!(
        "codel look(in value: int): int
shell S {{ input port goal: int  output port next: int }}
core K(S) {{ {core} }}
component C(S, K)
architecture A {{ instance pilot: C {instances} }}
deployment D {{ architecture A activity pilot {{ priority = 1 period = 100 affinity = 1 }} {activities} }}
"
    )
}

fn each(count: usize, write: impl Fn(usize) -> String) -> String {
    (0..count).fold(String::new(), |mut out, number| {
        let _ = writeln!(out, "{}", write(number));
        out
    })
}

#[test]
fn files_grow_linearly() {
    let states = |count: usize| {
        let state = |number: usize| {
            let (initial, next) = (if number == 0 { "initial " } else { "" }, (number + 1) % count);
            format!(
                "{initial}state s{number} {{ run = {{ v = look(v); }} transition t if v > {number} to s{next} }}"
            )
        };
        model(&format!("statemachine {{ var v: int = 0 {} }}", each(count, state)), ["", ""])
    };
    let transitions = |count: usize| {
        let transition =
            |number| format!("transition t{number} if look(v) > {number} to b {{ v = {number}; }}");
        let core = format!(
            "statemachine {{ var v: int = 0 initial state a {{ run = {{ v = look(v); }} {} }} state b {{ transition back to a }} }}",
            each(count, transition)
        );
        model(&core, ["", ""])
    };
    let instances = |count: usize| {
        let instances = each(count, |number| format!("instance i{number}: C"));
        let connections = each(count, |number| format!("connection pilot.next -> i{number}.goal"));
        let activities = each(count, |number| format!("activity i{number} {{ priority = background }}"));
        let update = "var v: int = 0 update = { v = look(v); }";
        model(update, [&format!("{instances}{connections}"), &activities])
    };
    let axes: [(&str, &dyn Fn(usize) -> String); 3] =
        [("states", &states), ("transitions", &transitions), ("instances", &instances)];
    for (axis, model) in axes {
        let (once, twice) = (sizes(&model(100)), sizes(&model(200)));
        for (once, twice) in once.into_iter().zip(twice) {
            assert!(twice * 10 <= once * 22, "{axis}: {once} and {twice} bytes");
        }
    }
}
