//! The test kit: a builder of scene files ([`Scene`]), the command in a folder of its own
//! ([`Bench`]), and how many cases a property test draws ([`cases`]).
//!
//! It knows texts and processes alone, so that the tests of every crate can use it.
//!
//! ```
//! use palpa_testkit::{Layer, Scene};
//!
//! let scene = Scene::block([60.0, 60.0, 30.0], 8.0)
//!     .layer(Layer::elastic("gel", "10 kPa").levels(3))
//!     .sphere(8.0)
//!     .press(4.0);
//! assert!(scene.to_string().contains("spacing = \"8 mm\""));
//! ```

mod bench;
mod cases;
mod scene;
mod system;
mod wait;

pub use bench::Bench;
#[cfg(unix)]
pub use bench::interrupt;
pub use cases::cases;
pub use scene::{Layer, Lump, Scene, Value};
pub use system::without_system_errors;
pub use wait::wait_for;
