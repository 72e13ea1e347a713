//! # unused-deadline
//!
//! A background activity has a deadline. The analysis ignores it: a background activity runs when no real-time activity does,
//! and has no response time.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Log(S, C)
//! architecture A { instance log: Log }
//! deployment D {
//!   architecture A
//!   activity log { priority = background  deadline = 50 }   // warning
//! }
//! ```
//!
//! Fix: remove the deadline. If the deadline must be met, give the activity a priority from 1 to 99 and a period.
