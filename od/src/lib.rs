//! Crate `od`.
