//! Numbers in, demands out: the controllers of pictures and agents.
