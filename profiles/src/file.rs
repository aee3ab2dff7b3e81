//! Reads a profile file.

use crate::{Diagnostics, Profile};

pub mod reader;

/// See [`Profile::parse`].
pub(crate) fn parse(_file: &str, _text: &str, _motor: Option<&str>) -> Result<Profile, Diagnostics> {
    Err(Diagnostics::default())
}
