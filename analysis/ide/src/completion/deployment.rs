//! Completion in a deployment: activities of the instances that have none first, then values of properties and constants.

use std::collections::BTreeSet;

use mauve_hir::item_tree::{FeatureKind, Kind, Name};
use mauve_hir::{
    ACTIVITY_FIELDS, DEPENDENT_FIELDS, Decl, EXCLUSIVE_FIELDS, FieldEntry, Type, deployment, flat_of,
    hosts_of, likely_declaration, platform_of,
};
use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::keywords::{ActivityField, BACKGROUND};
use mauve_timing::CpuSet;

use mauve_wcrt::{NewActivity, declared_threads, new_activities, system_of};

use super::architecture::OfInstance;
use super::{Completer, Completion, CompletionKind, Subject};
use crate::program::of_kind;

impl<'db> Completer<'_, 'db> {
    pub(super) fn deployment_item(&mut self, kinds: &[SyntaxKind], path: &[&str]) {
        match kinds {
            [] if path.is_empty() => self.deployment_items(),
            [ARCHITECTURE_KW] => self.declared(Kind::Architecture, path),
            [ACTIVITY_KW] if path.is_empty() => self.activities(""),
            [PROPERTY_KW | CONSTANT_KW, ..] => {
                if let Some(target) = self.target() {
                    self.setting(target, kinds, path);
                }
            }
            _ => {}
        }
        if !kinds.is_empty() && self.at.may_begin {
            self.deployment_items();
        }
    }

    fn deployment_items(&mut self) {
        if !self.at.list.children().any(|node| node.kind() == TARGET) {
            self.skeleton("architecture", "architecture ${1:Architecture}");
        }
        self.keyword("activity");
        self.skeleton("property", "property ${1:instance.name} = ${2:0}");
        self.skeleton("constant", "constant ${1:instance.name} = ${2:0}");
        self.activities("activity ");
        self.missing_values();
        let missing = self.without_activity();
        if missing.len() > 1 {
            let mut next = 1;
            let names: Vec<Name> = missing.into_iter().map(|it| it.name).collect();
            let lines: Vec<String> = self
                .new_activities(&names)
                .iter()
                .map(|it| activity_snippet(it, "activity ", &mut next))
                .collect();
            let label = format!("activities of all {} instances without one", lines.len());
            let mut item = Completion::new(CompletionKind::Skeleton, label).snippet(lines.join("\n")).rank(2);
            item.filter = Some("activity activities".to_owned());
            self.add(item);
        }
    }

    fn new_activities(&self, instances: &[Name]) -> Vec<NewActivity> {
        self.decl.map_or_else(Vec::new, |of| new_activities(self.db, self.project, of, instances))
    }

    /// Offers a setting for each property and constant of the instances that has no value.
    fn missing_values(&mut self) {
        let Some(target) = self.target() else { return };
        for OfInstance { name: instance, features, .. } in self.instances(target) {
            for (name, (shell, feature)) in features {
                let keyword = match feature.kind {
                    FeatureKind::Property => "property",
                    FeatureKind::Constant => "constant",
                    _ => continue,
                };
                if feature.value.is_none() && !self.is_set(target, &instance, &name) {
                    let label = format!("{keyword} {instance}.{name}");
                    let snippet = format!("{label} = $0");
                    let item = Completion::new(CompletionKind::Property, label).snippet(snippet);
                    let subject = Subject::of(self.db, shell, Some(name));
                    self.add(item.rank(0).note("has no value").subject(subject));
                }
            }
        }
    }

    fn target(&self) -> Option<Decl<'db>> {
        let of = self.decl?;
        let target = deployment(self.db, of)?.targets.first()?;
        likely_declaration(self.db, self.project, of, Kind::Architecture, &target.path)
    }

    fn without_activity(&self) -> Vec<OfInstance<'db>> {
        let Some(target) = self.target() else { return Vec::new() };
        let activities = self.at.list.children().filter_map(ast::Activity::cast);
        let mut known: BTreeSet<String> =
            self.others(activities.filter_map(|activity| activity.name_ref())).into_iter().collect();
        let data = self.decl.and_then(|of| deployment(self.db, of));
        let of_lists = data.into_iter().flat_map(|data| &data.activities).filter(|it| it.instances.len() > 1);
        known.extend(of_lists.flat_map(|it| &it.instances).map(|it| it.name.to_string()));
        let all = self.instances(target).into_iter();
        all.filter(|it| !known.contains(it.name.as_str())).collect()
    }

    fn activities(&mut self, keyword: &str) {
        let missing = self.without_activity();
        let names: Vec<Name> = missing.iter().map(|it| it.name.clone()).collect();
        for (instance, new) in missing.iter().zip(self.new_activities(&names)) {
            let mut item = self.of_instance(instance).rank(0);
            item.label = format!("{keyword}{}", instance.name);
            item.insert.clone_from(&item.label);
            let snippet = activity_snippet(&new, keyword, &mut 1);
            self.add(item.completed(self.at.right == L_CURLY, snippet));
        }
    }

    pub(super) fn activity_field(&mut self) {
        let kinds = self.at.kinds();
        let name = self.at.item.first().map(|name| name.text().to_owned()).unwrap_or_default();
        let field = ActivityField::from_keyword(&name);
        match (kinds.as_slice(), field) {
            ([], _) => self.fields(),
            ([_, EQ], Some(ActivityField::Priority)) => {
                let note = "not real-time, and not analysed";
                self.add(Completion::new(CompletionKind::Value, BACKGROUND).note(note));
            }
            ([_, EQ], Some(ActivityField::Affinity)) => self.cpus(|cpu| CpuSet::of(cpu).0.to_string()),
            ([_, EQ], Some(ActivityField::Cpus)) => {
                self.cpus(|cpu| format!("[{}]", cpu + 1));
                for (set, cpus) in &platform_of(self.db, self.project.workspace(self.db)).cpu_sets {
                    self.add(Completion::new(CompletionKind::Constant, set.as_str()).note(cpus.to_string()));
                }
            }
            ([_, EQ, L_BRACK, ..], Some(ActivityField::Cpus)) => self.cpus(|cpu| (cpu + 1).to_string()),
            ([_, EQ], Some(ActivityField::Trigger)) => {
                self.triggers();
                for word in ["any", "all"] {
                    self.skeleton(&format!("{word} […]"), &format!("{word} [$1]"));
                }
            }
            ([_, EQ, _, L_BRACK, ..], Some(ActivityField::Trigger)) => self.triggers(),
            ([_, EQ, L_BRACK, ..], Some(ActivityField::Instances)) => self.listed_instances(),
            ([_, EQ], Some(ActivityField::Instances)) => self.skeleton("[…]", "[$1]"),
            ([_, EQ], Some(ActivityField::Thread)) => self.threads(),
            ([_, EQ], Some(ActivityField::Order)) => self.words(&["fifo", "any", "rounds"]),
            ([_, EQ], Some(ActivityField::Preemptive)) => self.words(&["false", "true"]),
            ([_, EQ], Some(ActivityField::Rate)) => self.skeleton("30 Hz", "${1:30} Hz"),
            ([_, EQ], _) => self.value_of(Some(Type::INT)),
            _ if self.at.may_begin => self.fields(),
            _ => {}
        }
    }

    fn cpus(&mut self, written: impl Fn(u32) -> String) {
        let hosts = hosts_of(self.db, self.project.workspace(self.db));
        let all = self.decl.map_or(CpuSet::NONE, |of| system_of(self.db, self.project, of).cpus);
        let host = self.activity_name().and_then(|name| hosts.all.get(hosts.of(&name)?));
        let (_, all) = hosts.local(host.map_or(all, |it| it.cpus));
        for cpu in all.iter() {
            let note = CpuSet::of(cpu).to_string();
            self.add(Completion::new(CompletionKind::Value, written(cpu)).note(note));
        }
    }

    fn words(&mut self, words: &[&str]) {
        words.iter().for_each(|word| self.add(Completion::new(CompletionKind::Value, *word)));
    }

    /// Offers the threads of the other activities.
    fn threads(&mut self) {
        let activities =
            self.decl.and_then(|of| deployment(self.db, of)).map_or(&[][..], |it| &it.activities);
        let fields = activities.iter().filter_map(|it| it.field(ActivityField::Thread));
        let mut names: BTreeSet<String> =
            fields.filter_map(|it| Some(it.value.as_name()?.name.to_string())).collect();
        let declared = declared_threads(self.db, self.project.workspace(self.db));
        names.extend(declared.all.iter().map(|it| format!("\"{}\"", it.id)));
        names.iter().for_each(|name| self.add(Completion::new(CompletionKind::Value, name.as_str())));
    }

    /// Returns the name of the activity at the cursor.
    fn activity_name(&self) -> Option<String> {
        let activity = ast::Activity::cast(self.at.list.clone())?;
        Some(activity.name_ref()?.syntax().text().to_string())
    }

    /// Offers the input ports of the instance.
    fn triggers(&mut self) {
        let (Some(target), Some(name)) = (self.target(), self.activity_name()) else { return };
        for instance in self.instances(target).into_iter().filter(|it| it.name == *name) {
            for (port, shell, _) in of_kind(&instance.features, FeatureKind::Input) {
                let subject = Subject::of(self.db, shell, Some(port.clone()));
                self.add(Completion::new(CompletionKind::Port, port.as_str()).subject(subject));
            }
        }
    }

    /// Offers the instances that no activity executes.
    fn listed_instances(&mut self) {
        let (Some(of), Some(target)) = (self.decl, self.target()) else { return };
        let activities = deployment(self.db, of).map_or(&[][..], |data| &data.activities);
        for instance in self.instances(target) {
            if !activities.iter().any(|it| it.executes(&instance.name)) {
                self.add(self.of_instance(&instance).rank(0));
            }
        }
    }

    /// Offers the fields that the activity does not have and that go with those that it has: the required ones first, then the
    /// affinity, which projects with several CPUs require.
    fn fields(&mut self) {
        let fields = self.at.list.children().filter_map(ast::Field::cast);
        let known = self.others(fields.filter_map(|field| field.name_ref()));
        let has = |field: ActivityField| known.iter().any(|known| known == field.keyword());
        let name = self.activity_name().unwrap_or_default();
        let is_instance =
            self.target().is_some_and(|of| flat_of(self.db, self.project, of).instance(&name).is_some());
        let fits = |field: ActivityField| match field {
            ActivityField::Instances if is_instance => false,
            field if DEPENDENT_FIELDS.iter().any(|[one, other]| *one == field && !has(*other)) => false,
            field => EXCLUSIVE_FIELDS
                .iter()
                .all(|[one, other]| !(field == *one && has(*other) || field == *other && has(*one))),
        };
        let (required, optional): (Vec<_>, Vec<_>) =
            ACTIVITY_FIELDS.iter().partition(|it| it.default.is_none());
        for (rank, entry) in required.into_iter().chain(optional).enumerate() {
            let FieldEntry { field, values, default, .. } = entry;
            let name = field.keyword();
            if !has(*field) && fits(*field) {
                let note = match default {
                    Some(default) => format!("{values}; by default {default}"),
                    None => (*values).to_owned(),
                };
                let item = Completion::new(CompletionKind::Property, name).note(note).rank(rank as u8);
                let snippet = match field {
                    ActivityField::Instances => format!("{name} = [$1]"),
                    ActivityField::Rate => format!("{name} = ${{1:30}} Hz"),
                    _ => format!("{name} = $1"),
                };
                self.add(item.completed(self.at.right == EQ, snippet));
            }
        }
    }
}

/// Returns the snippet of an activity; its placeholders are numbered from `next`.
fn activity_snippet(new: &NewActivity, keyword: &str, next: &mut usize) -> String {
    let fields = new.fields().into_iter().map(|(field, value)| {
        let number = std::mem::replace(next, *next + 1);
        format!("{} = ${{{number}:{value}}}", field.keyword())
    });
    format!("{keyword}{} {{ {} }}", new.instance, fields.collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::super::testing::offered;
    use expect_test::{Expect, expect};

    fn check(item: &str, expected: Expect) {
        let text = format!(
            "
library a {{
  shell S {{ property on: bool  property level: int = 1 }}
  core K(S) {{}}
  component C(S, K)
  architecture Robot {{ instance one: C  instance two: C  instance three: C  property two.on = true }}
}}
deployment D {{
  architecture a.Robot
  activity one {{ priority = 1 period = 10 }}
  {item}
}}
"
        );
        expected.assert_eq(&offered(&text, 3));
    }

    #[test]
    fn an_activity_for_each_instance_that_has_none() {
        check(
            "$0",
            expect![[r#"
                0 activity two: C ⇒ "activity two { priority = ${1:2} period = ${2:10} }"
                0 activity three: C ⇒ "activity three { priority = ${1:3} period = ${2:10} }"
                0 property one.on (has no value) ⇒ "property one.on = $0"
                0 property three.on (has no value) ⇒ "property three.on = $0"
                1 activity
                1 property (property instance.name = 0) ⇒ "property ${1:instance.name} = ${2:0}"
                1 constant (constant instance.name = 0) ⇒ "constant ${1:instance.name} = ${2:0}"
                2 activities of all 2 instances without one ⇒ "activity two { priority = ${1:2} period = ${2:10} }\nactivity three { priority = ${3:3} period = ${4:10} }"
            "#]],
        );
        check(
            "activity t$0 { }",
            expect![[r#"
            0 two: C
            0 three: C
        "#]],
        );
    }

    #[test]
    fn fields_that_are_not_given() {
        check(
            "activity two { priority = 2 $0 }",
            expect![[r#"
                1 period (in milliseconds) ⇒ "period = $1"
                3 thread (the name of the thread that executes it, and other activities with this thread; by default a thread of its own) ⇒ "thread = $1"
            "#]],
        );
        check(
            "activity two { priority = $0 }",
            expect![[r#"
            1 background (not real-time, and not analysed)
        "#]],
        );
        check("activity two { period = $0 }", expect![[""]]);
        check(
            "activity two { affinity = $0 }",
            expect![[r#"
            1 1 (CPU 1)
        "#]],
        );
    }

    #[test]
    fn fields_and_values_of_triggers_and_lists() {
        let check = |activity: &str, expected: Expect| {
            let text = format!(
                "
shell S {{ input port scan: int  output port track: int }}
core K(S) {{}}
component C(S, K)
architecture Robot {{ instance one: C  instance two: C  instance three: C }}
deployment D {{
  architecture Robot
  activity one {{ priority = 1 period = 10 }}
  {activity}
}}
//- /mauve.toml
[platform]
cpus = 2
[platform.cpu_sets]
big = [2]
"
            );
            expected.assert_eq(&offered(&text, 9));
        };
        check(
            "activity two { trigger = $0 }",
            expect![[r#"
            1 scan
            1 any […] (any []) ⇒ "any [$1]"
            1 all […] (all []) ⇒ "all [$1]"
        "#]],
        );
        check(
            "activity two { trigger = all [$0] }",
            expect![[r#"
            1 scan
        "#]],
        );
        check(
            "activity two { cpus = $0 }",
            expect![[r#"
            1 [1] (CPU 1)
            1 [2] (CPU 2)
            1 big (CPU 2)
        "#]],
        );
        check(
            "activity two { cpus = [1, $0] }",
            expect![[r#"
            1 1 (CPU 1)
            1 2 (CPU 2)
        "#]],
        );
        check(
            "activity pair { instances = [two, $0] priority = 2 period = 10 }",
            expect![[r#"
            0 three: C
        "#]],
        );
        check(
            "activity pair { priority = 2 $0 }",
            expect![[r#"
                1 period (in milliseconds) ⇒ "period = $1"
                2 instances (the instances that one thread executes in order, such as [imu, gps]; by default the instance of its name) ⇒ "instances = [$1]"
                3 thread (the name of the thread that executes it, and other activities with this thread; by default a thread of its own) ⇒ "thread = $1"
                5 affinity (the CPUs as a mask: 1 is CPU 1, 2 is CPU 2, 3 is both; by default any CPU) ⇒ "affinity = $1"
                6 cpus (the CPUs as a list, such as [1, 2], or a set of mauve.toml; by default what `affinity` says) ⇒ "cpus = $1"
                7 preemptive (whether a job that has begun may be preempted: true or false; by default `true`) ⇒ "preemptive = $1"
                8 trigger (the input port whose data releases it, or any or all of several: any [scan, odometry]; by default its clock) ⇒ "trigger = $1"
            "#]],
        );
        check(
            "activity two { priority = 2 trigger = scan $0 }",
            expect![[r#"
                1 period (in milliseconds) ⇒ "period = $1"
                3 thread (the name of the thread that executes it, and other activities with this thread; by default a thread of its own) ⇒ "thread = $1"
                5 affinity (the CPUs as a mask: 1 is CPU 1, 2 is CPU 2, 3 is both; by default any CPU) ⇒ "affinity = $1"
                6 cpus (the CPUs as a list, such as [1, 2], or a set of mauve.toml; by default what `affinity` says) ⇒ "cpus = $1"
                7 preemptive (whether a job that has begun may be preempted: true or false; by default `true`) ⇒ "preemptive = $1"
                9 least (the least time between two releases by data, in milliseconds; by default what `period` says) ⇒ "least = $1"
            "#]],
        );
        check(
            "activity two { priority = 2 rate = $0 }",
            expect![[r#"
            1 30 Hz (30 Hz) ⇒ "${1:30} Hz"
        "#]],
        );
    }

    #[test]
    fn values_of_properties_are_offered() {
        check(
            "property two.$0",
            expect![[r#"
            1 level: int ⇒ "level = $0"
            3 on: bool (has a value already) ⇒ "on = $0"
        "#]],
        );
        check(
            "property one.on = $0",
            expect![[r#"
            1 true
            1 false
        "#]],
        );
    }

    #[test]
    fn what_is_deployed() {
        let text = "architecture Robot { } deployment D { architecture $0 }";
        expect![[r#"
            1 Robot
        "#]]
        .assert_eq(&offered(text, 3));
    }
}
