//! The cost of a checkpoint of a scene: `checkpoint_cost SCENE.toml [SECONDS]`, built for release.
//!
//! Out: how long saving, putting back, writing and reading take (the least of some), how many bytes there are, and whether the world goes on
//! to the bit. Never here: a limit.

use metachron_core::SimSpan;
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Checkpoint, World};
use std::error::Error;
use std::time::{Duration, Instant};

/// Repetitions of which the shortest counts.
const TIMES: u32 = 10;

fn least<T>(mut act: impl FnMut() -> T) -> (Duration, T) {
    let mut timed = || {
        let start = Instant::now();
        let made = act();
        (start.elapsed(), made)
    };
    (1..TIMES).fold(timed(), |best, _| {
        let next = timed();
        if next.0 < best.0 { next } else { best }
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let file = args.next().ok_or("usage: checkpoint_cost SCENE.toml [SECONDS]")?;
    let seconds: f64 = args.next().map_or(Ok(0.5), |text| text.parse())?;
    let scene = load(&Source::open(&file)?, &[])?;
    let world = World::start(&scene, ExecutorKind::Lockstep)?;
    world.advance(SimSpan::from_secs_f64(seconds).ok_or("the time must be at least 0 s")?);
    let (saving, mark) = least(|| world.checkpoint());
    let (mark, at) = (mark?, world.hash());
    world.advance(SimSpan::from_millis(100));
    let end = world.hash();
    let (putting_back, done) = least(|| world.restore(&mark));
    done?;
    let same = world.hash() == at;
    world.advance(SimSpan::from_millis(100));
    let same = same && world.hash() == end;
    let path = std::env::temp_dir().join(format!("checkpoint-{}.bin", std::process::id()));
    let (writing, done) = least(|| mark.write(&path));
    done?;
    let (reading, read) = least(|| Checkpoint::read(&path));
    std::fs::remove_file(&path)?;
    let fresh = World::open(&scene, ExecutorKind::Lockstep, &read?)?;
    fresh.advance(SimSpan::from_millis(100));
    let same = same && fresh.hash() == end;
    let ms = |span: Duration| span.as_secs_f64() * 1e3;
    println!(
        "{file} at {seconds} s: {} agents, {} kB; save {:.3} ms, put back {:.3} ms, write {:.3} ms, read {:.3} ms; goes on to the bit: {same}",
        world.agents().len(),
        mark.size_bytes() / 1000,
        ms(saving),
        ms(putting_back),
        ms(writing),
        ms(reading)
    );
    Ok(())
}
