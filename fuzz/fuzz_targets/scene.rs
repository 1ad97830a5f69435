//! Any bytes as a scene file: a scene, or an error that can be shown.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metachron::scene::{Source, load};

fuzz_target!(|bytes: &[u8]| {
    let outcome = Source::memory("fuzz", bytes).and_then(|source| load(&source, &[]));
    if let Err(error) = outcome {
        assert!(!error.to_string().is_empty());
    }
});
