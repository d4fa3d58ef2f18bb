//! Factors against dense linear algebra.

mod fronts;
