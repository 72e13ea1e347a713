//! A deployment as it would be with other values in its activities, for whoever asks what that would give.
//!
//! The values are texts, put where the parser would have put them. So there is one way from a deployment to its response
//! times, whether it is written or supposed.

use mauve_hir::item_tree::{Deployment, Expr, Field, Literal, Name, NameRef};

/// A value that a field of an activity is supposed to have.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct SupposedField {
    /// The activity, by its instance; of a name that two have, both are meant.
    pub instance: Name,
    /// `affinity`, `priority`, `period` or `deadline`; where the activity has none, it is supposed to.
    pub field: &'static str,
    /// A number, as it would be written.
    pub value: Name,
}

/// `data` with these values.
pub(crate) fn with_fields(data: &Deployment, supposed: &[SupposedField]) -> Deployment {
    let mut data = data.clone();
    for SupposedField { instance, field, value } in supposed {
        let activities = data.activities.iter_mut().filter(|it| it.instance.name == *instance);
        for activity in activities {
            // What is wrong with a value that is not in the text is said at the activity.
            let id = activity.instance.id;
            let is_whole = value.bytes().all(|byte| byte.is_ascii_digit());
            let literal = if is_whole { Literal::Int(value.clone()) } else { Literal::Float(value.clone()) };
            let value = Expr::Literal(literal, id);
            match activity.fields.iter_mut().find(|it| it.name.name == *field) {
                Some(known) => known.value = value,
                None => {
                    let name = NameRef { name: (*field).into(), id };
                    activity.fields.push(Field { name, value, value_id: id });
                }
            }
        }
    }
    data
}
