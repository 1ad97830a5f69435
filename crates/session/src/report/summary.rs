//! The report as a table for people.

use super::{
    AgentReport, ChoiceSummary, CouplingReport, EventReport, FrameSummary, HostReport, ReferenceReport, Report,
    ScaleSummary, SensorReport, Statistics,
};
use metachron_devices::DeviceReport;
use std::fmt::Write;

impl Report {
    /// A dozen lines that say how the run went.
    #[must_use]
    pub fn summary_text(&self) -> String {
        let mut out = String::new();
        let Self { scene, policy, executor, frames, sim_s, wall_s, cpu_s, target_ms, summary, .. } = self;
        let pace = if self.pace == "free" { " at the free pace" } else { "" };
        let _ = write!(
            out,
            "{scene}: {frames} frames, {sim_s:.2} s simulated in {wall_s:.2} s ({executor}{pace}, {policy})"
        );
        given_up(&mut out, &self.agents);
        let _ = writeln!(out);
        frame_line(&mut out, summary, *target_ms);
        let drawn = self.adapter.as_ref().map_or("not drawn".to_owned(), |adapter| format!("drawn by  {adapter}"));
        let _ = writeln!(out, "{drawn}; agents' CPU {cpu_s:.2} s; state {}", self.state_hash);
        choices_line(&mut out, &self.budget.choices);
        if let Some(clamped) = &self.budget.clamped {
            let _ = writeln!(out, "note  {clamped}");
        }
        let _ = writeln!(
            out,
            "\n{:<20} {:<10} {:>9} {:>9} {:>8} {:>9} {:>9} {:>8} {:>9} {:>10}",
            "agent", "model", "rate Hz", "wanted", "dt ms", "ε mm", "error mm", "cpu s", "age ms", "dropped ms"
        );
        self.agents.iter().for_each(|agent| agent_row(&mut out, agent));
        self.agents.iter().for_each(|agent| out_of_reach(&mut out, agent));
        coupling_table(&mut out, &self.couplings);
        event_lines(&mut out, &self.events);
        sensor_lines(&mut out, &self.sensors);
        self.devices.iter().for_each(|device| device_line(&mut out, device));
        self.hosts.iter().for_each(|host| host_line(&mut out, host));
        if let Some(oracle) = &self.oracle {
            reference_table(&mut out, oracle);
        }
        out
    }
}

/// How much time agents have not lived, and how many steps were longer than asked for, where there is any: the rest of the first line.
fn given_up(out: &mut String, agents: &[AgentReport]) {
    // one that is on time may be in the middle of a step
    let is_short = |agent: &&AgentReport| agent.given_up_s > 2e-3 * agent.dt_ms;
    let most = agents.iter().filter(is_short).max_by(|a, b| a.given_up_s.total_cmp(&b.given_up_s));
    if let Some(most) = most {
        let (count, all) = (agents.iter().filter(is_short).count(), agents.len());
        let (lived_s, given_up_s) = (most.lived_s, most.given_up_s);
        let _ = write!(out, "; {count} of {all} agents gave up time, most of all {}: {given_up_s:.3} s", most.name);
        let _ = write!(out, ", it lived {lived_s:.3} s");
    }
    let sum = |of: fn(&AgentReport) -> u64| agents.iter().map(of).sum::<u64>();
    let (longer, steps) = (sum(|agent| agent.lengthened), sum(|agent| agent.steps));
    if longer > 0 {
        let _ = write!(out, "; {longer} of {steps} steps were longer than asked for");
    }
}

fn frame_line(out: &mut String, summary: &FrameSummary, target_ms: f64) {
    let (Some(work), Some(missed)) = (&summary.frame_ms, summary.missed_share) else {
        let _ = writeln!(out, "frame  not measured: nothing was drawn and no drawing cost is declared");
        return;
    };
    let Statistics { mean, p99, max, .. } = work;
    let late = 100.0 * missed;
    let _ =
        writeln!(out, "frame  {mean:.2} ms mean, {p99:.2} p99, {max:.2} max, target {target_ms:.2}; {late:.2} % late");
}

fn choices_line(out: &mut String, choices: &ChoiceSummary) {
    let ChoiceSummary { level_changes, reversals, cull_ms, select_ms, draw_ms, .. } = choices;
    let (Some(cull), Some(select)) = (cull_ms, select_ms) else { return };
    let _ = write!(out, "cull {:.2} ms, select {:.3}", cull.mean, select.mean);
    if let Some(draw) = draw_ms {
        let _ = write!(out, ", draw {:.2}", draw.mean);
    }
    if let (Some(change), Some(back)) = (level_changes, reversals) {
        let _ = write!(out, "; {:.2} % of levels change, {:.2} % back", 100.0 * change, 100.0 * back);
    }
    if let Some(error) = choices.model_error {
        let _ = write!(out, "; predictions {}", error_text(error));
    }
    if let Some(ScaleSummary { mean, least, .. }) = choices.render_scale.filter(|scale| scale.least < 1.0) {
        let _ = write!(out, "; drawn at {:.0} % of its size, at least {:.0} %", 100.0 * mean, 100.0 * least);
    }
    if let Some(gap) = choices.certificate {
        let _ = write!(out, "; within {:.2} % of the best", 100.0 * gap);
    }
    let _ = writeln!(out);
}

/// The error of predictions in 19 of 20 frames, relative to the predicted time, as text.
fn error_text(error: f64) -> String {
    if error < 1.0 {
        format!("off by less than {:.1} % (19 of 20 frames)", 100.0 * error)
    } else {
        format!("unusable: off by up to {error:.1} times the frame's time (19 of 20 frames)")
    }
}

fn agent_row(out: &mut String, agent: &AgentReport) {
    let eps = agent.eps_m.map_or_else(|| "-".to_owned(), |eps| format!("{:.2}", eps * 1e3));
    let _ = write!(
        out,
        "{:<20} {:<10} {:>9.1} {:>9.1} {:>8.2} {:>9} {:>9.4} {:>8.3} {:>9.2} {:>10.1}",
        agent.name,
        agent.model,
        agent.rate_hz,
        agent.wanted_hz,
        agent.dt_ms,
        eps,
        agent.residual_m * 1e3,
        agent.cpu_s,
        agent.age_ms.p50,
        agent.dropped_ms
    );
    let reason = agent.parked_reason.as_deref().unwrap_or("parked");
    let _ = if agent.parked { writeln!(out, "  {reason}") } else { writeln!(out) };
}

/// Notes where an agent cannot hold its error tolerance.
fn out_of_reach(out: &mut String, agent: &AgentReport) {
    let AgentReport { name, residual_m, dt_ms, eps_m, .. } = agent;
    let (Some(tolerance_m), Some("finest")) = (agent.tolerance_m, agent.rests) else { return };
    let eps = eps_m.map_or_else(String::new, |eps_m| format!(" and an ε of {:.2} mm", eps_m * 1e3));
    let _ = writeln!(
        out,
        "note  `{name}` cannot meet its tolerance of {:.4} mm: at steps of {dt_ms:.2} ms{eps}, the finest of its ranges, its error is {:.4} mm",
        tolerance_m * 1e3,
        residual_m * 1e3
    );
}

/// The forces that a device has felt, and how steadily it was served.
fn device_line(out: &mut String, report: &DeviceReport) {
    let DeviceReport { device, object, ticks, late_ms, age_steps, force_mean_n, force_max_n, .. } = report;
    let _ = writeln!(
        out,
        "device {device} · {object}: {ticks} ticks, late by {:.3} ms p50, {:.3} p99; state {:.2} steps old p99, {:.2} max; {force_mean_n:.3} N mean, {force_max_n:.3} max; {:.4} J of {:.4} given out",
        late_ms.p50, late_ms.p99, age_steps.p99, age_steps.max, report.energy_out_j, report.tank_j
    );
    if !report.realtime {
        let _ = writeln!(
            out,
            "note  the system gives the device's thread no real-time priority: what else runs makes its ticks late"
        );
    }
    if let Some(why) = &report.first_failure {
        let _ = writeln!(out, "note  the device failed {} times, first: {why}", report.failures);
    }
}

fn host_line(out: &mut String, HostReport { name, agents, cpu_s, link_ms, moved, reborn, lost }: &HostReport) {
    let _ = writeln!(
        out,
        "host {name}: {agents} agents at the end, {cpu_s:.2} CPU s, link {link_ms:.2} ms; {moved} came to it, {reborn} of them from hosts that were lost"
    );
    if let Some(why) = lost {
        let _ = writeln!(out, "note  host {name} was lost: {why}");
    }
}

/// More couplings or events than this are counted, not shown: the report has them all.
const ROWS_SHOWN: usize = 20;

fn coupling_table(out: &mut String, couplings: &[CouplingReport]) {
    if couplings.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "\n{:<41} {:<8} {:>8} {:>10} {:>10} {:>11} {:>11}",
        "coupling", "kind", "contacts", "force N", "greatest", "overlap mm", "momentum %"
    );
    for c in couplings.iter().take(ROWS_SHOWN) {
        let pair = format!("{} · {}", c.a, c.b);
        let error = c.momentum_error.map_or_else(|| "-".to_owned(), |error| format!("{:.4}", error * 100.0));
        let _ = writeln!(
            out,
            "{pair:<41} {:<8} {:>8} {:>10.3} {:>10.3} {:>11.4} {error:>11}",
            c.kind,
            c.contacts,
            c.force_n,
            c.force_max_n,
            c.penetration_m * 1e3
        );
    }
    omitted_rows(out, couplings.len());
}

fn event_lines(out: &mut String, events: &[EventReport]) {
    for EventReport { at_s, kind, attachment, a, b, force_n } in events.iter().take(ROWS_SHOWN) {
        let _ = writeln!(out, "note  `{attachment}` of `{a}` and `{b}` {kind} at {at_s:.4} s: {force_n:.3} N");
    }
    omitted_rows(out, events.len());
}

fn sensor_lines(out: &mut String, sensors: &[SensorReport]) {
    for SensorReport { a, b, touching, begins, ends, changed_s } in sensors.iter().take(ROWS_SHOWN) {
        let now = if *touching { "touching since" } else { "apart since" };
        let _ = writeln!(
            out,
            "note  `{a}` and `{b}` began to touch {begins} and ceased {ends} times, {now} {changed_s:.4} s"
        );
    }
    omitted_rows(out, sensors.len());
}

fn reference_table(out: &mut String, oracle: &ReferenceReport) {
    let ReferenceReport { dt_ms, sim_s, states, sensitivity_m, .. } = oracle;
    let _ = writeln!(out, "\nagainst one common clock of {dt_ms:.4} ms over {sim_s:.2} s, {states} points compared");
    let _ = writeln!(out, "every start moved by 1 µm: {:.4} mm apart at most", sensitivity_m * 1e3);
    let _ = writeln!(
        out,
        "{:<41} {:>11} {:>11} {:>13} {:>12} {:>12}",
        "coupling", "rms mm", "greatest mm", "momentum N·s", "impulse N·s", "common N·s"
    );
    let shown = |impulse: f64| format!("{impulse:.5}");
    for c in oracle.couplings.iter().take(ROWS_SHOWN) {
        let pair = format!("{} · {}", c.a, c.b);
        let _ = writeln!(
            out,
            "{pair:<41} {:>11.4} {:>11.4} {:>13.6} {:>12} {:>12}",
            c.position_rms_m * 1e3,
            c.position_max_m * 1e3,
            c.momentum_max_n_s,
            shown(c.impulse_n_s),
            shown(c.impulse_oracle_n_s)
        );
    }
    omitted_rows(out, oracle.couplings.len());
}

fn omitted_rows(out: &mut String, count: usize) {
    if count > ROWS_SHOWN {
        let _ = writeln!(out, "and {} more in the report", count - ROWS_SHOWN);
    }
}
