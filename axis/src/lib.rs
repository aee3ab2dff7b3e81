//! Crate `axis`.
