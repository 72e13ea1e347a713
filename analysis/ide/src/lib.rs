//! What an editor or a terminal shows of a model, in plain data: no feature knows who shows it.
//!
//! | file | shows |
//! |---|---|
//! | `explanation.rs` | where a response time comes from, in words |
//! | `state_machine.rs` | a component's periodic state machine, as DOT and as SVG |
//!
//! This crate knows no protocol and no terminal.

mod explanation;
mod state_machine;

pub use explanation::explain_response;
pub use state_machine::{Drawing, draw_state_machine};
