//! Keyboard commands: one table drives the handler, the help, the palette and the tooltips.
//!
//! In: egui's input. Out: [`Command`]s in the order they were pressed.
//! Never here: the effect of a command (see [`super::Viewer`]).

use egui::{Key, KeyboardShortcut, Modifiers};

/// A command that a key press can issue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    /// Run or pause the simulation.
    PauseOrRun,
    /// Advance by one frame.
    Step,
    /// Look at the moment before.
    Back,
    /// Return to the present.
    Live,
    /// Restart the scene.
    Reset,
    /// Reload the scene file.
    Reload,
    /// Next higher speed.
    Faster,
    /// Next lower speed.
    Slower,
    /// Real time.
    RealTime,
    /// Frame the selected object, or everything.
    Frame,
    /// Keep the selected object in the middle of the picture.
    Track,
    /// Close an overlay, clear the selection, detach from the scene's camera.
    Free,
    /// View through the scene's own camera.
    SceneCamera,
    /// Colour by resolution.
    Colours,
    /// Draw edges.
    Wireframe,
    /// Colour by age.
    Ages,
    /// Show distances along the view.
    Depths,
    /// Draw contact forces.
    Forces,
    /// Show or hide the lanes of turns.
    Lanes,
    /// Hide the panels.
    HideUi,
    /// Show or hide the timeline.
    Timeline,
    /// Show panels and picture as in a first window.
    ResetWindow,
    /// Switch between light and dark.
    Theme,
    /// Write the picture to a file.
    Screenshot,
    /// Show keys and mouse.
    Help,
    /// Show numbers of the run.
    Info,
    /// Show cost and rate of each agent.
    Costs,
    /// Show histories of the selected agent.
    Histories,
    /// List every command by name.
    Palette,
    /// End the run.
    Quit,
}

/// The section of the help that lists a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Time and scene.
    Time,
    /// Camera.
    Camera,
    /// Picture and panels.
    Picture,
}

/// A command and its keys.
#[derive(Debug, Clone, Copy)]
pub struct Shortcut {
    /// The command.
    pub command: Command,
    /// Alternative key presses.
    pub keys: &'static [KeyboardShortcut],
    /// Description for the user.
    pub does: &'static str,
    /// Section of the help.
    pub group: Group,
}

const fn key(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

const fn ctrl(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

const fn row(command: Command, keys: &'static [KeyboardShortcut], does: &'static str, group: Group) -> Shortcut {
    Shortcut { command, keys, does, group }
}

/// Every key binding of the window.
pub const SHORTCUTS: [Shortcut; 30] = [
    row(Command::PauseOrRun, &[key(Key::Space)], "Pause or run", Group::Time),
    row(Command::Step, &[key(Key::ArrowRight)], "Step one frame, or to the next moment", Group::Time),
    row(Command::Back, &[key(Key::ArrowLeft)], "Step back", Group::Time),
    row(Command::Live, &[key(Key::End)], "Return to the present", Group::Time),
    row(Command::Reset, &[key(Key::Backspace)], "Reset the scene", Group::Time),
    row(Command::Reload, &[ctrl(Key::L)], "Reload the scene file", Group::Time),
    row(Command::Faster, &[key(Key::Equals), key(Key::Plus)], "Faster", Group::Time),
    row(Command::Slower, &[key(Key::Minus)], "Slower", Group::Time),
    row(Command::RealTime, &[key(Key::Num1)], "Real time", Group::Time),
    row(Command::Quit, &[ctrl(Key::Q)], "Quit", Group::Time),
    row(Command::Frame, &[key(Key::F)], "Frame the selected object, or all", Group::Camera),
    row(Command::Track, &[key(Key::T)], "Track the selected object", Group::Camera),
    row(Command::SceneCamera, &[key(Key::V)], "View of the scene's camera, then of the next", Group::Camera),
    row(Command::Free, &[key(Key::Escape)], "Close, deselect, free camera", Group::Camera),
    row(Command::Colours, &[key(Key::C)], "Colour by resolution", Group::Picture),
    row(Command::Wireframe, &[key(Key::W)], "Wireframe", Group::Picture),
    row(Command::Ages, &[key(Key::A)], "Colour by age", Group::Picture),
    row(Command::Depths, &[key(Key::Z)], "Depth", Group::Picture),
    row(Command::Forces, &[key(Key::N)], "Contact forces", Group::Picture),
    row(Command::Lanes, &[key(Key::L)], "Lanes of turns", Group::Picture),
    row(Command::HideUi, &[key(Key::H)], "Hide the panels", Group::Picture),
    row(Command::Timeline, &[key(Key::F5)], "Timeline", Group::Picture),
    row(Command::ResetWindow, &[ctrl(Key::H)], "Panels and colours as at first", Group::Picture),
    row(Command::Theme, &[ctrl(Key::T)], "Light or dark", Group::Picture),
    row(Command::Screenshot, &[key(Key::F12)], "Screenshot", Group::Picture),
    row(Command::Help, &[key(Key::F1), key(Key::Questionmark)], "Help", Group::Picture),
    row(Command::Info, &[key(Key::F2)], "Run information", Group::Picture),
    row(Command::Costs, &[key(Key::F3)], "Cost and rate of every agent", Group::Picture),
    row(Command::Histories, &[key(Key::F4)], "Histories of the selected agent", Group::Picture),
    row(Command::Palette, &[ctrl(Key::P)], "Command palette", Group::Picture),
];

/// Mouse actions over the picture, for the help.
pub const MOUSE: [(&str, &str); 7] = [
    ("Left drag on an object", "Pull it with a spring; the wheel moves the spring's end in depth"),
    ("Left drag beside objects, or with Alt", "Orbit"),
    ("Right or middle drag", "Pan"),
    ("Wheel", "Zoom"),
    ("Right button and W A S D Q E", "Fly"),
    ("Click", "Select"),
    ("Double click", "Select and frame"),
];

/// The speeds that the keys step through, simulated seconds per second.
pub const SPEEDS: [f64; 10] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];

/// The next speed of [`SPEEDS`] above (`up`) or below `speed`; beyond the table its last entry.
#[must_use]
pub fn next_speed(speed: f64, up: bool) -> f64 {
    const SLACK: f64 = 1e-9; // a speed that came through a file or a factor still counts as its table entry
    let above = SPEEDS.into_iter().find(|&s| s > speed * (1.0 + SLACK));
    let below = SPEEDS.into_iter().rev().find(|&s| s < speed * (1.0 - SLACK));
    if up { above.unwrap_or(SPEEDS[SPEEDS.len() - 1]) } else { below.unwrap_or(SPEEDS[0]) }
}

/// Takes the commands pressed in this frame out of the input.
///
/// While text is typed only keys with Ctrl and function keys count; while a widget has focus, Space, arrows, End and Backspace do not
/// count either.
#[must_use]
pub fn pressed(ctx: &egui::Context) -> Vec<Command> {
    let typing = ctx.text_edit_focused();
    let focused = ctx.memory(|memory| memory.focused().is_some());
    // WASD fly the camera while the right button is down, and do not toggle then
    let flying = ctx.input(|input| input.pointer.secondary_down());
    let mut found = Vec::new();
    for shortcut in &SHORTCUTS {
        for keys in shortcut.keys.iter().filter(|keys| is_active(keys, typing, focused, flying)) {
            if ctx.input_mut(|input| input.consume_shortcut(keys)) {
                found.push(shortcut.command);
            }
        }
    }
    found
}

fn is_active(keys: &KeyboardShortcut, typing: bool, focused: bool, flying: bool) -> bool {
    if keys.modifiers.any() || is_function(keys.logical_key) || keys.logical_key == Key::Escape {
        return true;
    }
    let widget_key =
        matches!(keys.logical_key, Key::Space | Key::ArrowLeft | Key::ArrowRight | Key::End | Key::Backspace);
    let fly_key = matches!(keys.logical_key, Key::W | Key::A);
    let taken = typing || (focused && widget_key) || (flying && fly_key);
    !taken
}

fn is_function(key: Key) -> bool {
    matches!(key, Key::F1 | Key::F2 | Key::F3 | Key::F4 | Key::F5 | Key::F12)
}

/// The keys of `command` as shown to the user, such as `Ctrl+L` or `= or +`.
#[must_use]
pub fn keys_text(ctx: &egui::Context, command: Command) -> String {
    let shortcut = SHORTCUTS.iter().find(|row| row.command == command);
    let names: Vec<String> = shortcut.map_or_else(Vec::new, |row| row.keys.iter().map(|k| name(ctx, k)).collect());
    names.join(" or ")
}

fn name(ctx: &egui::Context, keys: &KeyboardShortcut) -> String {
    let modifiers = ctx.format_modifiers(keys.modifiers);
    let key = match keys.logical_key {
        Key::ArrowLeft => "Left",
        Key::ArrowRight => "Right",
        Key::Equals => "=",
        Key::Plus => "+",
        Key::Minus => "-",
        Key::Questionmark => "?",
        Key::Escape => "Esc",
        other => other.name(),
    };
    if modifiers.is_empty() { key.to_owned() } else { format!("{modifiers}+{key}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn no_two_commands_share_a_key() {
        let mut seen = HashSet::new();
        for shortcut in &SHORTCUTS {
            for keys in shortcut.keys {
                assert!(seen.insert((keys.modifiers, keys.logical_key)), "{:?} twice", keys.logical_key);
            }
        }
    }

    #[test]
    fn every_command_has_one_row_and_a_key() {
        let commands: HashSet<_> = SHORTCUTS.iter().map(|row| row.command).collect();
        assert_eq!(commands.len(), SHORTCUTS.len());
        assert!(SHORTCUTS.iter().all(|row| !row.keys.is_empty() && !row.does.is_empty()));
    }

    #[test]
    fn speeds_step_through_the_table_and_stop_at_its_ends() {
        assert_eq!(next_speed(1.0, true), 2.0);
        assert_eq!(next_speed(1.0, false), 0.5);
        assert_eq!(next_speed(0.7, true), 1.0);
        assert_eq!(next_speed(10.0, true), 10.0);
        assert_eq!(next_speed(0.01, false), 0.01);
        assert_eq!(next_speed(f64::NAN, true), 10.0);
    }
}
