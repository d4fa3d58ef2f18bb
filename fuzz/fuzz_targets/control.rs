#![no_main]

use libfuzzer_sys::fuzz_target;
use palpa_viewer::control::Envelope;
use std::mem::discriminant;

// A request that is understood is written and understood again: the same one, but for the last digits of its numbers.
fuzz_target!(|text: &str| {
    let Ok(envelope) = serde_json::from_str::<Envelope>(text) else {
        return;
    };
    let written = serde_json::to_string(&envelope).expect("a request that was read can be written");
    let again: Envelope = serde_json::from_str(&written).expect("and read again");
    assert_eq!(again.id, envelope.id);
    assert_eq!(discriminant(&again.request), discriminant(&envelope.request));
});
