//! The closed loop, in simulated time.

mod device;
mod faults;
mod open;
mod stability;
