//! The `metachron` command.
fn main() {}
