//! Any text as a robot (URDF) or a model (MJCF): the text of a scene, which is read in turn, or an error that names a line.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metachron::import::{Options, model};
use metachron::scene::{Source, load};
use std::path::Path;

fuzz_target!(|text: &str| {
    match model(text, Path::new("/nowhere"), &Options::default()) {
        Ok(imported) => {
            let source = Source::memory("fuzz", imported.toml.as_bytes()).expect("a scene's text is text");
            drop(load(&source, &[]));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
