//! The names that a report has.

use super::*;

/// Names that other programs read.
const NAMES: &[&str] = &[
    "/scene",
    "/policy",
    "/executor",
    "/pace",
    "/adapter",
    "/frames",
    "/sim_s",
    "/wall_s",
    "/start_up_s",
    "/cpu_s",
    "/state_hash",
    "/target_ms",
    "/frame_ms/mean",
    "/frame_ms/stddev",
    "/frame_ms/min",
    "/frame_ms/p50",
    "/frame_ms/p95",
    "/frame_ms/p99",
    "/frame_ms/max",
    "/interval_ms/p99",
    "/binding_stddev",
    "/avg_err",
    "/missed_share",
    "/settle_frames",
    "/agents/0/name",
    "/agents/0/model",
    "/agents/0/steps",
    "/agents/0/rate_hz",
    "/agents/0/wanted_hz",
    "/agents/0/dt_ms",
    "/agents/0/eps_m",
    "/agents/0/nodes",
    "/agents/0/n",
    "/agents/0/cpu_s",
    "/agents/0/age_ms/p50",
    "/agents/0/age_ms/p99",
    "/agents/0/lived_s",
    "/agents/0/given_up_s",
    "/agents/0/lengthened",
    "/agents/0/dropped_ms",
    "/agents/0/parked",
    "/agents/0/energy_j",
    "/agents/0/residual_m",
    "/clusters/0/id",
    "/clusters/0/members/0",
    "/clusters/0/h_ms",
    "/clusters/0/slack",
    "/clusters/0/steps/0",
    "/clusters/0/contacts",
    "/clusters/0/factors",
    "/clusters/0/products",
    "/clusters/0/unfinished",
    "/clusters/0/level",
    "/clusters/0/miss_m_s",
    "/clusters/0/depth_m",
    "/clusters/0/depth_wanted_m",
    "/couplings/0/a",
    "/couplings/0/b",
    "/couplings/0/kind",
    "/couplings/0/contacts",
    "/couplings/0/force_n",
    "/couplings/0/momentum_error",
    "/couplings/0/inverse_mass_per_kg",
    "/couplings/0/penetration_m",
    "/events/0/at_s",
    "/devices/0/object",
    "/devices/0/realtime",
    "/devices/0/late_ms/p99",
    "/devices/0/age_steps/max",
    "/devices/0/force_max_n",
    "/devices/0/energy_out_j",
    "/devices/0/tank_j",
    "/events/0/kind",
    "/events/0/attachment",
    "/events/0/a",
    "/events/0/b",
    "/events/0/force_n",
    "/sensors/0/a",
    "/sensors/0/b",
    "/sensors/0/touching",
    "/sensors/0/begins",
    "/sensors/0/ends",
    "/sensors/0/changed_s",
    "/readings/0/name",
    "/readings/0/kind",
    "/readings/0/at_s",
    "/readings/0/values/0",
    "/notes/0",
    "/parked",
    "/overlaps/0/depth_m",
    "/moved/0/by_m",
    "/oracle/dt_ms",
    "/oracle/sim_s",
    "/oracle/sensitivity_m",
    "/oracle/couplings/0/position_rms_m",
    "/agents/0/led_by",
    "/budget/spent_share",
    "/probes/0/object",
    "/probes/0/at",
    "/probes/0/position_m",
    "/probes/0/velocity_m_s",
];

#[test]
fn the_report_has_the_names_of_the_design() {
    let json = serde_json::to_value(Report::template()).unwrap();
    for path in NAMES {
        assert!(json.pointer(path).is_some(), "{path} is missing");
    }
}

#[test]
fn the_report_includes_the_choice_summary() {
    let json = serde_json::to_value(Report::template()).unwrap();
    for path in [
        "/budget/value_over_bound",
        "/budget/certificate",
        "/budget/reversals",
        "/budget/level_changes",
        "/budget/model_error",
        "/budget/select_ms/mean",
        "/budget/select_ms/max",
        "/budget/cull_ms/mean",
        "/budget/draw_ms/mean",
        "/budget/lag_ms/p99",
        "/budget/lag_ms/max",
        "/budget/holes",
        "/budget/potentially_visible",
        "/budget/visible",
        "/budget/drawn",
        "/budget/render_scale/end",
        "/budget/render_scale/mean",
        "/budget/render_scale/least",
        "/budget/primitives/triangles",
        "/budget/primitives/points",
        "/budget/primitives/lines",
        "/budget/shadings/flat",
        "/budget/shadings/shadowed",
    ] {
        assert!(json.pointer(path).is_some(), "{path} is missing");
    }
}

#[test]
fn the_first_line_says_who_has_given_up_time_and_how_many_steps_were_longer() {
    let on_time = AgentReport { dt_ms: 4.0, lived_s: 0.998, given_up_s: 0.004, steps: 250, ..AgentReport::default() };
    let late = AgentReport {
        name: "late".to_owned(),
        lived_s: 0.25,
        given_up_s: 0.75,
        steps: 30,
        lengthened: 20,
        ..on_time.clone()
    };
    let first_line = |agents| {
        let report = Report { agents, ..Report::template() };
        report.summary_text().lines().next().unwrap_or_default().to_owned()
    };
    let whole = first_line(vec![on_time.clone()]);
    assert!(whole.ends_with(')'), "{whole}");
    let line = first_line(vec![on_time, late]);
    let said = "; 1 of 2 agents gave up time, most of all late: 0.750 s, it lived 0.250 s; 20 of 280 steps were longer than asked for";
    assert_eq!(line, format!("{whole}{said}"));
}
