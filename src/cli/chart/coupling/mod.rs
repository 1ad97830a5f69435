//! `chart coupling`: how far apart a coupled scene and the same scene under one tiny common clock are.

pub(super) mod error;
