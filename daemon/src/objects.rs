//! Objects as people name them and values as people write them.

mod find;
mod value;

pub use find::{Found, NotFound, address, find};
pub use value::{Unfit, json, parse, text};
