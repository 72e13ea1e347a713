//! # unused-jitter
//!
//! A background activity has a release jitter. The analysis ignores it: a background activity runs when no real-time activity
//! does, and has no response time.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Log(S, C)
//! architecture A { instance log: Log }
//! deployment D {
//!   architecture A
//!   activity log { priority = background  jitter = 0.5 }   // warning
//! }
//! ```
//!
//! Fix: remove the jitter. If the activity is real-time, give it a priority from 1 to 99 and a period.
