//! The command line.

mod acceptance;
mod bad_input;
mod builds;
mod certificates;
mod chain_drawings;
mod chains;
mod clocks;
mod command_line;
mod deployment_tables;
mod diff;
mod editor;
mod figures;
mod first_steps;
mod fixes;
mod graph;
mod hostile;

mod many_cpus;
mod marks;
mod probability;
mod pwcet;
mod release;
mod report;
mod robot;
mod samples;
mod schemas;
mod sensitivity;
mod simulate;
mod standard_input;
mod task_sets;
mod trace_check;
mod trace_import;
mod tune;
mod waits_and_locks;
mod what_if;
mod widths;
