//! The schemas that editors check `mauve.toml`, timing tables and task sets with say what the readers say.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::LazyLock;

use mauve_diagnostics::{Code, codes, page};
use mauve_hir::config_keys::{Key, KeyKind, KeyTable, SECTIONS, SEVERITIES};
use mauve_hir::{Database, Workspace, config_of};
use mauve_timing::task_set::{Notation, TaskSet};
use mauve_timing::toml_key::{ANY_NAME, TomlKey};
use mauve_timing::{Protocol, Table, Unit, table_keys};
use serde_json::{Value, json};
use toml::de::{DeTable, DeValue};

const CONFIGURATION: &str = include_str!("../../../editors/schemas/mauve.schema.json");
const TABLE: &str = include_str!("../../../editors/schemas/timing-table.schema.json");

const TASK_SET: &str = include_str!("../../../editors/schemas/task-set.schema.json");

/// `UPDATE_EXPECT=1 cargo test -p mauve-diagnostics --test main schemas::` writes it.
#[test]
fn the_schema_of_configurations_has_every_key() {
    let mut sections: Vec<&Key> = SECTIONS.iter().collect();
    sections.sort_by_key(|it| place(CONFIGURATION, &format!("\n    \"{}\": {{", it.name)));
    let expected = document(
        "mauve.toml",
        "What a folder of MAUVE models is: its roots, its timing tables, its platform.",
        sections.into_iter().map(|it| configuration_key(2, it)).collect(),
        r#"
    "paths": {
      "type": ["string", "array"],
      "items": { "type": "string" }
    }"#,
    );
    expect_test::expect_file!["../../../editors/schemas/mauve.schema.json"].assert_eq(&expected);
}

/// `UPDATE_EXPECT=1 cargo test -p mauve-diagnostics --test main schemas::` writes it.
#[test]
fn the_schema_of_tables_has_every_key() {
    let expected = document(
        "A timing table",
        "Execution times by codel, program or component, one for each significance level. mauve.toml names the tables \
         under [timing].",
        table_keys::KEYS.iter().map(|it| table_key(2, it)).collect(),
        r##"
    "time": {
      "description": "An execution time in `unit`.",
      "type": "number",
      "minimum": 0
    },
    "times": {
      "description": "One bound for every level, or one for each of `levels`.",
      "type": ["number", "array"],
      "minimum": 0,
      "items": { "$ref": "#/definitions/time" },
      "minItems": 1
    },
    "entry": {
      "description": "One bound for every level, or one for each of `levels`; or more entries, whose keys are joined by points.",
      "type": ["number", "array", "object"],
      "minimum": 0,
      "items": { "$ref": "#/definitions/time" },
      "minItems": 1,
      "additionalProperties": { "$ref": "#/definitions/entry" },
      "minProperties": 1
    }"##,
    );
    expect_test::expect_file!["../../../editors/schemas/timing-table.schema.json"].assert_eq(&expected);
}

fn table_key(depth: usize, key: &table_keys::TableKey) -> String {
    let mut members: Vec<String> = match key.kind {
        table_keys::TableKeyKind::Unit => {
            let units = Unit::ALL.map(|unit| format!("\"{unit}\"")).join(", ");
            vec![format!("\"enum\": [{units}]")]
        }
        table_keys::TableKeyKind::Levels => vec![
            r#""type": "array""#.to_owned(),
            r#""items": { "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1 }"#.to_owned(),
            r#""uniqueItems": true"#.to_owned(),
        ],
        table_keys::TableKeyKind::Entries(..) => vec![
            r#""type": "object""#.to_owned(),
            r##""additionalProperties": { "$ref": "#/definitions/entry" }"##.to_owned(),
        ],
        table_keys::TableKeyKind::Keys(_, [TomlKey { name: ANY_NAME, kind, .. }]) => {
            let table_keys::TableKeyKind::Keys(_, keys) = kind else { panic!("a record has keys") };
            let properties = keys.iter().map(|it| table_key(depth + 3, it)).collect();
            let record = closed(depth + 2, properties);
            vec![r#""type": "object""#.to_owned(), object(depth + 1, "additionalProperties", &record)]
        }
        table_keys::TableKeyKind::Keys(_, keys) => {
            closed(depth + 1, keys.iter().map(|it| table_key(depth + 2, it)).collect())
        }
        table_keys::TableKeyKind::Value(kind) => vec![format!("\"type\": {kind}")],
        table_keys::TableKeyKind::Times(_) => {
            vec![r##""allOf": [{ "$ref": "#/definitions/times" }]"##.to_owned()]
        }
    };
    described(depth, key, &mut members)
}

/// A property with its default value and its examples.
fn described<K>(depth: usize, key: &TomlKey<K>, members: &mut Vec<String>) -> String {
    members.extend(key.default.map(|value| format!("\"default\": {value}")));
    members.extend(Some(key.examples).filter(|it| !it.is_empty()).map(|it| format!("\"examples\": {it}")));
    property(depth, key.name, key.documentation, members)
}

/// The members of a table at this depth.
fn members_of(depth: usize, table: &KeyTable) -> Vec<String> {
    let any = table.keys.iter().find(|it| it.name == ANY_NAME);
    let others = match any.map(|it| &it.kind) {
        None => "\"additionalProperties\": false".to_owned(),
        Some(KeyKind::Severity) => return closed(depth, codes().map(lint).collect()),
        Some(KeyKind::Table(topic)) if table.header.is_some_and(|(label, _)| label == "[ros2.topics]") => {
            let topic = members_of(depth + 1, topic).join(",\n");
            format!("\"additionalProperties\": {{ \"anyOf\": [{{ \"type\": \"string\" }}, {{\n{topic}\n}}] }}")
        }
        Some(KeyKind::Table(table)) => object(depth, "additionalProperties", &members_of(depth + 1, table)),
        Some(_) => r#""additionalProperties": { "type": "array", "minItems": 1, "items": { "type": "integer", "minimum": 1, "maximum": 128 } }"#.to_owned(),
    };
    let has_rate = table.keys.iter().any(|it| it.name == "rate");
    let required = table.required.iter().filter(|it| !has_rate || **it != "period");
    let required: Vec<String> = required.map(|name| format!("\"{name}\"")).collect();
    let properties = table.keys.iter().filter(|it| it.name != ANY_NAME);
    let properties: Vec<String> = properties.map(|key| configuration_key(depth + 1, key)).collect();
    let mut members = vec!["\"type\": \"object\"".to_owned(), others];
    members.extend(
        Some(required).filter(|it| !it.is_empty()).map(|it| format!("\"required\": [{}]", it.join(", "))),
    );
    if has_rate {
        members.push("\"oneOf\": [{ \"required\": [\"period\"] }, { \"required\": [\"rate\"] }]".to_owned());
    }
    members.extend(Some(properties).filter(|it| !it.is_empty()).map(|it| object(depth, "properties", &it)));
    members
}

fn lint(code: &Code) -> String {
    let (default, _) = SEVERITIES.iter().find(|(_, severity)| *severity == Some(code.severity)).unwrap();
    let page = page(code.name).unwrap();
    let first: Vec<&str> = page.lines().skip(2).take_while(|line| !line.is_empty()).collect();
    let severities = SEVERITIES.map(|(name, _)| format!("\"{name}\"")).join(", ");
    let members = [format!("\"enum\": [{severities}]"), format!("\"default\": \"{default}\"")];
    property(4, code.name, &first.join(" "), &members)
}

fn configuration_key(depth: usize, key: &Key) -> String {
    const TIME: &str =
        r"^\s*[+]?[0-9]+(_[0-9]+)*([.][0-9]+(_[0-9]+)*)?([eE][-+]?[0-9]+(_[0-9]+)*)?\s*(ns|us|ms|s)\s*$";
    let pattern = |pattern: &str| format!("\"type\": \"string\"\n\"pattern\": {}", Value::from(pattern));
    let kind = match &key.kind {
        KeyKind::Models(_) | KeyKind::Tables(_) => {
            r##""allOf": [{ "$ref": "#/definitions/paths" }]"##.to_owned()
        }
        KeyKind::Protocol(_) => {
            let names = Protocol::ALL.map(|it| format!("\"{}\"", it.name())).join(", ");
            format!("\"enum\": [{names}]")
        }
        KeyKind::Instances(_) | KeyKind::Codels(_) => {
            "\"type\": [\"string\", \"array\"]\n\"items\": { \"type\": \"string\" }".to_owned()
        }
        KeyKind::Reasons(_) => {
            let reason = r#""type": "string", "pattern": "\\S""#;
            let until = Value::from(TIME);
            format!(
                "\"type\": \"object\"\n\"additionalProperties\": {{ \"oneOf\": [{{ {reason} }}, {{ \"type\": \"object\", \
                 \"additionalProperties\": false, \"required\": [\"until\", \"reason\"], \"properties\": {{ \"until\": {{ \
                 \"type\": \"string\", \"pattern\": {until} }}, \"reason\": {{ {reason} }} }} }}] }}"
            )
        }
        KeyKind::Names { parts, is_list, .. } => {
            let name = match parts {
                (2, _) => r#""type": "string", "pattern": "^[^.]+[.][^.]+$""#,
                _ => r#""type": "string", "pattern": "^[^.]+([.][^.]+)?$""#,
            };
            match is_list {
                true => {
                    format!("\"oneOf\": [{{ {name} }}, {{ \"type\": \"array\", \"items\": {{ {name} }} }}]")
                }
                false => name.replace(", ", "\n"),
            }
        }
        KeyKind::Level => "\"type\": \"number\"\n\"exclusiveMinimum\": 0\n\"exclusiveMaximum\": 1".to_owned(),
        KeyKind::Required(_) => pattern(r"^\s*[0-9.eE+-]+\s+per\s+([0-9.eE+-]+\s*)?(h|hour|hours|min|s)\s*$"),
        KeyKind::Time(_) => pattern(TIME),
        KeyKind::Period(_) => {
            let number = TIME.split_once(r"\s*(ns").map_or("", |(number, _)| number.trim_start_matches('^'));
            pattern(&TIME.replacen('^', &format!("^({number}\\s*/)?"), 1))
        }
        KeyKind::Rate(_) => pattern(r"^\s*[0-9.]+\s*(/\s*[0-9.]+\s*)?Hz$"),
        KeyKind::Cpus(_) => "\"type\": \"array\"\n\"minItems\": 1\n\
                          \"items\": { \"type\": \"integer\", \"minimum\": 1, \"maximum\": 128 }"
            .to_owned(),
        KeyKind::Table(table) if table.is_list => {
            let items = object(depth + 1, "items", &members_of(depth + 2, table));
            return described(depth, key, &mut vec!["\"type\": \"array\"".to_owned(), items]);
        }
        KeyKind::Table(table) => return described(depth, key, &mut members_of(depth + 1, table)),
        KeyKind::Severity => panic!("codes are listed"),
        KeyKind::Either([one, other], _) => pattern(&format!("^({one}|{other})$")),
        KeyKind::Integer(from, to, _) => {
            format!("\"type\": \"integer\"\n\"minimum\": {from}\n\"maximum\": {to}")
        }
        KeyKind::Boolean(_) => "\"type\": \"boolean\"".to_owned(),
        KeyKind::Folder(_) => "\"type\": \"string\"".to_owned(),
        KeyKind::Text { pattern: of_text, .. } => pattern(of_text),
    };
    let mut members: Vec<String> = kind.lines().map(str::to_owned).collect();
    described(depth, key, &mut members)
}

/// A schema: the names that may stand in a document, and raw definitions that they refer to.
fn document(title: &str, description: &str, properties: Vec<String>, definitions: &str) -> String {
    let mut members = vec![
        "\"$schema\": \"http://json-schema.org/draft-07/schema#\"".to_owned(),
        format!("\"title\": \"{title}\""),
        format!("\"description\": \"{description}\""),
    ];
    members.extend(closed(1, properties));
    members.push(format!("\"definitions\": {{{definitions}\n  }}"));
    format!("{{\n  {}\n}}\n", members.join(",\n  "))
}

/// The members of a schema of objects that have these properties and no others.
fn closed(depth: usize, properties: Vec<String>) -> Vec<String> {
    let no_others = "\"additionalProperties\": false".to_owned();
    vec!["\"type\": \"object\"".to_owned(), no_others, object(depth, "properties", &properties)]
}

fn property(depth: usize, name: &str, documentation: &str, members: &[String]) -> String {
    let documentation = format!("\"description\": {}", Value::from(documentation));
    object(depth, name, &[&[documentation], members].concat())
}

/// A named object, in one line where it fits.
fn object(depth: usize, name: &str, members: &[String]) -> String {
    let line = format!("\"{name}\": {{ {} }}", members.join(", "));
    let indentation = "  ".repeat(depth);
    match line.contains('\n') || indentation.len() + line.chars().count() > 110 {
        true => {
            let inner = format!("\n{indentation}  ");
            format!("\"{name}\": {{{inner}{}\n{indentation}}}", members.join(&format!(",{inner}")))
        }
        false => line,
    }
}

/// Where something stands now, so that it stays there; what is new comes behind.
fn place(text: &str, what: &str) -> usize {
    text.find(what).unwrap_or(usize::MAX)
}

/// Which of the schema and the reader find nothing wrong.
fn configuration(text: &str) -> (bool, bool) {
    let db = Database::default();
    let file = (PathBuf::from("/mauve.toml"), text.to_owned());
    let workspace = Workspace::of_texts(&db, "/".into(), [file]);
    let config = config_of(&db, workspace);
    // The reader knows no codes.
    let is_code = |name: &String| codes().any(|code| code.name == name);
    (is_valid(CONFIGURATION, text), config.errors.is_empty() && config.lints.keys().all(is_code))
}

fn table(text: &str) -> (bool, bool) {
    (is_valid(TABLE, text), Table::parse(text).errors.is_empty())
}

fn is_valid(schema: &str, text: &str) -> bool {
    let document = DeTable::parse(text).expect("the documents of this test are TOML");
    is_valid_json(schema, &as_json(document.get_ref()))
}

fn is_valid_json(schema: &str, document: &Value) -> bool {
    let (schemas, schema) = compiled(schema);
    schemas.validate(document, schema).is_ok()
}

fn compiled(schema: &str) -> (boon::Schemas, boon::SchemaIndex) {
    let mut compiler = boon::Compiler::new();
    compiler.add_resource("schema.json", serde_json::from_str(schema).unwrap()).unwrap();
    let mut schemas = boon::Schemas::new();
    let schema = compiler.compile("schema.json", &mut schemas).unwrap();
    (schemas, schema)
}

/// Panics unless the schema accepts a task set, in JSON.
pub(crate) fn assert_is_task_set(text: &str) {
    static SCHEMA: LazyLock<(boon::Schemas, boon::SchemaIndex)> = LazyLock::new(|| compiled(TASK_SET));
    let (schemas, schema) = &*SCHEMA;
    let document = serde_json::from_str(text).unwrap();
    schemas.validate(&document, *schema).unwrap_or_else(|why| panic!("{why}\n{text}"));
}

/// As editors show TOML to a schema: what JSON does not have is null, and a date is a text.
fn as_json(table: &DeTable<'_>) -> Value {
    let of = |value: &DeValue<'_>| value_as_json(value);
    table.iter().map(|(key, value)| (key.get_ref().to_string(), of(value.get_ref()))).collect()
}

fn value_as_json(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => json!(text),
        DeValue::Integer(number) => {
            json!(i64::from_str_radix(number.as_str(), number.radix()).expect("fits"))
        }
        DeValue::Float(number) => json!(number.as_str().parse::<f64>().expect("is a number")),
        DeValue::Boolean(value) => json!(value),
        DeValue::Datetime(date) => json!(date.to_string()),
        DeValue::Array(values) => values.iter().map(|value| value_as_json(value.get_ref())).collect(),
        DeValue::Table(table) => as_json(table),
    }
}

#[test]
fn the_schemas_are_draft_7() {
    for schema in [CONFIGURATION, TABLE, TASK_SET] {
        let mut compiler = boon::Compiler::new();
        compiler.add_resource("schema.json", serde_json::from_str(schema).unwrap()).unwrap();
        // Checked against the schema of schemas, which `$schema` names.
        compiler.compile("schema.json", &mut boon::Schemas::new()).unwrap();
        assert!(schema.contains("\"$schema\": \"http://json-schema.org/draft-07/schema#\""));
    }
}

#[test]
fn schema_and_reader_agree_on_configurations() {
    for good in [
        "",
        "[project]\nroot = \"a.mal\"\n",
        "[project]\nroot = [\"a.mal\", \"b.mal\"]\n",
        "project.roots = [\"a.mal\", \"b.mal\"]\n",
        "project.roots = \"a.mal\"\n",
        "[timing]\ntables = [\"timing/*.toml\"]\nsignificance = 1e-4\n",
        "timing.tables = \"t.toml\"\n",
        "timing.tables = []\n",
        "timing.deployment.Sea.tables = \"sea.toml\"\n",
        "[timing.deployment.\"marine.Sea\"]\ntables = [\"sea/*.toml\"]\n",
        "timing.deployment = {}\n",
        "assume.codel = \"5 ms\"\n",
        "assume.codel = \" +1_000.25e-1us \"\n",
        "assume.codel = \"0s\"\n",
        "platform = { cpus = 1, rt_throttling = true }\n",
        "platform.cpus = 0x40\n",
        "[platform]\n",
        "[[platform.other]]\nname = \"lan\"\npriority = 50\nperiod = \"1 ms\"\ntime = \"50 us\"\n",
        "platform.other = [{ name = \"a b\", priority = 1, period = \"1 s\", time = \"0 s\", cpus = [1, 128], jitter = \"2 s\" }]\n",
        "platform.other = []\n",
        "clocks.synchronised = [\"a\", \"b\"]\n",
        "clocks.synchronised = \"a\"\n",
        "[chains.avoid]\nfrom = \"l.sweep\"\nto = \"base\"\nthrough = \"mux\"\nwhile = [\"mux.Auto\"]\nanswers = [\"a.x\"]\nlatency = \"3 ms\"\n",
        "chains.tables = {}\n",
        "[types.ArRobotPtr]\ncpp = \"ArRobot*\"\nheader = \"Aria.h\"\n[types.Empty]\n",
        "generate.out = \"generated\"\n",
        "[generate]\nros_streams = false\nintrospection = false\nmaintainer = \"A B <a@b.org>\"\nlicense = \"BSD\"\n",
        "[deployment.Sea]\naccept = { planner = \"measured by hand\" }\n[deployment.\"lib.Land\".accept]\n\"a.b\" = \"x\"\n",
        "[lints]\nlost-write = \"error\"\nmissing-else = \"allow\"\nunused-codel = \"warn\"\nno-effect = \"hint\"\n",
    ] {
        assert_eq!(configuration(good), (true, true), "{good}");
    }
    for bad in [
        "root = \"a.mal\"\n",
        "[platfrm]\ncpus = 1\n",
        "[[project]]\nroot = \"a.mal\"\n",
        "project = \"a.mal\"\n",
        "project.files = \"a.mal\"\n",
        "project.root = 1\n",
        "project.roots = [1]\n",
        "project.roots = [[\"a.mal\"]]\n",
        "timing.table = []\n",
        "timing.tables = {}\n",
        "timing.tables = [true]\n",
        "timing.deployment = 1\n",
        "timing.deployment.Sea = \"sea.toml\"\n",
        "timing.deployment.Sea = {}\n",
        "timing.deployment.Sea.tables = 1\n",
        "timing.deployment.Sea.table = []\n",
        "timing.deployment.marine.Sea.tables = []\n",
        "timing.significance = \"1e-4\"\n",
        "timing.significance = 0\n",
        "timing.significance = 1.0\n",
        "timing.significance = -1e-4\n",
        "timing.significance = nan\n",
        "timing.significance = inf\n",
        "assume.codels = \"5 ms\"\n",
        "assume.codel = 5\n",
        "assume.codel = \"5\"\n",
        "assume.codel = \"5 min\"\n",
        "assume.codel = \"-5 ms\"\n",
        "assume.codel = \".5 ms\"\n",
        "assume.codel = \"5. ms\"\n",
        "assume.codel = \"1__0 ms\"\n",
        "assume.codel = \"inf ms\"\n",
        "assume.codel = \"5 ms or more\"\n",
        "platform.cpu = 1\n",
        "platform.cpus = 0\n",
        "platform.cpus = 129\n",
        "platform.cpus = 1.5\n",
        "platform.cpus = \"2\"\n",
        "platform.rt_throttling = 1\n",
        "platform.rt_throttling = \"true\"\n",
        "[platform.other]\nname = \"lan\"\npriority = 50\nperiod = \"1 ms\"\ntime = \"50 us\"\n",
        "platform.other = [1]\n",
        "platform.other = [{ priority = 1, period = \"1 s\", time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", period = \"1 s\", time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", priority = 1, time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = \"1 s\" }]\n",
        "platform.other = [{ name = \" \", priority = 1, period = \"1 s\", time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", priority = 0, period = \"1 s\", time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = 1, time = \"0 s\" }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = \"1 s\", time = \"0 s\", cpus = [] }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = \"1 s\", time = \"0 s\", cpus = [129] }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = \"1 s\", time = \"0 s\", cpus = 1 }]\n",
        "platform.other = [{ name = \"a\", priority = 1, period = \"1 s\", time = \"0 s\", cpu = [1] }]\n",
        "clocks.synchronized = [\"a\"]\n",
        "clocks.synchronised = [1]\n",
        "clocks.synchronised = true\n",
        "deployment.Sea = 1\n",
        "deployment.Sea.accepted = { planner = \"x\" }\n",
        "deployment.Sea.accept = [\"planner\"]\n",
        "deployment.Sea.accept = { planner = \" \" }\n",
        "deployment.Sea.accept = { planner = true }\n",
        "chains.a = \"hokuyo.scan\"\n",
        "chains.a = [\"hokuyo.scan\", \"base.command\"]\n",
        "chains.a.form = \"a\"\n",
        "chains.a.from = [\"a\"]\n",
        "chains.a.to = \"a.b.c\"\n",
        "chains.a.while = [\"mux\"]\n",
        "chains.a.through = [1]\n",
        "chains.a.answers = \".\"\n",
        "chains.a.latency = 3\n",
        "types.X = \"X*\"\n",
        "types.X.cpp = 1\n",
        "types.X.include = \"X.h\"\n",
        "types.X.header = [\"X.h\"]\n",
        "generate.out = 1\n",
        "generate.ros_streams = 1\n",
        "generate.introspection = \"yes\"\n",
        "generate.maintainer = \"A B\"\n",
        "generate.license = \" \"\n",
        "types.X.cpp = \"int; }\"\n",
        "types.X.header = \"a b.h\"\n",
        "types.X.header = \"/usr/include/a.h\"\n",
        "types.X.header = \"a/../b.h\"\n",
        "types.X.header = \"-a.h\"\n",
        "generate.output = \"generated\"\n",
        "lints.lost-write = \"warning\"\n",
        "lints.lost-write = true\n",
        "lints.lost-writes = \"warn\"\n",
        "lints.all = \"warn\"\n",
        "lints.lost-write = 1979-05-27\n",
    ] {
        assert_eq!(configuration(bad), (false, false), "{bad}");
    }
    // To a schema 2.0 is a whole number, and it knows neither the longest time, nor the sign of zero, nor what a type is.
    for (text, both) in [
        ("platform.cpus = 2.0\n", (true, false)),
        ("assume.codel = \"1e99 s\"\n", (true, false)),
        (
            "platform.other = [{ name = \"a\", priority = 1, period = \"0 s\", time = \"0 s\" }]\n",
            (true, false),
        ),
        ("types.X.cpp = \"int x, y\"\n", (true, false)),
        ("assume.codel = \"-0 ms\"\n", (false, true)),
    ] {
        assert_eq!(configuration(text), both, "{text}");
    }
}

#[test]
fn schema_and_reader_agree_on_tables() {
    for good in [
        "",
        "unit = \"ns\"\n",
        "unit = \"us\"\n",
        "unit = \"ms\"\n",
        "unit = \"s\"\n",
        "levels = []\n",
        "levels = [1e-3, 1e-4]\n[codel]\n\"navigation.astar\" = [290, 297.5]\nnavigation.dist = 1\nnothing = 0\n",
        "[codel.pose.filter]\nupdate = 0x10\n[codel]\n",
        "levels = [1e-3]\n[program]\n\"Hokuyo/update\" = [40]\n[component]\nNavigation = 2.5e2\n",
        "levels = [1e-3, 1e-4]\n[overhead]\ndispatch = 0.01\ncontext_switch = [0.005, 0.006]\n",
        "levels = [1e-3]\n[codel]\nunit = 1\nlevels = [1]\n",
        "[wait]\na = { time = 1, waits = 2 }\nb = { time = 1, times = 2 }\n",
        "[codel]\na = -0.0\n",
    ] {
        assert_eq!(table(good), (true, true), "{good}");
    }
    for bad in [
        "unit = \"min\"\n",
        "unit = 1\n",
        "levels = 1e-3\n",
        "levels = [0]\n",
        "levels = [1]\n",
        "levels = [1e-3, 1e-3]\n",
        "levels = [\"1e-3\"]\n",
        "levels = [nan]\n",
        "astar = 1\n",
        "[codels]\nastar = 1\n",
        "codel = 1\n",
        "[[codel]]\nastar = 1\n",
        "program = []\n",
        "component = \"Navigation\"\n",
        "overhead = 7\n",
        "[codel]\na = \"5 ms\"\n",
        "[codel]\na = true\n",
        "[codel]\na = -1\n",
        "[codel]\na = inf\n",
        "[codel]\na = nan\n",
        "[codel]\na = 1979-05-27\n",
        "[codel]\na = {}\n",
        "[codel.a.b]\n",
        "[codel]\nunit = \"ms\"\n",
        "levels = [1e-3]\n[codel]\na = []\n",
        "levels = [1e-3]\n[codel]\na = [[1]]\n",
        "levels = [1e-3]\n[codel]\na = [-1]\n",
        "levels = [1e-3]\n[codel]\na = [\"1\"]\n",
        "levels = [1e-3]\n[codel]\na = [{ b = 1 }]\n",
        "[program]\n\"C/update\" = \"50\"\n",
        "[component.C]\nx = true\n",
        "[overhead]\nswitch = 1\n",
        "[overhead]\ndispatch = -1\n",
        "[overhead]\ndispatch = { a = 1 }\n",
        "levels = [1e-3]\n[overhead]\ndispatch = [true]\n",
    ] {
        assert_eq!(table(bad), (false, false), "{bad}");
    }
    // A schema does not count one array by another, compare numbers, join keys, or know the longest time in each unit.
    for text in [
        "[codel]\na = [1]\n",
        "levels = [1e-3, 1e-4]\n[codel]\na = [1]\n",
        "levels = [1e-3, 1e-4]\n[codel]\na = [2, 1]\n",
        "[codel]\n\"a.b\" = 1\na.b = 2\n",
        "[codel]\na = 1e40\n",
    ] {
        assert_eq!(table(text), (true, false), "{text}");
    }
}

/// A task set with a task that is analysed, one that is not, and one in the background.
fn example() -> Value {
    json!({
        "generated": "by hand", "name": "D", "unit": "us", "levels": [1e-3, 1e-6], "significance": 1e-6, "cpus": 2,
        "rt_throttling": true, "not_analysed": [],
        "task": [
            {
                "name": "a", "component": "C", "cpus": [1, 2], "priority": 99, "period": 100, "deadline": 50, "jitter": 5.5,
                "offset": 99, "machine": [
                    { "from": "Idle", "to": "Idle", "time": [8, 10], "wait": [1, 2], "name": "stay" },
                ],
                "waits": 2,
                "initial": "Idle", "classic_time": 99, "assumed": { "a.b": 5 }, "not_analysed": [],
            },
            { "name": "b", "not_analysed": [{ "reason": "no time", "levels": [1e-3, 1e-6], "classic_only": false }] },
            { "name": "c", "priority": "background", "time": 5, "wait": 3, "waits": 1 },
        ],
        "other": [{ "name": "lan", "cpus": 2, "priority": 50, "period": 100, "jitter": 0, "time": 5 }],
        "operation": [{ "name": "plan", "provider": "a", "client": "b", "sends": 2, "every": 3, "starting": 2, "pending": 1, "time": [3, 4], "waits": false }],
        "lock": [{ "name": "bus", "protocol": "ceiling", "user": [{ "task": "a", "held": [1, 2] }, { "task": "c" }] }],
    })
}

#[test]
fn schema_and_reader_agree_on_task_sets() {
    let agree = |document: &Value| {
        let by_schema = is_valid_json(TASK_SET, document);
        (by_schema, TaskSet::parse(&document.to_string(), Notation::Json).is_ok())
    };
    let with = |path: &str, value: Value| {
        let mut document = example();
        let (parent, key) = path.rsplit_once('/').unwrap();
        let parent = document.pointer_mut(&parent.replace("front", "/task/0")).unwrap();
        match key.parse::<usize>() {
            Ok(index) => parent[index] = value,
            Err(_) => parent[key] = value,
        }
        document
    };
    let whole = example();
    assert_eq!(agree(&whole), (true, true));
    for (path, value) in [
        ("/task", json!([])),
        (
            "/task",
            json!([{ "name": "a", "period": 1, "time": 1, "priority": 1 }, { "name": "b", "priority": "background" }]),
        ),
        ("/not_analysed", json!(["a task is lost"])),
        ("front/cpus", json!(2)),
        ("front/deadline", json!(101)),
        ("front/thread", json!("drivers")),
        ("front/order", json!("fifo")),
        ("front/preemptive", json!(false)),
        ("/other/0/burst", json!(3)),
        ("/other/0/sporadic", json!(true)),
        ("/other/0/time", json!("0.123456789012345678901")),
    ] {
        let agreed = agree(&with(path, value.clone()));
        // Operations name tasks.
        assert!(agreed.0 && (agreed.1 || path == "/task"), "{path}: {value}");
    }
    for (path, value) in [
        ("/format", json!("mauve-3")),
        ("/unit", json!("min")),
        ("/generated", json!(5)),
        ("/name", json!("a\u{1b}b")),
        ("/levels", json!([1e-3])),
        ("/levels/0", json!(1)),
        ("/levels/0", json!(1e-6)),
        ("/significance", json!(0)),
        ("/cpus", json!(0)),
        ("/cpus", json!(1.5)),
        ("/rt_throttling", json!("on")),
        ("/not_analysed", json!([1])),
        ("/task", json!({})),
        ("/task", json!(null)),
        ("/other", json!(null)),
        ("/other/0/name", json!("a\u{1b}b")),
        ("/other/0/cpus", json!(0)),
        ("/other/0/priority", json!(0)),
        ("/other/0/priority", json!(100)),
        ("/other/0/priority", json!("background")),
        ("/other/0/period", json!(0)),
        ("/other/0/time", json!(-5)),
        ("/operation/0/sends", json!(-5)),
        ("/operation/0/sends", json!(1.5)),
        ("front/name", json!("")),
        ("front/cpus", json!(-1)),
        ("front/cpus", json!(129)),
        ("front/cpus", json!([])),
        ("front/priority", json!(0)),
        ("front/priority", json!(100)),
        ("front/priority", json!("Background")),
        ("front/period", json!(0)),
        ("front/deadline", json!(0)),
        ("front/jitter", json!(-1)),
        ("front/offset", json!(-1)),
        ("front/burst", json!(0)),
        ("front/sporadic", json!("yes")),
        ("front/thread", json!(1)),
        ("front/clock", json!(-1)),
        ("front/period", json!("long")),
        ("front/time", json!(5)),
        ("front/wait", json!(5)),
        ("front/waits", json!(-1)),
        ("front/machine/0/wait", json!(-1)),
        ("/operation/0/waits", json!(1)),
        ("/lock/0/protocol", json!("mutex")),
        ("/lock/0/user", json!("a")),
        ("/lock/0/user/0/held", json!(-1)),
        ("/lock/0/user/1/task", json!("a\u{1b}b")),
        ("front/machine", json!([])),
        ("front/machine/0/from", json!(5)),
        ("front/machine/0/time/0", json!(-8)),
        ("front/assumed", json!({ "a.b": "long" })),
        ("front/classic_time", json!(true)),
        ("/task/1/not_analysed/0", json!("no time")),
        ("/task/1/not_analysed/0/classic_only", json!(null)),
        ("/task/1/not_analysed", json!([])),
    ] {
        let document = with(path, value);
        let expected = if path == "/levels" { (true, false) } else { (false, false) };
        assert_eq!(agree(&document), expected, "{path}: {document}");
    }
    // The same keys are needed, and no other is known.
    for (path, keys) in objects(&whole) {
        if path.ends_with("assumed") {
            continue;
        }
        for key in keys {
            let mut document = whole.clone();
            document.pointer_mut(&path).unwrap().as_object_mut().unwrap().remove(&key);
            let (by_schema, by_reader) = agree(&document);
            // Lists have as many times as there are levels.
            assert!(by_schema == by_reader || key == "levels", "no {key} in {path}: {by_schema} {by_reader}");
        }
        let mut document = whole.clone();
        document.pointer_mut(&path).unwrap()["more"] = json!(null);
        assert_eq!(agree(&document), (false, false), "more in {path}");
        // The reader says which keys it knows: "unknown field `more`, expected one of `name`, `component`, …".
        let refusal = TaskSet::parse(&document.to_string(), Notation::Json).unwrap_err();
        let refusal = format!("{refusal:?}");
        let known: BTreeSet<&str> = refusal.split('`').skip(3).step_by(2).collect();
        assert_eq!(properties_at(&path), known, "{path}: {refusal}");
    }
    // A schema does not follow names, compare times, or count one array by another.
    for (path, value) in [
        ("/initial", json!("other")),
        ("/machine/0/to", json!("other")),
        ("/machine/0/time", json!([8, 7])),
        ("/machine/0/time", json!([8])),
        ("/machine/0/time", json!([8, null])),
        ("/offset", json!(100)),
        ("/burst", json!(2)),
        ("/sporadic", json!(true)),
        ("/cpus", json!([3])),
        ("/jitter", json!("5 us")),
    ] {
        assert_eq!(agree(&with(&format!("front{path}"), value)), (true, false), "{path}");
    }
}

/// The keys that the schema of task sets has for the object at this path.
fn properties_at(path: &str) -> BTreeSet<&'static str> {
    static SCHEMA: LazyLock<Value> = LazyLock::new(|| serde_json::from_str(TASK_SET).unwrap());
    let resolve = |at: &'static Value| match at["$ref"].as_str() {
        Some(place) => SCHEMA.pointer(place.trim_start_matches('#')).unwrap(),
        None => at.pointer("/allOf/0/$ref").map_or(at, |_| SCHEMA.pointer("/definitions/task").unwrap()),
    };
    let step = |at: &'static Value, part: &str| match part.parse::<usize>() {
        Ok(_) => resolve(&at["items"]),
        Err(_) => resolve(&at["properties"][part]),
    };
    let found = path.split('/').skip(1).fold(&*SCHEMA, step);
    found["properties"].as_object().unwrap().keys().map(String::as_str).collect()
}

/// Where the objects of a document stand, and their keys.
fn objects(document: &Value) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    let mut open = vec![(String::new(), document)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Array(values) => {
                open.extend(values.iter().enumerate().map(|(index, it)| (format!("{path}/{index}"), it)));
            }
            Value::Object(values) => {
                open.extend(values.iter().map(|(key, it)| (format!("{path}/{key}"), it)));
                found.push((path, values.keys().cloned().collect()));
            }
            _ => {}
        }
    }
    found
}
