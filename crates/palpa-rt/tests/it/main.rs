//! The engine round a toy tissue, whose patches are real and whose answers are known.

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests fail like the tests themselves"
)]

mod devices;
mod engine;
mod faults;
mod logs;
mod machine;
mod realtime;
mod toy;
