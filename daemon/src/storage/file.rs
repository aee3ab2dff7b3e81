//! Files that are old or new, never anything between, whenever the power fails.
//!
//! A new text is written beside the old file and synced to the disk; then one `rename` puts it in its place, and the
//! directory is synced. Until the rename the old file is untouched; after it the new one is complete.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::core::Parameters;

use super::format::decode;

/// Longest file that is read: a thousand times what a device has.
const LONGEST: u64 = 64 << 20;

/// The name of the file of a device: `name.parameters`, all but letters, digits, `-` and `_` written as `%` and two
/// digits. So every device has a file of its own in the directory, whatever it is called.
#[must_use]
pub fn file_name(device: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
    let escape = |byte: u8| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    device.bytes().map(escape).chain([".parameters".to_owned()]).collect()
}

/// What the device has stored in `directory`; `None` if it never stored anything.
///
/// # Errors
/// The file cannot be read or is not one of ours.
pub fn load(directory: &Path, device: &str) -> io::Result<Option<Parameters>> {
    let file = match File::open(directory.join(file_name(device))) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes)?;
    decode(&bytes).map(Some).map_err(|corrupt| io::Error::new(io::ErrorKind::InvalidData, corrupt))
}

/// Makes `bytes` the content of the file `name` in `directory`; on an error the old content stays.
///
/// # Errors
/// A step failed: the disk is full, for example.
pub fn replace(directory: &Path, name: &str, bytes: &[u8]) -> io::Result<()> {
    let mut replacement = Replacement::new(directory, name, bytes);
    loop {
        match replacement.advance() {
            Ok(true) => {}
            Ok(false) => return Ok(()),
            Err(error) => {
                // What is left of it is in nobody's way: the next replacement overwrites it.
                let _ = fs::remove_file(&replacement.draft);
                return Err(error);
            }
        }
    }
}

/// The replacement of a file, step by step.
#[derive(Debug)]
pub struct Replacement<'a> {
    directory: &'a Path,
    draft: PathBuf,
    target: PathBuf,
    bytes: &'a [u8],
    step: Step,
}

#[derive(Debug)]
enum Step {
    Create,
    Write(File),
    Sync(File),
    Rename,
    SyncDirectory,
    Done,
}

impl<'a> Replacement<'a> {
    /// A replacement of the file `name` in `directory` that has not begun.
    #[must_use]
    pub fn new(directory: &'a Path, name: &str, bytes: &'a [u8]) -> Self {
        let draft = directory.join(format!("{name}.new"));
        Self { directory, draft, target: directory.join(name), bytes, step: Step::Create }
    }

    /// Does the next step. Whether there are more.
    ///
    /// # Errors
    /// The step failed; there are no more then.
    pub fn advance(&mut self) -> io::Result<bool> {
        self.step = match core::mem::replace(&mut self.step, Step::Done) {
            Step::Create => Step::Write(File::create(&self.draft)?),
            Step::Write(mut file) => {
                file.write_all(self.bytes)?;
                Step::Sync(file)
            }
            Step::Sync(file) => {
                file.sync_all()?;
                Step::Rename
            }
            Step::Rename => {
                fs::rename(&self.draft, &self.target)?;
                Step::SyncDirectory
            }
            Step::SyncDirectory => {
                File::open(self.directory)?.sync_all()?;
                Step::Done
            }
            Step::Done => Step::Done,
        };
        Ok(!matches!(self.step, Step::Done))
    }
}
