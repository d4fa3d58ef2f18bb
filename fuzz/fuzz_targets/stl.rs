#![no_main]

use libfuzzer_sys::fuzz_target;
use palpa_mesh::Format;

fuzz_target!(|bytes: &[u8]| palpa_fuzz::read_check_repair(bytes, Format::Stl));
