//! # missing-activity
//!
//! Every instance of the deployed architecture needs an activity, which gives its period, priority and CPU. Without it,
//! no activity that the instance may delay is analysed.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {   // error
//!   architecture A
//!   activity front { priority = 1 period = 10 }
//! }
//! ```
//!
//! Fix: add an activity on the CPU with the lowest utilisation, with the lowest free priority there and the period of the
//! connected instances. The values are a start: change them.

use super::*;
use mauve_wcrt::missing_activities;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    of: Decl<'db>,
    instance: &str,
) -> Diagnostic<'db> {
    let deployment = of.name(db);
    let message = format!("instance `{instance}` has no activity in {deployment}: write `activity {instance} {{ … }}`");
    let diagnostic = Diagnostic::new(&MISSING_ACTIVITY, at, message);
    let Some(new) = missing_activities(db, project, of).iter().find(|it| it.instance == instance) else {
        return diagnostic;
    };
    let fields: Vec<String> =
        new.fields().iter().map(|(field, value)| format!("{} = {value}", field.keyword())).collect();
    let activity = format!("activity {instance} {{ {} }}", fields.join(" "));
    diagnostic.add_item(db, of, format!("Add an activity for `{instance}`"), &activity)
}
