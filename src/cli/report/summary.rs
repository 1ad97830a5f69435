//! The report as a table for people.

use super::{AgentReport, Report};
use std::fmt::Write;

impl Report {
    /// A dozen lines that say how the run went.
    #[must_use]
    pub fn summary_text(&self) -> String {
        let mut out = String::new();
        let Self { scene, policy, executor, frames, sim_s, wall_s, cpu_s, target_ms, summary, .. } = self;
        let _ =
            writeln!(out, "{scene}: {frames} frames, {sim_s:.2} s simulated in {wall_s:.2} s ({executor}, {policy})");
        let work = &summary.frame_ms;
        let _ = writeln!(
            out,
            "frame  {:.2} ms mean, {:.2} p99, {:.2} max, target {target_ms:.2}; {:.2} % late",
            work.mean,
            work.p99,
            work.max,
            summary.missed_share * 100.0
        );
        let adapter = self.adapter.as_deref().unwrap_or("nothing was drawn");
        let _ = writeln!(out, "drawn by  {adapter}; agents' CPU {cpu_s:.2} s; state {}", self.state_hash);
        if let Some(clamped) = &self.budget.clamped {
            let _ = writeln!(out, "note  {clamped}");
        }
        let _ = writeln!(
            out,
            "\n{:<20} {:<10} {:>9} {:>9} {:>8} {:>9} {:>8} {:>9} {:>10}",
            "agent", "model", "rate Hz", "wanted", "dt ms", "ε mm", "cpu s", "age ms", "dropped ms"
        );
        self.agents.iter().for_each(|agent| agent_row(&mut out, agent));
        out
    }
}

fn agent_row(out: &mut String, agent: &AgentReport) {
    let eps = agent.eps_m.map_or_else(|| "-".to_owned(), |eps| format!("{:.2}", eps * 1e3));
    let _ = write!(
        out,
        "{:<20} {:<10} {:>9.1} {:>9.1} {:>8.2} {:>9} {:>8.3} {:>9.2} {:>10.1}",
        agent.name,
        agent.model,
        agent.rate_hz,
        agent.wanted_hz,
        agent.dt_ms,
        eps,
        agent.cpu_s,
        agent.age_ms.p50,
        agent.dropped_ms
    );
    let reason = agent.parked_reason.as_deref().unwrap_or("parked");
    let _ = if agent.parked { writeln!(out, "  {reason}") } else { writeln!(out) };
}
