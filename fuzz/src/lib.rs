//! What the fuzz targets share, and the main workspace replays `seeds` with.

pub mod story;
