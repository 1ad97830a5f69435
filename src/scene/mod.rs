//! Scene files: the only reader of files.
