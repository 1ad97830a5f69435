//! What the process has used of the machine so far.
//!
//! Out: CPU time, memory, switches of threads; nothing where the system does not tell. Never here: what was done with it.

use cpu_time::{ProcessTime, ThreadTime};
use std::fs;
use std::time::Duration;

/// Bytes of a page of memory, on the systems that tell of pages.
const PAGE_BYTES: f64 = 4096.0;

/// CPU time of all threads but this one.
pub(super) fn others_cpu() -> Duration {
    let all = ProcessTime::try_now().map(|t| t.as_duration()).unwrap_or_default();
    all.saturating_sub(own_cpu())
}

/// CPU time of this thread.
pub(super) fn own_cpu() -> Duration {
    ThreadTime::try_now().map(|t| t.as_duration()).unwrap_or_default()
}

/// Memory that the process holds, bytes.
pub(super) fn resident_bytes() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/statm").ok()?;
    Some(text.split_whitespace().nth(1)?.parse::<f64>().ok()? * PAGE_BYTES)
}

/// How often threads of the process have gone to sleep or were sent away, so far, by those that live.
pub(super) fn switches() -> Option<f64> {
    let tasks = fs::read_dir("/proc/self/task").ok()?;
    // a thread may end while it is read
    let texts = tasks.filter_map(|task| fs::read_to_string(task.ok()?.path().join("status")).ok());
    Some(texts.map(|text| text.lines().filter_map(switch_line).sum::<f64>()).sum())
}

fn switch_line(line: &str) -> Option<f64> {
    let (name, count) = line.split_once(':')?;
    name.ends_with("ctxt_switches").then(|| count.trim().parse().ok())?
}
