//! Hints with the values of properties and constants: beside an instance, those that the architecture overrides; beside a
//! setting, the computed value and the value that it overrides.

use std::collections::BTreeMap;

use mauve_hir::item_tree::{Expr, Name, Setting};
use mauve_hir::{
    Decl, Location, ModelDb, Project, Value, ValueInEffect, architecture, deployment, target_of,
    values_in_architecture, values_in_effect, values_of_shell,
};
use rustc_hash::FxHashMap;

use super::label::Texts;
use super::{HintOf, InlayHint, end_of_line};
use mauve_diagnostics::figure::{HintStatus, MOST_CHARACTERS, cut};

pub(super) fn of_values(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, found: &mut Vec<HintOf>) {
    let (settings, values) = match (architecture(db, of), deployment(db, of)) {
        (Some(data), _) => {
            let values = values_in_architecture(db, project, of);
            let mut defaults: FxHashMap<Decl<'_>, BTreeMap<Name, Value>> = FxHashMap::default();
            for instance in &data.instances {
                let Some(ty) = &instance.component else { continue };
                let known = values.get(&instance.name.name).into_iter().flatten();
                let overriding = known.filter_map(|it| {
                    let shell = it.declared.shell;
                    let of_shell =
                        defaults.entry(shell).or_insert_with(|| values_of_shell(db, project, shell));
                    let value = it.value.as_ref().filter(|value| of_shell.get(&it.name) != Some(*value))?;
                    Some(format!("{} = {value}", it.name))
                });
                let overriding: Vec<String> = overriding.collect();
                if !overriding.is_empty() {
                    found.push(behind(db, Location::Source(of, ty.id), &list(&overriding)));
                }
            }
            (&data.settings, values)
        }
        (None, Some(data)) if !data.settings.is_empty() => {
            (&data.settings, values_in_effect(db, project, of))
        }
        (None, _) => return,
    };
    // The values that a deployment may override.
    let below = target_of(db, project, of).map(|target| values_in_effect(db, project, target));
    for setting in settings {
        let Some(value) = value_of(values, setting) else { continue };
        let Some(id) = setting.value.id() else { continue };
        let computed = (!matches!(setting.value, Expr::Literal(..))).then(|| format!("= {value}"));
        let instead = below.and_then(|below| value_of(below, setting)).filter(|other| *other != value);
        let label: Vec<String> =
            computed.into_iter().chain(instead.map(|other| format!("overrides {other}"))).collect();
        if !label.is_empty() {
            found.push(behind(db, Location::Source(of, id), &label.join(", ")));
        }
    }
}

/// Returns as many values as fit, and the number of the others.
fn list(values: &[String]) -> String {
    let shown = |count: usize| {
        let more = values.len() - count;
        let end = if more > 0 { format!(" and {more} more") } else { String::new() };
        values.iter().take(count).cloned().collect::<Vec<_>>().join(", ") + &end
    };
    let fits = (1..=values.len()).rev().map(shown).find(|text| text.chars().count() <= MOST_CHARACTERS);
    fits.unwrap_or_else(|| cut(&shown(1), MOST_CHARACTERS))
}

type ValuesOfInstances<'db> = BTreeMap<Name, Vec<ValueInEffect<'db>>>;

fn value_of(values: &ValuesOfInstances<'_>, setting: &Setting) -> Option<String> {
    let endpoint = setting.endpoint.as_ref()?;
    let feature = endpoint.feature.as_ref()?;
    let known = values.get(&endpoint.instance.name)?.iter().find(|it| it.name == feature.name)?;
    known.value.as_ref().map(ToString::to_string)
}

fn behind(db: &dyn ModelDb, place: Location<'_>, label: &str) -> HintOf {
    let explained_at = place.range(db).start();
    let offset = end_of_line(place.file(db).text(db), place.range(db).end());
    let texts = Texts::of([label.to_owned()]);
    let hint = InlayHint::new(offset, texts, MOST_CHARACTERS, HintStatus::Value, Some(explained_at));
    HintOf { hint, subject: None, figure: None, room: MOST_CHARACTERS }
}
