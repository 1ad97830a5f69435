//! The theme of the window: one palette for dark and one for light, spacing and fonts.
//!
//! In: egui's context. Out: its styles, and the [`Palette`] for custom painting. Never here: widgets.

use egui::{Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, TextStyle, Theme, Visuals, vec2};

/// The colours of one theme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Palette {
    /// Background of the picture.
    pub ground: Color32,
    /// Panels.
    pub panel: Color32,
    /// Buttons, fields and rows under the pointer.
    pub raised: Color32,
    /// Separator lines.
    pub line: Color32,
    /// Text.
    pub text: Color32,
    /// Secondary text.
    pub weak: Color32,
    /// Selection, and measured work.
    pub accent: Color32,
    /// Good state.
    pub good: Color32,
    /// Warning.
    pub warn: Color32,
    /// Failure.
    pub bad: Color32,
}

/// Colours on a dark ground.
pub const DARK: Palette = Palette {
    ground: Color32::from_rgb(14, 16, 19),
    panel: Color32::from_rgb(23, 25, 30),
    raised: Color32::from_rgb(36, 40, 47),
    line: Color32::from_rgb(43, 47, 55),
    text: Color32::from_rgb(220, 223, 228),
    weak: Color32::from_rgb(137, 144, 156),
    accent: Color32::from_rgb(86, 156, 214),
    good: Color32::from_rgb(98, 180, 132),
    warn: Color32::from_rgb(224, 172, 90),
    bad: Color32::from_rgb(222, 108, 108),
};

/// Colours on a light ground.
pub const LIGHT: Palette = Palette {
    ground: Color32::from_rgb(226, 229, 234),
    panel: Color32::from_rgb(247, 248, 250),
    raised: Color32::from_rgb(232, 235, 240),
    line: Color32::from_rgb(214, 219, 226),
    text: Color32::from_rgb(34, 38, 45),
    weak: Color32::from_rgb(100, 108, 120),
    accent: Color32::from_rgb(25, 111, 190),
    good: Color32::from_rgb(32, 130, 78),
    warn: Color32::from_rgb(170, 104, 10),
    bad: Color32::from_rgb(190, 50, 50),
};

/// The colours in use.
#[must_use]
pub fn palette(ui: &egui::Ui) -> Palette {
    if ui.visuals().dark_mode { DARK } else { LIGHT }
}

/// Sets the styles of both themes; the choice between them is left to egui and the user.
pub fn install(ctx: &egui::Context) {
    for (theme, palette) in [(Theme::Dark, DARK), (Theme::Light, LIGHT)] {
        let base = if theme == Theme::Dark { Visuals::dark() } else { Visuals::light() };
        ctx.set_visuals_of(theme, visuals(base, &palette));
        ctx.style_mut_of(theme, |style| {
            style.text_styles = [
                (TextStyle::Small, FontId::new(10.5, FontFamily::Proportional)),
                (TextStyle::Body, FontId::new(13.0, FontFamily::Proportional)),
                (TextStyle::Button, FontId::new(13.0, FontFamily::Proportional)),
                (TextStyle::Heading, FontId::new(15.0, FontFamily::Proportional)),
                (TextStyle::Monospace, FontId::new(11.5, FontFamily::Monospace)),
            ]
            .into();
            style.spacing.item_spacing = vec2(8.0, 6.0);
            style.spacing.button_padding = vec2(9.0, 4.0);
            style.spacing.interact_size.y = 22.0;
            style.spacing.slider_width = 132.0;
            style.spacing.window_margin = Margin::same(14);
            style.interaction.selectable_labels = false;
        });
    }
}

fn visuals(base: Visuals, palette: &Palette) -> Visuals {
    let mut visuals = base;
    let round = CornerRadius::same(5);
    visuals.panel_fill = palette.panel;
    visuals.window_fill = palette.panel;
    visuals.window_stroke = Stroke::new(1.0, palette.line);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.extreme_bg_color = palette.ground;
    visuals.faint_bg_color = palette.raised.gamma_multiply(0.5);
    visuals.weak_text_color = Some(palette.weak);
    visuals.warn_fg_color = palette.warn;
    visuals.error_fg_color = palette.bad;
    visuals.slider_trailing_fill = true;
    visuals.selection.bg_fill = palette.accent.gamma_multiply(0.45);
    visuals.selection.stroke = Stroke::new(1.0, palette.text);
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, palette.line);
    widgets.noninteractive.fg_stroke = Stroke::new(1.0, palette.text);
    for (widget, fill) in [
        (&mut widgets.inactive, palette.raised),
        (&mut widgets.hovered, lift(palette.raised, palette.text, 0.10)),
        (&mut widgets.active, lift(palette.raised, palette.text, 0.18)),
        (&mut widgets.open, palette.raised),
    ] {
        widget.weak_bg_fill = fill;
        widget.bg_fill = fill;
        widget.bg_stroke = Stroke::NONE;
        widget.fg_stroke = Stroke::new(1.0, palette.text);
        widget.corner_radius = round;
    }
    visuals
}

fn lift(from: Color32, to: Color32, share: f32) -> Color32 {
    from.lerp_to_gamma(to, share)
}
