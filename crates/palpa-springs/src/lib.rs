//! The reference method.
