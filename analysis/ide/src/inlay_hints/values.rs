//! Hints with the values of properties and constants: all values beside an instance; beside a setting, the computed value and the
//! value that it overrides.

use mauve_hir::item_tree::{Expr, Setting};
use mauve_hir::{
    Decl, Location, ModelDb, Project, ValueInEffect, architecture, deployment, target_of,
    values_in_architecture, values_in_effect,
};

use super::InlayHint;

const MOST_VALUES: usize = 3;

pub(super) fn of_values(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, hints: &mut Vec<InlayHint>) {
    let (settings, values) = match (architecture(db, of), deployment(db, of)) {
        (Some(data), _) => {
            let values = values_in_architecture(db, project, of);
            for instance in &data.instances {
                let Some(ty) = &instance.component else { continue };
                let known = values.get(&instance.name.name).into_iter().flatten();
                let known: Vec<String> =
                    known.filter_map(|it| Some(format!("{} = {}", it.name, it.value.as_ref()?))).collect();
                if known.is_empty() {
                    continue;
                }
                let more = known.len().saturating_sub(MOST_VALUES);
                let mut label = known.iter().take(MOST_VALUES).cloned().collect::<Vec<_>>().join(", ");
                if more > 0 {
                    label += &format!(" and {more} more");
                }
                hints.push(behind(db, Location::Source(of, ty.id), label));
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
        let mut label = Vec::new();
        if !matches!(setting.value, Expr::Literal(..)) {
            label.push(format!("= {value}"));
        }
        let instead = below.and_then(|below| value_of(below, setting)).filter(|other| *other != value);
        label.extend(instead.map(|other| format!("overrides {other}")));
        if !label.is_empty() {
            hints.push(behind(db, Location::Source(of, id), label.join(", ")));
        }
    }
}

type Values<'db> = std::collections::BTreeMap<mauve_hir::item_tree::Name, Vec<ValueInEffect<'db>>>;

fn value_of(values: &Values<'_>, setting: &Setting) -> Option<String> {
    let endpoint = setting.endpoint.as_ref()?;
    let feature = endpoint.feature.as_ref()?;
    let known = values.get(&endpoint.instance.name)?.iter().find(|it| it.name == feature.name)?;
    known.value.as_ref().map(ToString::to_string)
}

fn behind(db: &dyn ModelDb, place: Location<'_>, label: String) -> InlayHint {
    InlayHint { offset: place.range(db).end(), label, explained_at: None }
}
