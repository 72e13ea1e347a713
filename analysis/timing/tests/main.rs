//! The tests of the analysis against others of its kind: one program, a module for each oracle.
//!
//! | module | what it tests |
//! |---|---|
//! | [`certificates`] | an independent checker accepts certificates, and no false ones |
//! | [`chains`] | the ages of data in every schedule of small systems |
//! | [`late_jobs`] | late jobs in every choice of an opponent, simulated, and counted |
//! | [`lateness`] | missions in which executions take longer now and then |
//! | [`literature`] | equality with `response-time-analysis` |
//! | [`public_sets`] | published task sets: never longer |
//! | [`published`] | how the paper computes its Table 3 |
//! | [`reachability`] | every schedule of small systems |
//! | [`robot`] | every figure of the paper |
//! | [`simulation`] | random schedules of larger systems |
//! | [`stamps`] | stamped data in random schedules |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod certificates;
mod chains;
mod late_jobs;
mod lateness;
mod literature;
mod public_sets;
mod published;
mod reachability;
mod robot;
mod simulation;
mod stamps;
