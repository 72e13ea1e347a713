//! The tests of estimates: one program.
//!
//! | module | what it tests |
//! |---|---|
//! | [`coverage`] | how often upper bounds are above the true quantiles |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod coverage;
