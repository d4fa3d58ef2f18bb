//! Scene file, units and the tissue catalogue.
