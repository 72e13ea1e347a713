//! Keys and values of `mauve.toml` and of timing tables.

use std::collections::{BTreeSet, HashSet};

use mauve_diagnostics::codes;
use mauve_hir::config_keys::{SECTIONS, Suggestions};
use mauve_hir::item_tree::{Feature, FeatureKind, Kind, Name};
use mauve_hir::{
    Decl, File, FlatInstance, ModelDb, ProgramKey, Project, TopicType, Type, Workspace, behaviour_of,
    config_file, core, core_of, flat_of, hosts_of, is_model, likely_features_of, likely_shell_of, names_of,
    projects, ros2_of, type_of,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::Unit;
use mauve_timing::table_keys::{KEYS, TableKey, TableKeyKind};
use mauve_timing::toml_key::{TomlKey, ValueKind, headers, key_named, keys_below, keys_to_write};
use mauve_wcrt::{
    Lookup, PREFIX_OF_TOPICS, level_shown, levels_of_tables, table_files, table_sets, timetable_of,
};

use super::{Completion, CompletionKind, Completions};
use crate::toml_place::{TomlPlace, What};

pub(super) fn completions(
    db: &dyn ModelDb,
    workspace: Workspace,
    file: File,
    offset: TextSize,
) -> Completions {
    let Some(place) = TomlPlace::at(file.text(db), offset.into()) else { return Completions::default() };
    let is_config = config_file(db, workspace) == Some(file);
    let is_table = table_files(db, workspace).files.contains(&file);
    if !is_config && !is_table {
        return Completions::default();
    }
    let toml = Toml { db, workspace, file };
    let mut items = match &place.what {
        What::Header => Vec::new(),
        What::Key if is_config => toml.config_keys(&place.section),
        What::Key => toml.table_keys(&place.section),
        What::Value(key) if is_config => toml.config_values(&place.section, key),
        What::Value(key) if key == "unit" => Unit::ALL.map(|unit| text(unit.name())).into(),
        What::Value(_) => Vec::new(),
    };
    let is_key = matches!(place.what, What::Key);
    items.retain(|item| !is_key || !place.given.contains(&item.label));
    for item in &mut items {
        let is_bare = item.label.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
        if is_key && (!is_bare || place.is_quoted) {
            item.insert = format!("\"{}\"", item.label);
        }
        if place.is_quoted {
            item.filter = Some(item.insert.clone());
        } else if is_key && !place.has_value {
            item.filter = Some(item.label.clone());
        }
        if is_key && !place.has_value {
            item.insert += " = ";
        }
    }
    let is_line = matches!(place.what, What::Header | What::Key) && !place.is_inline;
    if is_line && !place.is_quoted && !place.has_value {
        let headers = if is_config { headers(&SECTIONS) } else { headers(&KEYS) };
        let rank = if matches!(place.what, What::Header) { 0 } else { 2 };
        for (label, summary) in headers {
            let name = label.trim_matches(['[', ']']);
            // Tables in sections have names, or are in lists.
            if name.contains('.') || !place.sections.contains(name) {
                items.push(Completion::new(CompletionKind::Key, label).note(summary).rank(rank));
            }
        }
    }
    items.sort_by_key(|item| item.rank);
    let replaced = TextRange::new((place.start as u32).into(), (place.end as u32).into());
    for item in &mut items {
        item.replaced = replaced;
    }
    Completions { items, incomplete: false }
}

struct Toml<'db> {
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
}

impl Toml<'_> {
    fn config_keys(&self, section: &str) -> Vec<Completion> {
        match section {
            "ros2.topics" => {
                let all = self.instances(|it| self.topics(it)).into_iter();
                all.map(|it| Completion::new(CompletionKind::Port, it.label).rank(0)).collect()
            }
            "lints" => codes().map(|code| Completion::new(CompletionKind::Key, code.name)).collect(),
            _ => declared(&SECTIONS, section).into_iter().map(|it| it.rank(0)).collect(),
        }
    }

    fn config_values(&self, section: &str, key: &str) -> Vec<Completion> {
        let found = key_named(keys_below(&SECTIONS, section), key);
        match found.map(|it| it.kind.suggestions()) {
            Some(Suggestions::Models) => self.files(true),
            Some(Suggestions::Tables) => self.files(false),
            Some(Suggestions::Instances) => self.instances(|(_, it)| vec![it.name.clone()]),
            Some(Suggestions::Codels) => self.codels(),
            Some(Suggestions::ChainEnds) => [self.codels(), self.instances_and_ports()].concat(),
            Some(Suggestions::ChainWay) => self.instances_and_ports(),
            Some(Suggestions::ChainStates) => self.instances(|it| self.states(it)),
            Some(Suggestions::ChainAnswers) => {
                [self.codels(), self.instances(|it| self.ports(it, FeatureKind::Input))].concat()
            }
            Some(Suggestions::Hosts) => {
                hosts_of(self.db, self.workspace).all.iter().map(|it| text(&it.name)).collect()
            }
            Some(Suggestions::Levels) => {
                let levels = projects(self.db, self.workspace).iter();
                let levels = levels.flat_map(|&it| levels_of_tables(self.db, it));
                let levels: BTreeSet<String> = levels.map(|level| level.to_string()).collect();
                levels.iter().map(|level| value(level)).collect()
            }
            Some(Suggestions::Words(words)) => words.iter().map(|word| value(word)).collect(),
            Some(Suggestions::Strings(words)) => words.iter().map(|word| text(word)).collect(),
            None => Vec::new(),
        }
    }

    fn table_keys(&self, section: &str) -> Vec<Completion> {
        let db = self.db;
        if !matches!(key_named(&KEYS, section), Some(TableKey { kind: TableKeyKind::Entries(..), .. })) {
            return declared(&KEYS, section);
        }
        let kind = if matches!(section, "codel" | "wait") { Kind::Codel } else { Kind::Component };
        let mut seen = BTreeSet::new();
        let mut items = Vec::new();
        let mut add = |key: String, kind, is_missing: bool| {
            if seen.insert(key.clone()) {
                let item = Completion::new(kind, key);
                items.push(if is_missing { item.rank(0).note("has no time") } else { item });
            }
        };
        for &project in projects(db, self.workspace) {
            let names = names_of(db, project);
            let untimed = untimed_codels(db, project);
            for decl in names.of_kind(db, kind).filter(|decl| !decl.name(db).is_empty()) {
                let name = decl.name(db);
                let is_clear = kind == Kind::Component && names.by_key(kind, name).len() == 1;
                let key = if is_clear { name.to_string() } else { decl.qualified(db) };
                match section {
                    "codel" => add(key, CompletionKind::Codel, untimed.contains(&decl)),
                    "wait" => add(key, CompletionKind::Codel, false),
                    "component" => add(key, CompletionKind::Component, false),
                    "access" => {
                        let shell = likely_shell_of(db, project, decl);
                        let all =
                            shell.map(|shell| likely_features_of(db, project, shell)).unwrap_or_default();
                        for (port, _) in all.iter().filter(|(_, (_, it))| it.kind.is_port()) {
                            add(format!("{key}.{port}"), CompletionKind::Port, false);
                        }
                    }
                    _ => {
                        let core = core_of(db, project, decl);
                        let known = core.map(|core| behaviour_of(db, project, core));
                        for it in known.into_iter().flat_map(|it| it.programs.iter().chain(&it.operations)) {
                            let program = ProgramKey { component: &key, program: it.id.clone() };
                            add(program.to_string(), CompletionKind::Operation, false);
                        }
                    }
                }
            }
            let deployments = names.of_kind(db, Kind::Deployment).filter(|_| section == "access");
            for topic in deployments.flat_map(|it| &ros2_of(db, project, it).topics) {
                let (instance, port) = &topic.port;
                add(format!("{PREFIX_OF_TOPICS}{instance}.{port}"), CompletionKind::Port, false);
            }
        }
        items
    }

    /// Offers the models, or the tables, by their paths relative to the configuration's folder.
    fn files(&self, models: bool) -> Vec<Completion> {
        let mut paths = BTreeSet::new();
        for (path, &file) in self.workspace.files(self.db).iter() {
            let is_wanted = is_model(path) == models && file != self.file;
            if let Ok(path) = path.strip_prefix(self.workspace.folder(self.db))
                && is_wanted
            {
                paths.insert(path.display().to_string());
            }
        }
        let file = |path: String| {
            let insert = format!("\"{path}\"");
            Completion::new(CompletionKind::File, path).insert(insert)
        };
        paths.into_iter().map(file).collect()
    }

    fn codels(&self) -> Vec<Completion> {
        self.table_keys("wait").iter().map(|key| text(&key.label)).collect()
    }

    /// Offers what `of` lists of each instance of all architectures.
    fn instances(&self, of: impl Fn(InstanceOf<'_, '_>) -> Vec<Name>) -> Vec<Completion> {
        let db = self.db;
        let mut found: BTreeSet<Name> = BTreeSet::new();
        for &project in projects(db, self.workspace) {
            for decl in names_of(db, project).of_kind(db, Kind::Architecture) {
                let instances = &flat_of(db, project, decl).instances;
                found.extend(instances.iter().flat_map(|instance| of((project, instance))));
            }
        }
        found.iter().map(|name| text(name)).collect()
    }

    fn instances_and_ports(&self) -> Vec<Completion> {
        let of =
            |it: InstanceOf<'_, '_>| [vec![it.1.name.clone()], self.ports(it, FeatureKind::Output)].concat();
        self.instances(of)
    }

    /// Returns the ports of an instance of this kind.
    fn ports(&self, it: InstanceOf<'_, '_>, kind: FeatureKind) -> Vec<Name> {
        self.features(it, |_, feature| feature.kind == kind)
    }

    /// Returns the ports of an instance that may be topics.
    fn topics(&self, it: InstanceOf<'_, '_>) -> Vec<Name> {
        self.features(it, |shell, feature| {
            let ty = type_of(self.db, it.0, shell, feature.ty.as_ref());
            feature.kind.is_port() && (ty == Type::Unknown || TopicType::of(&ty).is_some())
        })
    }

    /// Returns the features of an instance that are offered, by their shells and declarations.
    fn features(
        &self,
        (project, instance): InstanceOf<'_, '_>,
        is_offered: impl Fn(Decl<'_>, &Feature) -> bool,
    ) -> Vec<Name> {
        let shell = instance.component.and_then(|it| likely_shell_of(self.db, project, it));
        let all = shell.map(|shell| likely_features_of(self.db, project, shell)).unwrap_or_default();
        let found = all.iter().filter(|(_, (of, feature))| is_offered(*of, feature));
        found.map(|(name, _)| Name::from(format!("{}.{name}", instance.name))).collect()
    }

    fn states(&self, (project, instance): InstanceOf<'_, '_>) -> Vec<Name> {
        let core = instance.component.and_then(|it| core(self.db, core_of(self.db, project, it)?));
        let states = core.into_iter().flat_map(|it| it.states());
        states.map(|it| Name::from(format!("{}.{}", instance.name, it.name.name))).collect()
    }
}

type InstanceOf<'a, 'db> = (Project<'db>, &'a FlatInstance<'db>);

/// Returns the keys below a header.
fn declared<K: ValueKind>(keys: &'static [TomlKey<K>], header: &str) -> Vec<Completion> {
    keys_to_write(keys, header).map(|key| Completion::new(CompletionKind::Key, key.name)).collect()
}

/// Returns the codels that components execute in their periods, and that have no time in the tables of some deployment.
fn untimed_codels<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> HashSet<Decl<'db>> {
    let level = level_shown(db, project);
    let tables: Vec<_> = table_sets(db, project).iter().map(|&tables| timetable_of(db, tables)).collect();
    let cores = names_of(db, project).of_kind(db, Kind::Component).filter_map(|it| core_of(db, project, it));
    let behaviours = cores.map(|core| behaviour_of(db, project, core));
    let programs = behaviours.flat_map(|it| it.programs.iter().chain(&it.operations));
    let is_untimed = |codel: &Decl<'db>| {
        let has_none = |found| matches!(found, Lookup::Absent | Lookup::Assumed(_));
        tables.iter().any(|times| has_none(times.codel_time(db, *codel, level)))
    };
    programs.flat_map(|program| program.cost.codels()).filter(is_untimed).collect()
}

fn value(word: &str) -> Completion {
    Completion::new(CompletionKind::Value, word)
}

fn text(word: &str) -> Completion {
    Completion::new(CompletionKind::Value, word).insert(format!("\"{word}\""))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{labels, offered};
    use expect_test::expect;

    const MODEL: &str = "
//- /robot.mal
library nav {
  codel plan(): void
  codel drive(): void
  shell S { output port way: int }
  core K(S) { statemachine { initial state A { run = { plan(); } transition t to A { drive(); } } } }
  component C(S, K)
  architecture R { instance navigation: C }
}
";

    fn with(config: &str, table: &str) -> String {
        format!("{MODEL}//- /mauve.toml\n{config}\n//- /times.toml\n{table}\n")
    }

    const TABLES: &str = "[timing]\ntables = [\"times.toml\"]\n";

    #[test]
    fn sections_and_keys_of_the_configuration() {
        expect![[r#"
            0 observed ⇒ "observed = "
            0 significance ⇒ "significance = "
            0 required ⇒ "required = "
            0 dependent ⇒ "dependent = "
            2 [project] (the roots of the models)
            2 [types.Name] (types that no message package declares)
            2 [generate] (where generated sources go)
            2 [lints] (how bad a diagnostic is)
            2 [assume] (times that the tables lack)
            2 [platform] (what the programs run on)
            2 [clocks] (which releases keep their distance)
            2 [deployment.Name] (what is accepted of a deployment)
            2 [locks.Name] (locks that codels take)
            2 [chains.Name] (how long data may take)
            2 [ros2] (topics of ROS 2)
            2 [host.Name] (a computer of the robot)
            2 [link.Name] (a network between two hosts)
            2 [timing.deployment.Name] (a deployment's own timing tables)
            2 [platform.cpu_sets] (names of CPUs)
            2 [[platform.other]] (real-time work that is not in the model)
            2 [clocks.Name] (activities with a clock of their own)
            2 [ros2.gateway] (the activity that moves samples)
            2 [ros2.topics] (the topics of ports)
        "#]]
        .assert_eq(&offered(&with("[timing]\ntables = []\n$0", ""), 9));
        expect![[r#"
            0 [project] (the roots of the models)
            0 [timing] (where execution times stand)
            0 [types.Name] (types that no message package declares)
            0 [generate] (where generated sources go)
            0 [lints] (how bad a diagnostic is)
            0 [assume] (times that the tables lack)
            0 [clocks] (which releases keep their distance)
            0 [deployment.Name] (what is accepted of a deployment)
            0 [locks.Name] (locks that codels take)
            0 [chains.Name] (how long data may take)
            0 [ros2] (topics of ROS 2)
            0 [host.Name] (a computer of the robot)
            0 [link.Name] (a network between two hosts)
            0 [timing.deployment.Name] (a deployment's own timing tables)
            0 [platform.cpu_sets] (names of CPUs)
            0 [[platform.other]] (real-time work that is not in the model)
            0 [clocks.Name] (activities with a clock of their own)
            0 [ros2.gateway] (the activity that moves samples)
            0 [ros2.topics] (the topics of ports)
        "#]]
        .assert_eq(&offered(&with("[platform]\ncpus = 1\n[pl$0]", ""), 9));
        // Each entry of a list has its own keys.
        let others = "[[platform.other]]\nname = \"lan\"\n[[platform.other]]\npriority = 1\n$0";
        expect![[r#"
            0 name ⇒ "name = "
            0 period ⇒ "period = "
            0 rate ⇒ "rate = "
            0 burst ⇒ "burst = "
            0 time ⇒ "time = "
            0 cpus ⇒ "cpus = "
            0 jitter ⇒ "jitter = "
            0 host ⇒ "host = "
        "#]]
        .assert_eq(&offered(&with(others, ""), 0));
        let topics = "[ros2.topics]\n$0";
        expect![[r#"
            0 navigation.way ⇒ "\"navigation.way\" = "
        "#]]
        .assert_eq(&offered(&with(topics, ""), 0));
        // Inline tables are in the section of their key.
        let written = "{ \"navigation.way\" = { depth = 2, $0, name = \"/way\" } }";
        for config in [format!("[ros2]\ntopics = {written}"), format!("ros2.topics = {written}")] {
            expect![[r#"
                0 reliability ⇒ "reliability = "
                0 durability ⇒ "durability = "
                0 max_bytes ⇒ "max_bytes = "
            "#]]
            .assert_eq(&offered(&with(&config, ""), 9));
        }
        for (config, expected) in [
            ("[ros2]\ntopics = { $0 }", "navigation.way"),
            ("[ros2]\ntopics = { \"nav$0", "navigation.way"),
            ("[ros2]\ntopics = { \"navigation.way\" = \"/way\", $0 }", ""),
            ("[ros2.topics]\n\"navigation.way\" = { reliability = $0 }", "reliable best-effort"),
            (
                "[ros2]\ntopics = { \"navigation.way\" = { durability = \"vo$0\", depth = 1 } }",
                "volatile transient-local",
            ),
            ("[ros2]\ngateway = { cpus = [1, 2], $0", "priority period"),
            ("[ros2]\ngateway = { } $0", ""),
        ] {
            assert_eq!(labels(&with(config, "")).join(" "), expected, "{config}");
        }
        let tables = "[timing.deployment.Sea]\n$0";
        expect![[r#"
            0 tables ⇒ "tables = "
            0 observed ⇒ "observed = "
        "#]]
        .assert_eq(&offered(&with(tables, ""), 0));
        assert_eq!(labels(&with("[timing.deployment.Sea]\ntables = [$0]", "")), ["times.toml"]);
        assert!(labels(&with("[lints]\nlost$0", "")).contains(&"lost-write".to_owned()));
    }

    #[test]
    fn values_of_the_configuration() {
        for (config, expected) in [
            (
                "[project]\nroot = \"$0\"",
                expect![[r#"
                1 robot.mal ⇒ "\"robot.mal\""
            "#]],
            ),
            (
                "[project]\nroots = [\"robot.mal\", $0]",
                expect![[r#"
                1 robot.mal ⇒ "\"robot.mal\""
            "#]],
            ),
            (
                "[timing]\ntables = [\n  \"$0",
                expect![[r#"
                1 times.toml ⇒ "\"times.toml\""
            "#]],
            ),
            (
                "[lints]\nlost-write = $0",
                expect![[r#"
                1 allow ⇒ "\"allow\""
                1 hint ⇒ "\"hint\""
                1 warn ⇒ "\"warn\""
                1 error ⇒ "\"error\""
            "#]],
            ),
            (
                "[platform]\nrt_throttling = t$0",
                expect![[r#"
                1 true
                1 false
            "#]],
            ),
            (
                "[[platform.other]]\nperiod = \"$0",
                expect![[r#"
                1 10 ms ⇒ "\"10 ms\""
            "#]],
            ),
            (
                "[clocks]\nsynchronised = [\"$0\"]",
                expect![[r#"
                1 navigation ⇒ "\"navigation\""
            "#]],
            ),
            (
                "[host.eyes]\nactivities = [\"$0\"]",
                expect![[r#"
                1 navigation ⇒ "\"navigation\""
            "#]],
            ),
            (
                "[clocks.camera]\ninstances = [\"$0\"]",
                expect![[r#"
                1 navigation ⇒ "\"navigation\""
            "#]],
            ),
        ] {
            expected.assert_eq(&offered(&with(config, ""), 9));
        }
        for (value, expected) in [
            ("from = $0", "nav.plan nav.drive navigation navigation.way"),
            ("to = \"na$0\"", "nav.plan nav.drive navigation navigation.way"),
            ("through = [\"x\", \"$0\"]", "navigation navigation.way"),
            ("while = [$0]", "navigation.A"),
            ("answers = [$0]", "nav.plan nav.drive"),
            ("latency = $0", "10 ms"),
        ] {
            let text = with(&format!("[chains.avoid]\n{value}"), "");
            assert_eq!(labels(&text).join(" "), expected, "{value}");
        }
        assert_eq!(labels(&with("[chains.avoid]\nto = \"x\"\n$0", ""))[..2], ["from", "through"]);
        for config in ["# $0", "[timing]\nsignificance = 1$0", "[project]\nroot = \"robot.mal\" # $0"] {
            assert_eq!(labels(&with(config, "")), [] as [&str; 0], "{config}");
        }
    }

    #[test]
    fn keys_of_a_timing_table() {
        for (table, expected) in [
            (
                "u$0",
                expect![[r#"
                1 unit ⇒ "unit = "
                1 levels ⇒ "levels = "
            "#]],
            ),
            (
                "unit = \"$0\"",
                expect![[r#"
                1 ns ⇒ "\"ns\""
                1 us ⇒ "\"us\""
                1 ms ⇒ "\"ms\""
                1 s ⇒ "\"s\""
            "#]],
            ),
            (
                "[codel]\n\"nav.plan\" = 1\n$0",
                expect![[r#"
                    0 nav.drive (has no time) ⇒ "\"nav.drive\" = "
                "#]],
            ),
            (
                "[codel]\n\"nav.$0\" = 3",
                expect![[r#"
                    0 nav.plan (has no time) ⇒ "\"nav.plan\""
                    0 nav.drive (has no time) ⇒ "\"nav.drive\""
                "#]],
            ),
            (
                "[program]\n$0",
                expect![[r#"
                    1 C/A.run ⇒ "\"C/A.run\" = "
                    1 C/A.t.effect ⇒ "\"C/A.t.effect\" = "
                "#]],
            ),
            (
                "[component]\n\"$0",
                expect![[r#"
                    1 C ⇒ "\"C\" = "
                "#]],
            ),
            (
                "[overhead]\ndispatch = 0\n$0",
                expect![[r#"
                1 context_switch ⇒ "context_switch = "
            "#]],
            ),
        ] {
            expected.assert_eq(&offered(&with(TABLES, table), 1));
        }
    }
}
