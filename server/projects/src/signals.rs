//! Signals that end a command, which ends first what it has begun: Ctrl-C, `kill`, and the end of a terminal.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use futures::future::select_all;
use tokio::signal::unix::{SignalKind, signal};

/// Sets `stop` when the user ends the command.
pub fn stop_on_signal(stop: Arc<AtomicBool>) -> Result<(), String> {
    on_signal(move || stop.store(true, Ordering::Relaxed))
}

/// Calls `act` when the user ends the command. From here on, these signals do not end the process. One that is ignored, as by `nohup`,
/// stays so.
pub fn on_signal(act: impl FnOnce() + Send + 'static) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot wait for signals: {error}");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().map_err(failed)?;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    let kinds = [SignalKind::terminate(), SignalKind::interrupt(), SignalKind::hangup()];
    let obeyed = kinds.into_iter().filter(|kind| ignored >> (kind.as_raw_value() - 1) & 1 == 0);
    let entered = runtime.enter();
    let mut signals = obeyed.map(signal).collect::<Result<Vec<_>, _>>().map_err(failed)?;
    drop(entered);
    if signals.is_empty() {
        return Ok(());
    }
    std::thread::spawn(move || {
        let all = signals.iter_mut().map(|signal| Box::pin(signal.recv()));
        runtime.block_on(select_all(all));
        act();
    });
    Ok(())
}
