//! Crate `canopen`.
