//! A device that is served by a thread of its own.
//!
//! In: a loop. Out: its report, at any time and at the end. Never here: the phases of a tick.

use super::device_loop::DeviceLoop;
use super::report::DeviceReport;
use metachron_runtime::{Priority, take_priority};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the report is handed out.
const REPORTS: Duration = Duration::from_millis(100);

/// A device that is served until this is dropped.
#[derive(Debug)]
pub struct Served {
    stop: Arc<AtomicBool>,
    report: Arc<Mutex<DeviceReport>>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    /// Serves a device on a thread of its own, which has real-time priority where the system grants it: it works for some microseconds of each
    /// period. A tick that comes late by more than a period is not made up.
    ///
    /// # Errors
    /// Where the system has no thread left.
    pub fn start(device_loop: DeviceLoop) -> std::io::Result<Self> {
        let (stop, report) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(device_loop.report())));
        let (stopped, handed_out) = (Arc::clone(&stop), Arc::clone(&report));
        let name = format!("device {}", device_loop.report().object);
        let thread = std::thread::Builder::new().name(name).spawn(move || serve(device_loop, &stopped, &handed_out))?;
        Ok(Self { stop, report, thread: Some(thread) })
    }

    /// The report so far; at most a tenth of a second old.
    #[must_use]
    pub fn report(&self) -> DeviceReport {
        self.report.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Ends it, and returns the report.
    #[must_use]
    pub fn stop(mut self) -> DeviceReport {
        self.end();
        self.report()
    }

    fn end(&mut self) {
        self.stop.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            // a panic is a driver's: the last report stands
            let _ = thread.join();
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.end();
    }
}

fn serve(mut device_loop: DeviceLoop, stop: &AtomicBool, report: &Mutex<DeviceReport>) {
    let period = device_loop.period();
    let realtime = take_priority(Priority::Realtime).is_ok();
    let hand_out = |device_loop: &DeviceLoop| {
        *report.lock().unwrap_or_else(PoisonError::into_inner) = DeviceReport { realtime, ..device_loop.report() };
    };
    let mut due = Instant::now() + period;
    let (mut before, mut reported) = (Instant::now(), Instant::now());
    while !stop.load(Relaxed) {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let now = Instant::now();
        device_loop.tick(now - before, now - due);
        before = now;
        due = if now > due + period { now + period } else { due + period };
        if now - reported > REPORTS {
            reported = now;
            hand_out(&device_loop);
        }
    }
    hand_out(&device_loop);
}
