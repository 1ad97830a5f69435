//! The cost that objects at rest add for ten that move: ten swinging tubes, alone and together with up to a thousand boxes or tubes at
//! rest out of sight.

use super::growth::{Case, Cost, Growth, Row};
use crate::chart::{Finding, median};
use cpu_time::ThreadTime;
use metachron_render::{Size, Style};
use metachron_runtime::AgentState;
use metachron_scene::{Source, load};
use metachron_session::{Finished, Session};
use metachron_world::Pace;
use std::time::Duration;

/// The experiment.
pub(in super::super) struct Sleepers;

/// Kind of sleepers, and whether pictures are composed for every frame or only agents step.
const CASES: [(&str, Sleeper, bool); 4] = [
    ("boxes, turns alone", Sleeper::Box, false),
    ("boxes, turns and pictures", Sleeper::Box, true),
    ("tubes, turns alone", Sleeper::Tube, false),
    ("tubes, turns and pictures", Sleeper::Tube, true),
];
/// Greatest cost of all together, as a multiple of the cost of the ten alone.
const LIMIT: f64 = 1.1;
/// Both runs are measured in turn: this many frames each, this many times.
const FRAMES: u32 = 30;
const ROUNDS: usize = 9;
/// Simulated seconds after which all must be asleep.
const SETTLED_S: f64 = 30.0;
const SIZE: Size = Size { width: 1280, height: 720 };

#[derive(Clone, Copy)]
enum Sleeper {
    Box,
    Tube,
}

impl Growth for Sleepers {
    const NAME: &'static str = "sleepers";
    const TITLE: &'static str = "Cost of sleeping objects beside ten active ones";
    const COUNTED: &'static str = "asleep";
    const COST: &'static str = "CPU µs per frame";
    const FLOOR: &'static str = "ten active objects alone";

    fn cases(quick: bool) -> Vec<Case> {
        let sizes: &[u32] = if quick { &[1000] } else { &[10, 100, 1000] };
        Case::of(CASES.map(|(name, ..)| name), sizes)
    }

    fn measure(case: &Case) -> Option<Cost> {
        let (_, sleeper, pictures) = CASES.into_iter().find(|(name, ..)| *name == case.case)?;
        let mut both = [Play::open(sleeper, case.size, pictures)?, Play::open(sleeper, 0, pictures)?];
        for play in &mut both {
            play.settle()?;
        }
        let mut times_us = [const { Vec::new() }; 2];
        for _ in 0..ROUNDS {
            for (play, times_us) in both.iter_mut().zip(&mut times_us) {
                times_us.push(play.frames_us(FRAMES));
            }
        }
        let [us, floor_us] = times_us.map(median);
        Some(Cost { count: f64::from(case.size), us, floor_us })
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let most = rows.iter().filter(|row| row.case.size == 1000);
        let claim = |row: &Row| {
            let claim = format!("{}: a thousand asleep and ten awake, over the ten alone", row.case.case);
            Finding::at_most(claim, row.times_floor(), LIMIT)
        };
        most.map(claim).collect()
    }
}

/// A scene in virtual time.
struct Play {
    session: Session,
    pictures: bool,
    due: Duration,
}

impl Play {
    fn open(sleeper: Sleeper, count: u32, pictures: bool) -> Option<Self> {
        let source = Source::memory("sleepers", scene(sleeper, count).as_bytes()).ok()?;
        let session = Session::open(load(&source, &[]).ok()?, Pace::RealTime).ok()?;
        Some(Self { session, pictures, due: Duration::ZERO })
    }

    /// Goes on until all but the ten sleep, for at least a second.
    fn settle(&mut self) -> Option<()> {
        self.frames_us(60);
        while self.session.agents().iter().skip(AWAKE).any(|agent| agent.state() != AgentState::Resting) {
            self.frames_us(FRAMES);
            (self.session.now().as_secs_f64() < SETTLED_S).then_some(())?;
        }
        Some(())
    }

    /// CPU time of a frame, mean of this many, microseconds.
    fn frames_us(&mut self, frames: u32) -> f64 {
        let start = ThreadTime::now();
        for _ in 0..frames {
            self.frame();
        }
        start.elapsed().as_secs_f64() * 1e6 / f64::from(frames)
    }

    fn frame(&mut self) {
        self.session.wait_until(self.due);
        self.due += self.session.period();
        if self.pictures {
            let started = self.session.now();
            let camera = self.session.scene_camera();
            self.session.compose(&camera, SIZE, Style::default(), None);
            self.session.finish(started, Finished::default());
        }
    }
}

const AWAKE: usize = 10;

/// Ten tubes that hang from one end in front of a camera, and behind it so many sleepers, ten in a row.
fn scene(sleeper: Sleeper, count: u32) -> String {
    let mut text = format!(
        "format = 1\nexecutor = \"lockstep\"\n[camera]\neye_m = [1, -2, 0.3]\nlook_at_m = [1, 0, 0.2]\n\
         [[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\nposition_m = [0, 0, -1]\n\
         [[object]]\nname = \"awake\"\nmodel = \"tube\"\ngrid = [{AWAKE}, 1, 1]\nspacing_m = [0.2, 0, 0]\n\
         path_m = [[0, 0, 0.5], [0, 0.5, 0.5]]\nradius_m = 0.012\nwall_m = 0.002\nyoung_pa = 1e6\ndensity_kg_m3 = 1050\n\
         pin = [\"start\"]\nsegments = 64\ndt_ms = 5\nsleep = false\n"
    );
    if count > 0 {
        let rows = count.div_ceil(10);
        text.push_str(&format!(
            "[[object]]\nname = \"asleep\"\ngrid = [10, {rows}, 1]\nspacing_m = [0.5, -0.5, 0]\n{}",
            match sleeper {
                Sleeper::Box =>
                    "model = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.05, 0.05, 0.05]\nposition_m = [-1, -4, -0.95]\ndt_ms = 5\n",
                Sleeper::Tube =>
                    "model = \"tube\"\npath_m = [[-1, -4, -0.5], [-0.8, -4, -0.5]]\nradius_m = 0.012\nwall_m = 0.002\n\
                     young_pa = 1e7\ndensity_kg_m3 = 1050\ndamping_per_s = 40\nclamp = [\"start\", \"end\"]\nsegments = 16\ndt_ms = 5\n",
            }
        ));
    }
    text
}
