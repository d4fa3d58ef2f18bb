//! Integration tests of the laboratory.

mod verify;
