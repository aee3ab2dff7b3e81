//! A directory belongs to one daemon: two that replace each other's files would both confirm what only one has stored.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// What is locked; no file of a device has this name.
const LOCK: &str = "lock";

/// A directory that no other daemon uses as long as this exists. The kernel ends it with the process, however that ends.
#[derive(Debug)]
pub struct Claim {
    directory: PathBuf,
    _lock: File,
}

impl Claim {
    /// Claims `directory`, which is made if it is missing.
    ///
    /// # Errors
    /// Another daemon uses it, or what the operating system says.
    pub fn take(directory: &Path) -> io::Result<Self> {
        fs::create_dir_all(directory)?;
        let lock = File::options().create(true).truncate(false).write(true).open(directory.join(LOCK))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { directory: directory.to_owned(), _lock: lock }),
            Err(TryLockError::WouldBlock) => {
                Err(io::Error::new(ErrorKind::ResourceBusy, "another axisd stores there"))
            }
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// The directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }
}
