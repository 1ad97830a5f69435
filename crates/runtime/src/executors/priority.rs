//! Scheduling priority of the threads that make turns.
//!
//! In: the scene's request. Out: threads with this priority, or the reason for a refusal. Never here: which agent is next.

/// How the system's scheduler ranks the threads of agents: real-time is first in, first out (POSIX `SCHED_FIFO`), at the lowest priority of
/// that kind.
pub use metachron_core::kinds::PriorityKind as Priority;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// The system does not grant real-time priority.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the system grants no real-time priority ({why}): agents run at ordinary priority; on Linux real-time priority needs root, CAP_SYS_NICE or \
     an `rtprio` limit above zero (`ulimit -r`)"
)]
pub struct PriorityRefused {
    why: String,
}

/// Sets the priority of this thread: for threads of a caller that have to be as steady as agents' threads. After a
/// refusal it has its previous one.
///
/// # Errors
/// [`PriorityRefused`].
pub fn take_priority(priority: Priority) -> Result<(), PriorityRefused> {
    if priority == Priority::Normal {
        return Ok(());
    }
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy)
        .map_err(|error| PriorityRefused { why: error.to_string() })
}

/// Whether the system grants a priority; tested on a separate thread, without effect on others.
///
/// # Errors
/// [`PriorityRefused`].
pub fn ask_priority(priority: Priority) -> Result<(), PriorityRefused> {
    let asked = std::thread::Builder::new().name("priority".to_owned()).spawn(move || take_priority(priority));
    let refused = |why: String| PriorityRefused { why };
    let answer = asked.map_err(|error| refused(error.to_string()))?.join();
    answer.unwrap_or_else(|_| Err(refused("the test thread ended without a result".to_owned())))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Dummy, eventually, running, system};
    use super::*;
    use crate::{Pool, Run, Threads};

    /// The scheduling class of each thread of this process whose name begins with `prefix`: 0 ordinary, 1 first in, first out.
    fn classes(prefix: &str) -> Vec<u32> {
        let tasks = std::fs::read_dir("/proc/self/task").unwrap().filter_map(|task| {
            let path = task.ok()?.path();
            let name = std::fs::read_to_string(path.join("comm")).ok()?;
            let stat = std::fs::read_to_string(path.join("stat")).ok()?;
            let numbers = stat.rsplit_once(')')?.1.split_whitespace().collect::<Vec<_>>();
            // proc(5): field 41, counted from the third
            name.starts_with(prefix).then(|| numbers[38].parse().ok())?
        });
        tasks.collect()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn realtime_is_what_threads_have_where_it_is_granted_and_agents_run_either_way() {
        let granted = ask_priority(Priority::Realtime);
        if let Err(refused) = &granted {
            assert!(refused.to_string().contains("CAP_SYS_NICE"), "{refused}");
        }
        let class = u32::from(granted.is_ok());
        for (prefix, pooled) in [("agent:real", false), ("pool:", true)] {
            let spawn = || crate::AgentSpawn { name: "real".to_owned(), ..Dummy::new(1.0).at(100.0) };
            let run: Box<dyn Run> = if pooled {
                running(Pool::start(vec![spawn()], system(), Priority::Realtime).unwrap())
            } else {
                running(Threads::start(vec![spawn()], system(), Priority::Realtime).unwrap())
            };
            eventually("it steps", || run.agents()[0].steps() >= 3);
            // other tests run pools of ordinary priority meanwhile
            let found = classes(prefix);
            assert!(found.contains(&class), "{prefix} {found:?}");
            run.shutdown();
        }
        assert_eq!(ask_priority(Priority::Normal), Ok(()));
    }
}
