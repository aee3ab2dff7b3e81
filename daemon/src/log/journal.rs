//! The native protocol of the journal (systemd, "Native Journal Protocol"): a datagram for each event, a line for each
//! field.
//!
//! It is written here and not by a library, since all that could be had send the datagram from the thread that logs; the
//! journal may make that thread wait, and here it may be the one that moves the axes.

use core::fmt::{self, Debug, Write as _};
use std::env;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

/// Where the journal listens.
pub(super) const PLACE: &str = "/run/systemd/journal/socket";
/// What fields of our own begin with.
const PREFIX: &str = "AXISD_";

/// Whether standard error is the stream that the service manager has connected to the journal (systemd.exec(5),
/// `$JOURNAL_STREAM`), and not another file since.
pub(super) fn has_standard_error() -> bool {
    let Some(stream) = env::var("JOURNAL_STREAM").ok() else { return false };
    let error = io::stderr().as_fd().try_clone_to_owned().map(File::from);
    let file = error.and_then(|error| error.metadata());
    file.is_ok_and(|file| stream == format!("{}:{}", file.dev(), file.ino()))
}

/// The way to the journal: each buffer written is a datagram.
pub(super) struct Socket {
    socket: UnixDatagram,
    place: PathBuf,
}

impl Socket {
    /// The journal that listens at `place`.
    pub(super) fn open(place: impl AsRef<Path>) -> io::Result<Option<Self>> {
        let place = place.as_ref().to_owned();
        // Nobody there is found out now, and not by every line.
        place.metadata()?;
        Ok(Some(Self { socket: UnixDatagram::unbound()?, place }))
    }
}

impl Write for Socket {
    fn write(&mut self, datagram: &[u8]) -> io::Result<usize> {
        // By its path each time: the journal may be another one since.
        self.socket.send_to(datagram, &self.place)?;
        Ok(datagram.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Formats an event as the journal takes it.
pub(super) struct Native;

impl<S, N> FormatEvent<S, N> for Native
where
    S: Subscriber + for<'s> LookupSpan<'s>,
    N: for<'w> FormatFields<'w> + 'static,
{
    fn format_event(
        &self,
        _context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let metadata = event.metadata();
        writeln!(writer, "PRIORITY={}", priority(*metadata.level()))?;
        writeln!(writer, "SYSLOG_IDENTIFIER=axisd")?;
        writeln!(writer, "{PREFIX}MODULE={}", metadata.target())?;
        let mut fields = Fields { writer, outcome: Ok(()) };
        event.record(&mut fields);
        fields.outcome
    }
}

/// The priority that syslog(3) has for it.
fn priority(level: Level) -> u8 {
    match level {
        Level::ERROR => 3,
        Level::WARN => 4,
        Level::INFO => 6,
        Level::DEBUG | Level::TRACE => 7,
    }
}

struct Fields<'w> {
    writer: Writer<'w>,
    outcome: fmt::Result,
}

impl Visit for Fields<'_> {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.record_debug(field, &format_args!("{value}"));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let written = match field.name() {
            "message" => write!(self.writer, "MESSAGE="),
            name => write!(self.writer, "{PREFIX}{}=", name.to_ascii_uppercase()),
        };
        let mut line = OneLine(&mut self.writer);
        let written = written.and_then(|()| write!(line, "{value:?}"));
        let written = written.and_then(|()| writeln!(self.writer));
        self.outcome = self.outcome.and(written);
    }
}

/// Keeps a value on its line.
struct OneLine<'o, 'w>(&'o mut Writer<'w>);

impl fmt::Write for OneLine<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for (number, part) in text.split('\n').enumerate() {
            if number > 0 {
                self.0.write_char(' ')?;
            }
            self.0.write_str(part)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing::warn;
    use tracing_subscriber::layer::SubscriberExt;

    #[test]
    fn an_event_is_one_datagram_with_its_fields() {
        let directory = env::temp_dir().join(format!("axisd-journal-{}", std::process::id()));
        std::fs::create_dir_all(&directory).unwrap();
        let place = directory.join("socket");
        let journal = UnixDatagram::bind(&place).unwrap();
        let socket = std::sync::Mutex::new(Socket::open(&place).unwrap().unwrap());
        let layer = tracing_subscriber::fmt::layer().event_format(Native).with_writer(socket);
        let node: Option<u8> = None;
        tracing::subscriber::with_default(tracing_subscriber::registry().with(layer), || {
            warn!(target: "device", device = "x-axis", node, code = 0x2310, "x-axis: fault\nPRIORITY=0");
        });
        let mut datagram = [0; 512];
        let length = journal.recv(&mut datagram).unwrap();
        std::fs::remove_dir_all(&directory).unwrap();
        assert_eq!(
            std::str::from_utf8(&datagram[..length]).unwrap(),
            "PRIORITY=4\nSYSLOG_IDENTIFIER=axisd\nAXISD_MODULE=device\nMESSAGE=x-axis: fault PRIORITY=0\n\
             AXISD_DEVICE=x-axis\nAXISD_CODE=8976\n"
        );
    }

    #[test]
    fn a_journal_that_is_not_there_is_found_out_at_once() {
        assert!(Socket::open("/nowhere/journal").is_err());
    }
}
