//! The font of figures: the one that the window's panels are written in, so that none of the system is needed.

use anyhow::{Context, anyhow};
use plotters::style::{FontStyle, register_font};
use std::sync::Once;

/// The font's name among those that the panels bring.
const BROUGHT: &str = "Ubuntu-Light";

/// Makes the font known as `name`, once.
///
/// # Errors
/// A font that is not there, or is none.
pub(super) fn bring_font(name: &str) -> anyhow::Result<()> {
    static ONCE: Once = Once::new();
    let mut done = Ok(());
    ONCE.call_once(|| done = bring(name));
    done
}

fn bring(name: &str) -> anyhow::Result<()> {
    let mut fonts = egui::FontDefinitions::default().font_data;
    let font = fonts.remove(BROUGHT).context("the program's font is missing")?;
    // once in the program's life, 200 kB
    let bytes = Box::leak(font.bytes().to_vec().into_boxed_slice());
    register_font(name, FontStyle::Normal, bytes).map_err(|_| anyhow!("the program's font is none"))
}
