//! The machine and the program that a log is made with.

use palpa_rt::Machine;

/// This program on this machine: everything that the last bits of its forces depend on.
pub fn machine() -> Machine {
    let libraries = env!("PALPA_LIBRARIES").split(';');
    let caches = palpa_sparse::cache_sizes().map(|bytes| format!("{} KiB", bytes / 1024));
    Machine {
        compiler: env!("PALPA_COMPILER").to_owned(),
        libraries: libraries
            .filter_map(|library| library.split_once(' '))
            .map(|(name, version)| (name.to_owned(), version.to_owned()))
            .collect(),
        caches: caches.join(", "),
        threads: rayon::current_num_threads().to_string(),
        ..Machine::here()
    }
}
