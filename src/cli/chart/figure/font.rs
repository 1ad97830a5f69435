//! The font of figures: that of the window's panels, so that no system font is needed.

use anyhow::{Context, anyhow};
use plotters::style::{FontStyle, register_font};
use std::sync::Once;

/// The font's name among egui's default fonts.
const BROUGHT: &str = "Ubuntu-Light";

/// Registers the font under `name`, once.
///
/// # Errors
/// A font that is missing or unreadable.
pub(super) fn bring_font(name: &str) -> anyhow::Result<()> {
    static ONCE: Once = Once::new();
    let mut done = Ok(());
    ONCE.call_once(|| done = bring(name));
    done
}

fn bring(name: &str) -> anyhow::Result<()> {
    let mut fonts = egui::FontDefinitions::default().font_data;
    let font = fonts.remove(BROUGHT).context("the program's font is missing")?;
    // leaked once per process, 200 kB
    let bytes = Box::leak(font.bytes().to_vec().into_boxed_slice());
    register_font(name, FontStyle::Normal, bytes).map_err(|_| anyhow!("the program's font is none"))
}
