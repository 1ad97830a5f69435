//! The adapter that tests draw on.

use metachron_render::Gpu;

/// A device; `None`, with a line that says why, where there is none and none is required.
pub fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var("METACHRON_REQUIRE_ADAPTER").is_ok_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("picture test skipped: {error}");
            None
        }
    }
}
