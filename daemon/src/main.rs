//! The `axisd` daemon.
fn main() {}
