//! A deployment with other values in its activities, for what-if questions.
//!
//! The values are literals, where the parser would have put them. So a written deployment and a changed one are analysed
//! alike.

use std::fmt::Display;
use std::sync::Arc;

use mauve_timing::Time;

use crate::reason::ActivityField;
use crate::system::{ResolvedActivity, System, read};
use crate::threads::{DeclaredThreads, declared_threads};
use mauve_hir::item_tree::{Deployment, Expr, Field, Literal, Name, NameRef};
use mauve_hir::{Decl, ModelDb, PLACES, Project, deployment, same_fields};

/// Another value of a field of an activity.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct WhatIfField {
    /// The instance; every activity of an instance of this name gets the value.
    pub instance: Name,
    /// The field, which is added where the activity has none.
    pub field: ActivityField,
    /// A number, as it would be written.
    pub value: Name,
}

impl WhatIfField {
    pub(crate) fn new(of: &ResolvedActivity<'_>, field: ActivityField, value: impl Display) -> WhatIfField {
        WhatIfField { instance: of.instance.clone(), field, value: value.to_string().into() }
    }
}

/// Returns another period, and the deadline with it where one is written and is the period now. A deadline that differs is a
/// requirement of its own.
pub(crate) fn other_period(of: &ResolvedActivity<'_>, has_deadline: bool, period: Time) -> Vec<WhatIfField> {
    let mut fields = vec![WhatIfField::new(of, ActivityField::Period, period.number())];
    if has_deadline && of.deadline == of.period {
        fields.push(WhatIfField::new(of, ActivityField::Deadline, period.number()));
    }
    fields
}

/// Returns the least period to which the period of an activity may be shortened: the written deadline, if the period is longer. A job
/// still has to end before the next release.
pub(crate) fn least_period(of: &ResolvedActivity<'_>, has_deadline: bool) -> Time {
    of.deadline.filter(|_| has_deadline && of.deadline < of.period).unwrap_or_default()
}

/// Returns the activities of the deployment that `of` declares, with other values.
pub(crate) fn system_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    what_if: &[WhatIfField],
) -> System<'db> {
    let declared = declared_threads(db, project.workspace(db));
    let read = |data| read(db, project, of, &with_fields(data, declared, what_if));
    deployment(db, of).map_or_else(System::default, read)
}

/// Returns the values with those that the other activities of a thread get with them: it has one priority, and one set of CPUs.
pub fn in_threads(
    data: &Deployment,
    declared: &DeclaredThreads,
    what_if: &[WhatIfField],
) -> Vec<WhatIfField> {
    let mut all = Vec::new();
    for it in what_if {
        let own =
            data.activities.iter().find(|of| of.executes(&it.instance)).and_then(|of| declared.thread_of(of));
        let is_of_thread = it.field == ActivityField::Priority || PLACES.contains(&it.field);
        let own = own.filter(|_| is_of_thread);
        let mates = data.activities.iter().filter(|of| own.is_some() && declared.thread_of(of) == own);
        let mates = mates.flat_map(|of| &of.instances).filter(|of| of.name != it.instance);
        all.extend(mates.map(|of| WhatIfField { instance: of.name.clone(), ..it.clone() }));
        all.push(it.clone());
    }
    all
}

fn with_fields(data: &Deployment, declared: &DeclaredThreads, what_if: &[WhatIfField]) -> Deployment {
    let what_if = in_threads(data, declared, what_if);
    let mut data = data.clone();
    for WhatIfField { instance, field, value } in &what_if {
        for activity in data.activities.iter_mut().filter(|it| it.executes(instance)) {
            let activity = Arc::make_mut(activity);
            // An error in a value that is not in the text is reported at the activity.
            let id = activity.name.id;
            let is_integer = value.bytes().all(|byte| byte.is_ascii_digit());
            let literal =
                if is_integer { Literal::Int(value.clone()) } else { Literal::Float(value.clone()) };
            let value = Expr::Literal(literal, id);
            let name = NameRef { name: field.keyword().into(), id };
            let changed = Field { name, value, list: None, word: None, value_id: id };
            let says_it = |it: &&mut Field| same_fields(field).iter().any(|of| it.name.name == of.keyword());
            match activity.fields.iter_mut().find(says_it) {
                Some(known) => *known = Field { value_id: known.value_id, ..changed },
                None => activity.fields.push(changed),
            }
        }
    }
    data
}
