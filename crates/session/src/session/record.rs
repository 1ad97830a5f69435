//! Recording of frames, and of the points that a scene probes.
//!
//! In: a session after a frame. Out: a [`FrameRecord`], [`ProbeOutcome`]s. Never here: a choice, the use of the records.

use super::super::outcome::{FrameRecord, ProbeOutcome};
use super::{Chosen, Finished, Session};
use metachron_lod::control::{Shading, Tally};
use metachron_runtime::Agents;
use metachron_world::{Probe, Scene};
use std::time::Duration;

impl Session {
    pub(super) fn record(&self, started: Duration, finished: Finished) -> FrameRecord {
        let Chosen { sim, triangles, more_triangles, objects, cull, select, select_next, build, n, .. } = self.chosen;
        let Chosen { potentially_visible, drawn, .. } = self.chosen;
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let plan = self.control.last_plan();
        let promise = plan.promise;
        let Tally { strokes, shadings, .. } = Tally::of(&self.views, &plan.levels);
        let ([points, lines], [flat, gouraud, per_pixel, textured, shadowed]) = (strokes, shadings);
        let frame_ms = ms(finished.work);
        let interval = self.last_start.map_or(self.period(), |last| started.saturating_sub(last));
        FrameRecord {
            frame: self.frames(),
            sim_s: sim.as_secs_f64(),
            frame_ms,
            gpu_ms: finished.gpu.map(ms),
            interval_ms: ms(interval),
            full_ms: frame_ms + more_triangles * self.control.prices().of(Shading::PerPixel).polygon * 1e3,
            triangles,
            objects,
            potentially_visible,
            drawn,
            cull_ms: ms(cull),
            select_ms: ms(select + select_next.unwrap_or_default()),
            draw_ms: ms(build + finished.draw),
            lag_ms: ms(cull + select + build + finished.draw),
            predicted_ms: (promise.predicted_s > 0.0).then_some(promise.predicted_s * 1e3),
            value_over_bound: promise.value_over_bound(),
            changes: plan.changes,
            reversals: plan.reversals,
            holes: promise.holes,
            passes: promise.passes,
            eps: self.control.eps_hat(),
            n,
            render_scale: self.scene_view.picture().scale,
            shadows: self.scene_view.picture().shadows,
            points: points as u64,
            lines: lines as u64,
            flat,
            gouraud,
            per_pixel,
            textured,
            shadowed,
        }
    }

    /// Mean n of the tubes in view, else of everything in view; zero if nothing is in view.
    pub fn mean_level(&self) -> f64 {
        let mean = |tubes_only: bool| {
            let all = self.scene_view.seen().iter().zip(&self.levels);
            let drawn = all.filter(|(s, _)| s.visible && (s.tube_m.is_some() || !tubes_only));
            let (sum, count) =
                drawn.fold((0.0, 0.0), |(sum, count), (_, l)| (sum + f64::from(l.resolution.n), count + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        mean(true).or_else(|| mean(false)).unwrap_or(0.0)
    }
}

/// The position of every probe's point in the final states.
pub fn probes(scene: &Scene, handles: &Agents) -> Vec<ProbeOutcome> {
    // an agent's watches are its probes with a period, in the scene's order
    let watch = |at: usize| {
        let probe = &scene.probes[at];
        scene.probes[..at].iter().filter(|p| p.agent == probe.agent && p.every.is_some()).count()
    };
    let point = |(at, probe): (usize, &Probe)| {
        let agent = &handles[probe.agent.0 as usize];
        let (position, velocity) = agent.latest().body.probe(probe.at)?;
        let samples = probe.every.map(|_| agent.samples(watch(at)));
        Some(ProbeOutcome { object: probe.object.clone(), at: probe.at, position, velocity, samples })
    };
    scene.probes.iter().enumerate().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::SimTime;
    use metachron_render::{Size, Style};
    use metachron_runtime::Command;
    use metachron_scene::Source;
    use metachron_world::Pace;

    #[test]
    fn time_before_the_first_step_counts_as_start_up() {
        let text = b"format = 1\nexecutor = \"threads\"\n[[object]]\nname = \"idle\"\nmodel = \"synthetic\"\nrate_hz = 10.0\ncost_us = 10.0\n";
        let scene = metachron_scene::load(&Source::memory("idle", text).unwrap(), &[]).unwrap();
        let opened = std::time::Instant::now();
        let mut session = Session::open(scene, Pace::RealTime).unwrap();
        let held = session.now() + Duration::from_millis(30);
        session.wait_until(held);
        assert_eq!((session.sim_now(), session.agents()[0].steps()), (SimTime::ZERO, 0));
        session.begin();
        let outcome = session.end(None, false);
        let (start_up_s, wall_s) = (outcome.start_up_s, outcome.wall_s);
        assert!(start_up_s >= 0.03 && wall_s <= opened.elapsed().as_secs_f64() - 0.03, "{start_up_s} s, {wall_s} s");
    }

    #[test]
    fn a_body_from_which_matter_is_taken_is_drawn_without_its_triangles() {
        let text = b"format = 1\nexecutor = \"lockstep\"\n[[object]]\nname = \"liver\"\nmodel = \"solid\"\n\
            shape = \"mesh\"\ngenerate = \"liver\"\nscale = 0.1\ntriangles = 600\nposition_m = [0.0, 0.0, 0.1]\neps_m = 0.03\nyoung_pa = 5e3\n\
            hold = [\"bottom\"]\n";
        let scene = metachron_scene::load(&Source::memory("liver", text).unwrap(), &[]).unwrap();
        let mut session = Session::open(scene, Pace::RealTime).unwrap();
        let (camera, size) = (session.scene_camera(), Size { width: 200, height: 200 });
        session.begin();
        let drawn = |session: &mut Session, milliseconds: u64| {
            session.wait_until(Duration::from_millis(milliseconds));
            session.compose(&camera, size, Style::default(), None).skins.triangles.len()
        };
        let whole = drawn(&mut session, 50);
        let liver = session.world.object("liver").unwrap();
        let bounds = session.world.latest(liver).unwrap().bounds.unwrap();
        session.world.command(liver, Command::carve(bounds.low, bounds.high, 0.04)).unwrap();
        let left = drawn(&mut session, 100);
        let removed = session.world.latest(liver).unwrap().removed;
        assert!(removed.triangles > 20 && whole > left, "{removed:?}: {whole}, {left}");
        // each triangle is divided into as many parts
        assert_eq!((whole - left) % removed.triangles as usize, 0, "{removed:?}: {whole}, {left}");
    }
}
