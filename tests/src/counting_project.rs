//! Projects whose programs count, compare and have modes: what state machines of robots do, and what a product of states and values
//! costs.

use std::fmt::Write as _;

/// What the states of a core do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counting {
    /// They count, and their guards compare.
    Counters,
    /// A mode of seven values, a flag and a counter of tries, with guards on them. Every tenth activity is triggered, and there are a
    /// lock and a declared chain.
    Modes,
}

/// Returns a project of so many files, each with a core of so many states, whose instances are connected one after the other: the root,
/// `/root.mal`, then `/part0.mal` and so on, and `/mauve.toml`.
pub fn counting_project(counting: Counting, files: usize, states: usize) -> Vec<(String, String)> {
    let is_modes = counting == Counting::Modes;
    let (mut includes, mut instances, mut activities) = (String::new(), String::new(), String::new());
    let mut texts = Vec::new();
    for part in 0..files {
        let _ = writeln!(includes, "include \"part{part}.mal\"");
        let _ = writeln!(instances, "  instance i{part}: Component{part}");
        if part > 0 {
            let _ = writeln!(instances, "  connection i{}.result -> i{part}.data", part - 1);
        }
        let trigger = if is_modes && part % 10 == 9 { "trigger = data  least" } else { "period" };
        let (priority, affinity) = (1 + part % 99, 1 << (part % 8));
        let _ = writeln!(
            activities,
            "  activity i{part} {{ priority = {priority}  {trigger} = 100  affinity = {affinity} }}"
        );
        texts.push((format!("/part{part}.mal"), part_text(counting, part, states)));
    }
    let root = format!(
        "{includes}architecture A {{\n{instances}}}\ndeployment D {{\n  architecture A\n{activities}}}\n"
    );
    let mut config = "[project]\nroot = \"root.mal\"\n[assume]\ncodel = \"1 us\"\n".to_owned();
    if is_modes {
        let _ = write!(config, "[locks.bus]\ncodels = [\"work0\", \"work{}\"]\n", files / 2);
        let last = files.saturating_sub(1).min(3);
        let _ = write!(config, "[chains.first]\nfrom = \"i0\"\nto = \"i{last}\"\n");
    }
    texts.insert(0, ("/root.mal".to_owned(), root));
    texts.push(("/mauve.toml".to_owned(), config));
    texts
}

fn part_text(counting: Counting, part: usize, states: usize) -> String {
    let mut text = format!(
        "codel work{part}(in value: double): double\nshell Shell{part} {{\n  input port data: double\n  \
         output port result: double\n}}\ncore Core{part}(Shell{part}) {{\n  var value: double = 0.0\n  \
         var count: int = 0\n"
    );
    if counting == Counting::Modes {
        text += "  var mode: int = 0\n  var held: bool = false\n";
    }
    text += "  statemachine {\n";
    for state in 0..states {
        let initial = if state == 0 { "initial " } else { "" };
        let (next, after) = ((state + 1) % states, (state + 2) % states);
        let _ = match counting {
            Counting::Counters => write!(
                text,
                "    {initial}state S{state} {{\n      entry = {{ count = count + 1; }}\n      run = {{\n        \
                 if read(data, value) == new_data then {{ write(result, work{part}(value)); }}\n      }}\n      \
                 transition go if count > {state} to S{next}\n    }}\n"
            ),
            Counting::Modes => write!(
                text,
                "    {initial}state S{state} {{\n      entry = {{ count = 0; mode = {}; }}\n      run = {{\n        \
                 if read(data, value) == new_data && !held then {{\n          write(result, work{part}(value)); count = 0;\n        \
                 }} else {{\n          count = count + 1; if count >= 3 then {{ held = true; }}\n        }}\n      }}\n      \
                 transition release if held && count >= 5 to S{next} {{ held = false; }}\n      \
                 transition go if mode == {} && !held to S{after}\n    }}\n",
                state % 7,
                (state + 3) % 7,
            ),
        };
    }
    let _ = write!(text, "  }}\n}}\ncomponent Component{part}(Shell{part}, Core{part})\n");
    text
}
