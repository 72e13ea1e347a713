//! # may-be-overwritten
//!
//! A component may overwrite what it passed on before the reader has read it: with older data, or with a value that does not
//! come from its inputs. The connection keeps the last value only, so that the reader may never see the data.
//!
//! ```mauve
//! codel go(in n: int): int
//! shell Pilot { input port goal: int  output port speed: int }
//! shell Base { input port speed: int }
//! core PilotCore(Pilot) { var n: int = 0
//!   update = { if (read(goal, n) == new_data) then { write(speed, go(n)); } else { write(speed, 0); } }
//! }
//! core BaseCore(Base) { var n: int = 0  update = { read(speed, n); } }
//! component Guide(Pilot, PilotCore)
//! component Wheels(Base, BaseCore)
//! architecture Robot { instance guide: Guide  instance wheels: Wheels
//!   connection guide.speed -> wheels.speed   // hint
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity guide { priority = 2  period = 10 }
//!   activity wheels { priority = 1  period = 50 }
//! }
//! ```
//!
//! That is often intended: a robot without a goal does not move. A chain through such a component has a latency only while it does not
//! overwrite: see `while` in `[chains.NAME]`.

use super::*;
use mauve_hir::{Link, Overwrite};

pub(super) fn report<'db>(link: &Link<'db>, by: &Overwrite<'db>) -> Diagnostic<'db> {
    let (writer, port) = &link.source;
    let what = if by.is_older { "older data" } else { "a value that does not come from its inputs" };
    let message = format!(
        "`{writer}` may overwrite `{port}` before `{}` reads it: in state `{}`, it may write {what}",
        link.target.0, by.state
    );
    let found = Diagnostic::new(&MAY_BE_OVERWRITTEN, link.at.clone(), message);
    found.related(&Location::Source(by.core, by.at), "this write may overwrite it")
}
