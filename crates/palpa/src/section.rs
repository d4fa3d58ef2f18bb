//! Cross-sections of layered bodies.
