//! Rows of joints, bounds and what presses a contact: each kind against its closed form.

mod bounds;
mod joints;
mod pressed;
