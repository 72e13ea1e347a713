//! A misspelt key of a timing table never makes an activity look faster: each key of a valid table is changed by one or two
//! letters, and each response time that is still there is at least that of the table without the mistake.

use mauve_hir::{Database, Workspace};
use mauve_syntax::is_within;
use mauve_tests::Random;
use mauve_timing::Method;

use crate::common::{LEVEL, diagnostics_in, verdicts_in, workspace};

const MODEL: &str = r#"
library nav {
  codel astar(): int
  codel dist(): int
  codel step(): int
}
library drivers { use nav  codel poll(): int  codel dist(): int }
library drivers {
  shell S { }
  core PilotCore(S) {
    statemachine {
      initial state Planning {
        run = { astar(); }
        transition arrived if (dist() < 1) to Moving { step(); }
      }
      state Moving { run = { step(); }  transition done if (step() > 9) to Planning }
    }
  }
  core WheelCore(S) { update = { poll(); dist(); } }
  component Pilot(S, PilotCore)
  component Wheel(S, WheelCore)
  component Wheels(S, WheelCore)
}
shell T { }
core LogCore(T) { update = { step(); } }
component Log(T, LogCore)
component Lag(T, LogCore)
architecture Robot {
  instance pilot: drivers.Pilot
  instance wheel: drivers.Wheel
  instance wheels: drivers.Wheels
  instance log: Log
  instance lag: Lag
}
deployment Bench {
  architecture Robot
  activity pilot { affinity = 1  priority = 20  period = 1000 }
  activity wheel { affinity = 2  priority = 19  period = 1000 }
  activity wheels { affinity = 4  priority = 18  period = 1000 }
  activity log { affinity = 8  priority = 17  period = 1000 }
  activity lag { affinity = 16  priority = 16  period = 1000 }
}
//- /mauve.toml
[timing]
tables = ["times.toml"]
"#;

const ASSUMED: &str = "[assume]\ncodel = \"1 ms\"\n";

/// Each program and component time is longer than the codels of the program.
const ENTRIES: [(&str, &str, u32); 18] = [
    ("codel", "nav.astar", 40),
    ("codel", "nav.dist", 5),
    ("codel", "nav.step", 3),
    ("codel", "poll", 2),
    ("codel", "drivers.dist", 4),
    ("program", "drivers.Pilot/Planning.run", 50),
    ("program", "Pilot/Planning.arrived.guard", 9),
    ("program", "Pilot/Planning.arrived.effect", 8),
    ("program", "Pilot/Moving.run", 7),
    ("program", "Pilot/Moving.done.guard", 7),
    ("program", "Wheel/update", 30),
    ("program", "drivers.Wheels/update", 33),
    ("program", "Log/update", 20),
    ("component", "drivers.Pilot", 300),
    ("component", "Wheel", 200),
    ("component", "Wheels", 210),
    ("component", "Log", 100),
    ("component", "Lag", 110),
];

fn fixture(configuration: &str, entries: &[(&str, String, u32)]) -> String {
    format!("{MODEL}{configuration}//- /times.toml\n{}", table(entries))
}

fn table(entries: &[(&str, String, u32)]) -> String {
    let mut text = String::new();
    for section in ["codel", "program", "component"] {
        text += &format!("[{section}]\n");
        for (_, key, time) in entries.iter().filter(|it| it.0 == section) {
            text += &format!("\"{key}\" = {time}\n");
        }
    }
    text
}

/// The response times of the activities, by both methods; none where there is none.
fn responses(db: &Database, workspace: Workspace) -> Vec<Option<f64>> {
    let response = |line: &str| {
        let (_, rest) = line.split_once(" met ")?;
        rest.split_once(' ')?.0.parse().ok()
    };
    let methods = [Method::Psm, Method::Classic];
    let found = methods.map(|method| verdicts_in(db, workspace, method, LEVEL));
    found.iter().flat_map(|text| text.lines()).map(response).collect()
}

/// Changes one letter of a key, or two neighbours.
fn changed(key: &str, random: &mut Random) -> String {
    let mut letters: Vec<char> = key.chars().collect();
    let at = random.below(letters.len());
    let new = *random.of(&['a', 'e', 's', 'P', 'W', 'x', '.', '/', '_', '1']);
    match random.below(4) {
        0 => letters.insert(at, new),
        1 => letters[at] = new,
        2 if letters.len() > 1 => _ = letters.remove(at),
        _ if at > 0 => letters.swap(at, at - 1),
        _ => letters.push(new),
    }
    letters.into_iter().collect()
}

#[test]
fn a_misspelt_key_makes_nothing_faster() {
    let entries = ENTRIES.map(|(section, key, time)| (section, key.to_owned(), time));
    let mut random = Random::of_seed(17);
    let (mut unproved, mut kept) = (0, 0);
    for configuration in ["", ASSUMED] {
        let mut db = Database::default();
        let workspace = workspace(&db, &fixture(configuration, &entries));
        let file = workspace.file(&db, "/times.toml".as_ref()).unwrap();
        let right = responses(&db, workspace);
        assert!(right.iter().all(Option::is_some), "{right:?}");
        for index in 0..entries.len() {
            for round in 0..24 {
                let mut wrong = entries.clone();
                let once = changed(&wrong[index].1, &mut random);
                wrong[index].1 = if round % 2 == 0 { once } else { changed(&once, &mut random) };
                // A swap and a letter between the two are three changes.
                if !is_within(&wrong[index].1, &entries[index].1, 2) || wrong[index].1 == entries[index].1 {
                    continue;
                }
                let text = table(&wrong);
                file.set_text(&mut db, text.as_str().into());
                let found = diagnostics_in(&db, workspace);
                if !found.contains("unknown-timing-key") && !found.contains("invalid-table") {
                    // It is the key of something else.
                    continue;
                }
                let key = &wrong[index].1;
                for (activity, (new, old)) in responses(&db, workspace).iter().zip(&right).enumerate() {
                    let Some(new) = new else {
                        unproved += 1;
                        continue;
                    };
                    kept += 1;
                    assert!(
                        *new >= old.unwrap(),
                        "`{key}` makes activity {activity} faster: {new}\n{found}\n{text}"
                    );
                }
            }
        }
    }
    assert!(unproved > 500 && kept > 2 * unproved, "{unproved} {kept}");
}
