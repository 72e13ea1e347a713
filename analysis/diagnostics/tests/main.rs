//! The tests of what is wrong with whole projects, and of the figures in them: one program, a module for each subject.
//!
//! | module | what it tests |
//! |---|---|
//! | [`activities`] | the fields of an activity in other ways: rates, lists of CPUs, triggers, lists of instances |
//! | [`chains`] | how long data takes through the components of a deployment, and why that may have no bound |
//! | [`conflicts`] | git's conflicts: one error each, and no figure of what they touch |
//! | [`damaged`] | damage for several of the tests: what is damaged, how, and the report of a failure |
//! | [`damage`] | one damaged token never makes a response time shorter |
//! | [`data_ages`] | how data passes through random cores, compared with an interpreter |
//! | [`each_fix`] | each fix removes its diagnostic and adds no error |
//! | [`exported`] | a task set that is written and read again gives the same report |
//! | [`fixes`] | what fixes write, and which are not offered |
//! | [`fuzz`] | the properties of `tests/fuzz`, on some thousand texts |
//! | [`interpreter`] | the cost of each edge, compared with an interpreter of random cores |
//! | [`losses`] | response times in damaged texts, by example |
//! | [`machines`] | the edges of state machines, and their costs |
//! | [`misspelt_keys`] | a misspelt key of a timing table never makes a response time shorter |
//! | [`mistakes`] | the one message of each mistake in `tests/mistakes` |
//! | [`mutations`] | random texts: no panic, no lost byte, and a location for each diagnostic |
//! | [`pages`] | the models on the pages of `mauve explain` |
//! | [`queries`] | which queries an edit executes |
//! | [`passages`] | how data passes through cores: periods, what overwrites it, and why it may never pass |
//! | [`products`] | state machines with values of variables, compared with an interpreter |
//! | [`releases`] | how often data releases activities, from what writes it |
//! | [`reparse`] | the database after an edit equals a new one |
//! | [`schemas`] | the JSON schemas, compared with the readers |
//! | [`random_locks`] | random models with locks: limits, what a refused activity delays, chains of ceilings |
//! | [`seeding`] | one mistake in a random model is one diagnostic at its location |
//! | [`sensitivity`] | the limits of times and periods, compared with the analysis |
//! | [`single_tokens`] | each deleted or duplicated token gives one message |
//! | [`size`] | models that are too large |
//! | [`spans`] | a damaged span never makes a figure lower that rests on an error |
//! | [`spec`] | the language reference in `tests/spec` |
//! | [`tables`] | the highlighters and the reference list the fields of an activity and the keys of TOML files |
//! | [`verdicts`] | which activities of a deployment are analysed |
//! | [`work`] | what an edit costs, without clocks |

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod activities;
mod chains;
mod common;
mod conflicts;
mod damage;
mod damaged;
mod data_ages;
mod each_fix;
mod exported;
mod fixes;
mod fuzz;
mod interpreter;
mod losses;
mod machines;
mod misspelt_keys;
mod mistakes;
mod mutations;
mod pages;
mod passages;
mod products;
mod queries;
mod random_locks;
mod releases;
mod reparse;
mod schemas;
mod seeding;
mod sensitivity;
mod single_tokens;
mod size;
mod spans;
mod spec;
mod tables;
mod threads;
mod verdicts;
mod work;
