//! The trace event format, which <https://ui.perfetto.dev> and `chrome://tracing` open: metadata of threads, and events as text.
//! Times are in microseconds with three decimals, so that they are exact.

use std::fmt::Write as _;

use serde_json::{Value, json};

/// The name of a thread, and its place among those of its process: lesser orders are above.
pub(crate) fn thread(pid: u32, tid: usize, name: &str, order: i64) -> [String; 2] {
    let named = json!({ "ph": "M", "name": "thread_name", "pid": pid, "tid": tid, "args": { "name": name } });
    let args = json!({ "sort_index": order });
    let placed = json!({ "ph": "M", "name": "thread_sort_index", "pid": pid, "tid": tid, "args": args });
    [line(&[], &named), line(&[], &placed)]
}

/// The name of a process, and its place.
pub(crate) fn process(pid: u32, name: &str) -> [String; 2] {
    let named = json!({ "ph": "M", "name": "process_name", "pid": pid, "args": { "name": name } });
    let args = json!({ "sort_index": pid });
    let placed = json!({ "ph": "M", "name": "process_sort_index", "pid": pid, "args": args });
    [line(&[], &named), line(&[], &placed)]
}

/// An arrow from one slice to another. Each has its process, its thread, and an instant in it; `id` is the number of the arrow.
pub(crate) fn arrow(id: u64, name: &str, [from, to]: [(u32, usize, i64); 2]) -> [String; 2] {
    let end = |phase: &str, (pid, tid, at): (u32, usize, i64)| {
        // It is bound to the slice around the instant.
        let event =
            json!({ "ph": phase, "bp": "e", "id": id, "name": name, "cat": "data", "pid": pid, "tid": tid });
        line(&[("ts", at)], &event)
    };
    [end("s", from), end("f", to)]
}

/// Returns an event as text. The times are in nanoseconds.
pub(crate) fn line(times: &[(&str, i64)], event: &Value) -> String {
    let mut out = String::from("{");
    for (key, time) in times {
        let (sign, nanos) = (if *time < 0 { "-" } else { "" }, time.unsigned_abs());
        let _ = write!(out, "\"{key}\":{sign}{}.{:03},", nanos / 1000, nanos % 1000);
    }
    let event = event.to_string();
    out + event.strip_prefix('{').unwrap_or(&event)
}
