//! Resources of the machine that the process has used so far.
//!
//! Out: CPU time, memory, thread switches; nothing where the system does not report them. Never here: their use.

use cpu_time::{ProcessTime, ThreadTime};
use std::fs;
use std::time::Duration;

/// Bytes of a page of memory, on the systems that report pages.
const PAGE_BYTES: f64 = 4096.0;

/// CPU time of all threads but this one.
pub(crate) fn others_cpu() -> Duration {
    let all = ProcessTime::try_now().map(|t| t.as_duration()).unwrap_or_default();
    all.saturating_sub(own_cpu())
}

/// CPU time of this thread.
pub(crate) fn own_cpu() -> Duration {
    ThreadTime::try_now().map(|t| t.as_duration()).unwrap_or_default()
}

/// Memory that the process holds, bytes.
pub(crate) fn resident_bytes() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/statm").ok()?;
    Some(text.split_whitespace().nth(1)?.parse::<f64>().ok()? * PAGE_BYTES)
}

/// The processor's name, as the system reports it.
pub(crate) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named =
        text.lines().find_map(|line| Some(line.strip_prefix("model name")?.split_once(':')?.1.trim().to_owned()));
    named.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// Context switches of the live threads of the process so far, voluntary and involuntary.
pub(crate) fn switches() -> Option<f64> {
    let tasks = fs::read_dir("/proc/self/task").ok()?;
    // a thread may end while it is read
    let texts = tasks.filter_map(|task| fs::read_to_string(task.ok()?.path().join("status")).ok());
    Some(texts.map(|text| text.lines().filter_map(switch_line).sum::<f64>()).sum())
}

fn switch_line(line: &str) -> Option<f64> {
    let (name, count) = line.split_once(':')?;
    name.ends_with("ctxt_switches").then(|| count.trim().parse().ok())?
}
