//! The command and facade.
