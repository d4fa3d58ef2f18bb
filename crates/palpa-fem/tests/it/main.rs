//! Tests of the continuum model, as its users see it.

#![expect(clippy::unwrap_used, reason = "a test may panic")]
#![expect(clippy::float_cmp, reason = "what is exact is compared exactly")]

mod contact;
mod jobs;
mod law;
mod lump;
mod pairing;
mod realtime;
mod rest;
mod robust;
mod shape;
mod statics;
