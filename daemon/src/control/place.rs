//! Where the control socket is, and that it is there only once.

use std::env;
use std::fs::{self, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process;

/// For a service; those of instances are in directories below.
const SYSTEM: &str = "/run/axisd";
/// For a user, under `$XDG_RUNTIME_DIR`.
const USER: &str = "axisd";
const FILE: &str = "control.sock";
/// Its owner and group may ask.
const MODE: u32 = 0o660;

/// Where a daemon serves the socket if its configuration does not say it: the first of these that can be used. A service
/// manager that makes a directory for it says where in `$RUNTIME_DIRECTORY`, and means that one.
#[must_use]
pub fn places_to_serve() -> Vec<PathBuf> {
    match directory_of_service("RUNTIME_DIRECTORY") {
        Some(directory) => vec![directory.join(FILE)],
        None => places_to_ask(),
    }
}

/// Where to look for a daemon that one knows nothing of.
#[must_use]
pub fn places_to_ask() -> Vec<PathBuf> {
    let user = env::var_os("XDG_RUNTIME_DIR").filter(|directory| !directory.is_empty());
    let user = user.map(|directory| Path::new(&directory).join(USER));
    core::iter::once(PathBuf::from(SYSTEM)).chain(user).map(|directory| directory.join(FILE)).collect()
}

/// Where the instance `axisd@NAME.service` serves it.
#[must_use]
pub fn place_of_instance(name: &str) -> PathBuf {
    Path::new(SYSTEM).join(name).join(FILE)
}

/// The directory that a service manager has made for us, by the variable that names it (systemd.exec(5): several are
/// separated by colons; ours has one).
pub(crate) fn directory_of_service(variable: &str) -> Option<PathBuf> {
    env::var_os(variable).filter(|directory| !directory.is_empty()).map(PathBuf::from)
}

/// The socket in the file system. On drop it is removed.
#[derive(Debug)]
pub struct ControlSocket {
    path: PathBuf,
    /// Device and inode: another daemon may have taken the place meanwhile.
    identity: (u64, u64),
}

impl ControlSocket {
    /// Listens at `path`, whose directory is made if it is missing. What a dead daemon has left there is replaced.
    ///
    /// # Errors
    /// A living daemon listens there, something there is no socket, or what the operating system says.
    pub fn bind(path: &Path) -> io::Result<(Self, UnixListener)> {
        if let Some(directory) = path.parent().filter(|directory| !directory.as_os_str().is_empty()) {
            fs::create_dir_all(directory)?;
        }
        check_free(path)?;
        let draft = path.with_extension(process::id().to_string());
        let bound = bind_as(&draft, path);
        if bound.is_err() {
            // It may not even be there.
            let _ = fs::remove_file(&draft);
        }
        let (listener, identity) = bound?;
        Ok((Self { path: path.to_owned(), identity }, listener))
    }

    /// Listens at the first of `places` where that is possible.
    ///
    /// # Errors
    /// What is wrong with each of them, for a reader.
    pub fn bind_first(places: &[PathBuf]) -> Result<(Self, UnixListener), String> {
        let mut tried = Vec::new();
        for path in places {
            match Self::bind(path) {
                Ok(bound) => return Ok(bound),
                Err(error) => tried.push(format!("{}: {error}", path.display())),
            }
        }
        Err(tried.join(", "))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        if fs::symlink_metadata(&self.path).is_ok_and(|file| (file.dev(), file.ino()) == self.identity) {
            // What cannot be removed the next daemon replaces.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Whether a socket may be put at `path`.
fn check_free(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
        Ok(file) if file.file_type().is_socket() => {}
        Ok(_) => {
            return Err(io::Error::new(ErrorKind::AlreadyExists, "there is something that is no socket"));
        }
    }
    match UnixStream::connect(path) {
        Ok(_) => Err(io::Error::new(ErrorKind::AddrInUse, "another axisd serves it")),
        Err(error) if matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::NotFound) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Listens at `draft` and puts that at `path` when its mode is right: nobody else gets in between, and what was there is
/// replaced at once.
fn bind_as(draft: &Path, path: &Path) -> io::Result<(UnixListener, (u64, u64))> {
    let listener = UnixListener::bind(draft)?;
    listener.set_nonblocking(true)?;
    fs::set_permissions(draft, Permissions::from_mode(MODE))?;
    let file = fs::symlink_metadata(draft)?;
    fs::rename(draft, path)?;
    Ok((listener, (file.dev(), file.ino())))
}
