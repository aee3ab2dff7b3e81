//! Crate `profiles`.
