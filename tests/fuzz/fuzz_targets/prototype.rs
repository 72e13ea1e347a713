#![no_main]

#[path = "../packages.rs"]
#[allow(dead_code, reason = "each target uses one of them")]
mod packages;

libfuzzer_sys::fuzz_target!(|text: &str| packages::prototype(text));
