//! Draws the newest states (wgpu) and the panels around them (egui). It reads snapshots, never the runtime.
