//! Measured execution times → probabilistic worst-case execution times.
//!
//! This crate reads recorded traces and estimates the tails of execution times. It must never know MAUVE's syntax, salsa, timing
//! tables or prose: codels and programs are texts here, and what is wrong with a measurement is a value that others say in words.
//! Times are integer nanoseconds; floating point is for the statistics only.
