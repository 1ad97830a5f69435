//! Worlds that run elsewhere as their users meet them: by the commands, and in a program.

mod command;
mod loopback;
mod placed;
