//! What stands in a deployment: an activity for each instance, and values.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use mauve_model::item_tree::{Kind, Name};
use mauve_model::{Decl, Type, deployment};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::ast::{self, AstNode as _};

use super::position::without_path;
use super::{Completer, Completion, CompletionKind};
use crate::program::resolved;

/// What is said of an activity, and what each means.
const FIELDS: [(&str, &str, &str); 4] = [
    ("priority", "priority = $1", "greater is more urgent, 1 to 99; or background"),
    ("period", "period = $1", "in milliseconds"),
    ("deadline", "deadline = $1", "in milliseconds; the period where it is left out"),
    ("affinity", "affinity = $1", "a bit for each CPU that it may run on; 0: any"),
];

impl<'db> Completer<'_, 'db> {
    pub(super) fn deployment_item(&mut self) {
        let (rest, path) = without_path(&self.at.item);
        let kinds: Vec<_> = rest.iter().map(|token| token.kind()).collect();
        match kinds.as_slice() {
            [] if path.is_empty() => self.deployment_items(),
            [ARCHITECTURE_KW] => self.declared(Kind::Architecture, &path),
            [ACTIVITY_KW] if path.is_empty() => self.activities(""),
            [PROPERTY_KW | CONSTANT_KW, ..] => {
                if let Some(target) = self.target() {
                    self.setting(target, &kinds, &path);
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
        let missing = self.without_activity();
        if missing.len() > 1 {
            let mut snippet = String::new();
            for (index, (name, _)) in missing.iter().enumerate() {
                let line = if index > 0 { "\n" } else { "" };
                let (priority, period) = (2 * index + 1, 2 * index + 2);
                let _ = write!(
                    snippet,
                    "{line}activity {name} {{ priority = ${{{priority}:1}} period = ${{{period}:100}} }}"
                );
            }
            let label = format!("activities of all {} instances without one", missing.len());
            let mut item = Completion::new(CompletionKind::Skeleton, label).snippet(snippet).rank(2);
            item.filter = Some("activity activities".to_owned());
            self.add(item);
        }
    }

    /// The architecture that is deployed.
    fn target(&self) -> Option<Decl<'db>> {
        let of = self.decl?;
        let target = deployment(self.db, of)?.targets.first()?;
        resolved(self.db, self.project, of, Kind::Architecture, &target.path)
    }

    /// The instances that have no activity, but for the one in which the cursor is.
    fn without_activity(&self) -> Vec<(Name, Option<Decl<'db>>)> {
        let Some(target) = self.target() else { return Vec::new() };
        let activities = self.at.list.children().filter_map(ast::Activity::cast);
        let names = activities.filter_map(|activity| activity.name_ref());
        let names = names.filter(|name| name.syntax().text_range() != self.at.word);
        let known: BTreeSet<String> = names.map(|name| name.syntax().text().to_string()).collect();
        let all = self.instances(target).into_iter();
        let missing = all.filter(|(name, ..)| !known.contains(name.as_str()));
        missing.map(|(name, component, _)| (name, component)).collect()
    }

    fn activities(&mut self, keyword: &str) {
        let Some(target) = self.target() else { return };
        for (name, component) in self.without_activity() {
            let mut item = self.of_instance(target, &name, component).rank(0);
            item.label = format!("{keyword}{name}");
            item.insert.clone_from(&item.label);
            let item = match self.at.right {
                L_CURLY => item,
                _ => item.snippet(format!("{keyword}{name} {{ priority = ${{1:1}} period = ${{2:100}} }}")),
            };
            self.add(item);
        }
    }

    pub(super) fn activity_field(&mut self) {
        let kinds = self.at.kinds();
        match kinds.as_slice() {
            [] => self.fields(),
            [_, EQ] => {
                if self.at.item.first().is_some_and(|name| name.text() == "priority") {
                    let note = "not real-time, and not analysed";
                    self.add(Completion::new(CompletionKind::Value, "background").note(note));
                }
                self.value_of(Some(Type::INT));
            }
            _ if self.at.may_begin => self.fields(),
            _ => {}
        }
    }

    /// The fields that the activity does not have.
    fn fields(&mut self) {
        let fields = self.at.list.children().filter_map(ast::Field::cast);
        let names = fields.filter_map(|field| field.name_ref());
        let names = names.filter(|name| name.syntax().text_range() != self.at.word);
        let known: BTreeSet<String> = names.map(|name| name.syntax().text().to_string()).collect();
        for (rank, (name, snippet, note)) in FIELDS.into_iter().enumerate() {
            if !known.contains(name) {
                let item = Completion::new(CompletionKind::Property, name).note(note).rank(rank as u8);
                self.add(if self.at.right == EQ { item } else { item.snippet(snippet) });
            }
        }
    }
}
