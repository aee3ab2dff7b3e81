//! The frames of the buses, in words, for a client that watches.

use core::fmt::Write as _;
use core::time::Duration;
use std::collections::BTreeMap;
use std::io;

use canopen::Frame;
use serde::{Deserialize, Serialize};
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::net::UnixStream;
use tokio::time::{MissedTickBehavior, interval};

use super::errand::{Errand, Watched};
use super::request::Response;
use super::server::{ToCore, say};
use crate::core::LinkId;
use crate::dump::{Decoded, Decoder};
use crate::link::{Record, Watch, tap};

/// How often the ring is emptied.
const PERIOD: Duration = Duration::from_millis(20);
/// Frames that are told before the client is listened to again.
const BATCH: usize = 256;
/// How often a core that is busy is told that nobody watches any more.
const ATTEMPTS: u32 = 5;

/// A frame that was on a bus.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traffic {
    /// When, in seconds since 1970 or as the log has it.
    pub time: f64,
    /// Name of the bus, or the interface in the log.
    pub bus: String,
    /// Whether one of our nodes sent it; unknown in a log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ours: Option<bool>,
    /// The identifier in hexadecimal: three digits, or eight of an extended one.
    pub id: String,
    /// Whether it is a remote frame.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub remote: bool,
    /// Its length.
    pub length: usize,
    /// Its bytes in hexadecimal.
    pub data: String,
    /// What it says.
    #[serde(flatten)]
    pub decoded: Decoded,
}

impl Traffic {
    /// A frame and what it says.
    #[must_use]
    pub fn new(time: f64, bus: &str, ours: Option<bool>, frame: &Frame, decoded: Decoded) -> Self {
        let mut data = String::with_capacity(16);
        for byte in frame.payload() {
            // A String takes whatever is written.
            let _ = write!(data, "{byte:02X}");
        }
        let (bus, id) = (bus.to_owned(), frame.id.to_string());
        Self { time, bus, ours, id, remote: frame.is_remote, length: frame.len(), data, decoded }
    }
}

/// One client that watches.
struct Watcher {
    watch: Watch,
    decoder: Decoder,
    names: BTreeMap<LinkId, String>,
}

/// Tells the client what passes on `bus`, or on all, until it leaves or says something.
pub(super) async fn serve(
    stream: &mut BufReader<UnixStream>,
    to_core: &ToCore,
    bus: Option<String>,
) -> io::Result<()> {
    let (tap, watch) = tap();
    let watched = match to_core.orders.place(Errand::Watch, (bus, tap)).await {
        Ok(Ok(watched)) => watched,
        Ok(Err(error)) | Err(error) => return say(stream.get_mut(), &Response::Error(error)).await,
    };
    let mut watcher = Watcher::new(watch, watched);
    let names = watcher.names.values().cloned().collect();
    let told = match say(stream.get_mut(), &Response::Watching(names)).await {
        Ok(()) => watcher.tell(stream, to_core).await,
        Err(error) => Err(error),
    };
    drop(watcher);
    for _ in 0..ATTEMPTS {
        if to_core.orders.place(Errand::Unwatch, ()).await.is_ok() {
            break;
        }
    }
    told
}

impl Watcher {
    fn new(watch: Watch, watched: Vec<Watched>) -> Self {
        let (mut decoder, mut names) = (Decoder::default(), BTreeMap::new());
        for Watched { link, name, nodes } in watched {
            nodes.into_iter().for_each(|known| decoder.learn(&name, known));
            names.insert(link, name);
        }
        Self { watch, decoder, names }
    }

    async fn tell(&mut self, stream: &mut BufReader<UnixStream>, to_core: &ToCore) -> io::Result<()> {
        let mut ticks = interval(PERIOD);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                said = stream.fill_buf() => {
                    // Whatever is said is the next request.
                    return said.map(|_| ());
                }
                _ = ticks.tick() => {}
            }
            for _ in 0..BATCH {
                let Some(record) = self.watch.poll() else { break };
                if let Some(response) = self.response(to_core, record) {
                    say(stream.get_mut(), &response).await?;
                }
            }
            let dropped = self.watch.take_dropped();
            if dropped > 0 {
                say(stream.get_mut(), &Response::Dropped(dropped)).await?;
            }
        }
    }

    fn response(&mut self, to_core: &ToCore, record: Record) -> Option<Response> {
        match record {
            Record::Frame { at, link, is_ours, frame } => {
                let name = self.names.get(&link)?;
                let decoded = self.decoder.decode(name, &frame);
                let time = to_core.clock.unix_time(at).as_secs_f64();
                Some(Response::Frame(Traffic::new(time, name, Some(is_ours), &frame, decoded)))
            }
            Record::Nodes(link, nodes) => {
                let name = self.names.get(&link)?;
                nodes.into_iter().for_each(|known| self.decoder.learn(name, known));
                None
            }
        }
    }
}
