//! The law against oracles, garbage and its own limits.

mod contact;
#[cfg(debug_assertions)] // the allocator that forbids is not there in a release build
mod cost;
mod energy;
mod garbage;
mod support;
mod tick;
