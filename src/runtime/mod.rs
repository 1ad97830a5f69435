//! Threads, clocks, slots and pacing: everything that makes agents run. It knows no model of physics and no picture.
