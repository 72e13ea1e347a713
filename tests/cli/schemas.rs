//! `mauve schema`: the files that the commands write are valid, as an independent validator says.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use mauve_tests::{copy, files_in, mauve, models, own_scratch, write};
use serde_json::Value;

use crate::MAUVE;

/// Says why the schema that is printed for this kind of file does not accept a document.
fn refusal(of: &str, document: &Value) -> Option<String> {
    let schema = serde_json::from_str(&mauve(MAUVE, Path::new("/"), &["schema", of]).out).unwrap();
    let mut compiler = boon::Compiler::new();
    compiler.add_resource("schema.json", schema).unwrap();
    let mut schemas = boon::Schemas::new();
    let schema = compiler.compile("schema.json", &mut schemas).unwrap();
    schemas.validate(document, schema).err().map(|why| why.to_string())
}

/// As editors show TOML to a schema: a date is a text.
fn as_json(value: toml::Value) -> Value {
    match value {
        toml::Value::Datetime(date) => date.to_string().into(),
        toml::Value::Array(values) => values.into_iter().map(as_json).collect(),
        toml::Value::Table(values) => values.into_iter().map(|(key, value)| (key, as_json(value))).collect(),
        other => serde_json::to_value(other).unwrap(),
    }
}

/// Locks, waits, background: what the sample robot does not have.
const BUS: &str = "codel exchange(): int
codel log(): int
shell S { }
core BusCore(S) { update = { exchange(); } }
core LogCore(S) { update = { log(); } }
component Bus(S, BusCore)
component Log(S, LogCore)
architecture A { instance bus: Bus  instance log: Log  instance rest: Log }
deployment D {
  architecture A
  activity bus { priority = 9  period = 10  affinity = 1 }
  activity log { priority = 5  period = 100  affinity = 1 }
  activity rest { priority = background  affinity = 1 }
}
";

#[test]
fn every_written_file_is_valid() {
    let folder = own_scratch("schemas");
    let run = |arguments: &[&str]| {
        let run = mauve(MAUVE, &folder, arguments);
        assert!(run.code < 2, "{arguments:?}: {}", run.err);
    };
    run(&["new", "fresh"]);
    copy(&models().join("p3dx"), &folder.join("p3dx"));
    let mut executions = "codel,execution_ns,instance\n".to_owned();
    for index in 0..3000_u32 {
        let share = f64::from(index * 1213 % 3000) / 3000.0 + 0.000_1;
        let _ = writeln!(executions, "exchange,{:.0},bus", 1e6 - 1e5 * share.ln());
    }
    write(
        &folder.join("bus"),
        &[
            ("bus.mal", BUS),
            (
                "mauve.toml",
                "timing.tables = ['times.toml', 'measured.toml']\n[locks.bus]\ncodels = ['exchange', 'log']\nprotocol = 'inheritance'\n\
                 held = '1 ms'\n[[platform.other]]\nname = 'lan'\npriority = 50\nperiod = '1 ms'\nburst = 3\ntime = '10 us'\n",
            ),
            (
                "times.toml",
                "levels = [1e-3, 1e-6]\n[codel]\nlog = [2, 3]\n[wait]\nlog = { time = [1, 2], waits = 2 }\n",
            ),
            ("run.csv", &executions),
        ],
    );
    run(&["trace", "import", "bus/run.csv", "-o", "bus/run.samples"]);
    run(&["pwcet", "bus/run.samples", "-o", "bus/measured.toml", "--levels", "1e-3,1e-4"]);
    for robot in ["p3dx", "bus", "fresh"] {
        run(&["generate", robot, "--out", &format!("out/{robot}")]);
    }
    let text = |path: &Path| std::fs::read_to_string(path).unwrap();
    let mut checked: BTreeMap<&str, usize> = BTreeMap::new();
    for path in files_in(&folder) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let (of, document) = match name {
            _ if path.parent().unwrap().ends_with("models") => {
                ("task-set", serde_json::from_str(&text(&path)).unwrap())
            }
            "mauve.toml" => ("mauve.toml", as_json(toml::from_str(&text(&path)).unwrap())),
            "timing.toml" | "measured.toml" => ("table", as_json(toml::from_str(&text(&path)).unwrap())),
            _ => continue,
        };
        assert_eq!(refusal(of, &document), None, "{}", path.display());
        *checked.entry(of).or_default() += 1;
    }
    assert!(checked["task-set"] > 10 && checked["mauve.toml"] == 3 && checked["table"] == 2, "{checked:?}");
}
