//! Integration tests of the laboratory.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod verify;
