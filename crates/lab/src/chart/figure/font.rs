//! The font of figures: that of the window's panels, so that no system font is needed.

use anyhow::anyhow;
use plotters::style::{FontStyle, register_font};
use std::sync::Once;

/// Registers the font under `name`, once.
///
/// # Errors
/// A font that is unreadable.
pub(super) fn bring_font(name: &str) -> anyhow::Result<()> {
    static ONCE: Once = Once::new();
    let mut done = Ok(());
    ONCE.call_once(|| done = bring(name));
    done
}

fn bring(name: &str) -> anyhow::Result<()> {
    register_font(name, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the built-in font cannot be read"))
}
