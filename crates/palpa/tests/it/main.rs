//! Integration tests of the library.

mod notes;
