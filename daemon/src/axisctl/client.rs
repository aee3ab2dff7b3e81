//! The connection to a daemon.

use core::time::Duration;
use std::io::{self, BufRead, BufReader, ErrorKind, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use crate::cli::Failure;
use crate::control::{Request, Response, places_to_ask};

/// How long the daemon may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// Where a daemon may be.
#[derive(Debug)]
pub(super) struct Client {
    places: Vec<PathBuf>,
}

/// A daemon that is listened to.
#[derive(Debug)]
pub(super) struct Connection {
    stream: BufReader<UnixStream>,
    /// What has come of the next line.
    line: Vec<u8>,
}

/// What came of listening.
#[derive(Debug)]
pub(super) enum Heard {
    /// A line.
    Response(Box<Response>),
    /// Nothing for as long as was waited.
    Nothing,
    /// The daemon has closed the connection.
    End,
}

impl Client {
    /// One that asks the daemon at `socket`, or at the places where one usually is.
    pub(super) fn new(socket: Option<PathBuf>) -> Self {
        Self { places: socket.map_or_else(places_to_ask, |socket| vec![socket]) }
    }

    /// The answer of the first daemon that there is.
    pub(super) fn ask(&self, request: &Request) -> Result<Response, Failure> {
        self.connect(request)?.next(PATIENCE)
    }

    /// The first daemon that there is, asked for this.
    pub(super) fn connect(&self, request: &Request) -> Result<Connection, Failure> {
        let mut tried = Vec::new();
        for place in &self.places {
            match Connection::open(place) {
                Ok(mut connection) => {
                    // A daemon that has no place for one more client says so and leaves before it reads.
                    let _ = connection.say(request);
                    return Ok(connection);
                }
                Err(error) => tried.push(format!("{}: {error}", place.display())),
            }
        }
        Err(Failure::Other(format!("no daemon answers; tried {}", tried.join(", "))))
    }
}

impl Connection {
    fn open(place: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(place)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Self { stream: BufReader::new(stream), line: Vec::new() })
    }

    /// Says one more request.
    pub(super) fn say(&mut self, request: &Request) -> io::Result<()> {
        let mut line = serde_json::to_string(request)?;
        line.push('\n');
        self.stream.get_mut().write_all(line.as_bytes())
    }

    /// Gives a sign of life.
    pub(super) fn live(&mut self) {
        // A daemon that has left is found when it is listened to.
        let _ = self.stream.get_mut().write_all(b"\n");
    }

    /// Says nothing any more; what comes can still be heard.
    pub(super) fn fall_silent(&self) {
        // One that has left hears nothing anyway.
        let _ = self.stream.get_ref().shutdown(Shutdown::Write);
    }

    /// The next line.
    pub(super) fn next(&mut self, patience: Duration) -> Result<Response, Failure> {
        match self.hear(patience)? {
            Heard::Response(response) => Ok(*response),
            Heard::Nothing => Err(Failure::Other("the daemon does not answer".to_owned())),
            Heard::End => Err(Failure::Other("the daemon has closed the connection".to_owned())),
        }
    }

    /// The next line, if it comes in time.
    pub(super) fn hear(&mut self, patience: Duration) -> Result<Heard, Failure> {
        let failed = |error: io::Error| Failure::Other(format!("the daemon is not understood: {error}"));
        self.stream.get_ref().set_read_timeout(Some(patience)).map_err(failed)?;
        match self.stream.read_until(b'\n', &mut self.line) {
            Ok(0) => return Ok(Heard::End),
            Ok(_) if self.line.last() != Some(&b'\n') => return Ok(Heard::End),
            Ok(_) => {}
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(Heard::Nothing);
            }
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted) => return Ok(Heard::Nothing),
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
                return Ok(Heard::End);
            }
            Err(error) => return Err(failed(error)),
        }
        let line = core::mem::take(&mut self.line);
        serde_json::from_slice(&line).map(Box::new).map(Heard::Response).map_err(|error| failed(error.into()))
    }
}
