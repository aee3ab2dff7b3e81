//! The TCP side of the socketcand server.

use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{Semaphore, broadcast, watch};
use tokio::time::{Instant, sleep, sleep_until, timeout};

use super::protocol::{Command, Refusal, Scanner, write_frame};
use super::{Bus, Inbound, Listening, Passed, ToCore};
use crate::clock::Clock;
use crate::core::{Peer, Sender};

/// Clients at the same time, on each port.
const MAX_CLIENTS: usize = 64;
/// How long a client may take to accept what is sent to it.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a client has to take `< ok >` before frames follow: python-can wants it alone in a segment.
const QUIET_AFTER_OK: Duration = Duration::from_millis(10);
/// Commands of a client in one window: 25600 a second, more frames than the fastest classic CAN bus carries.
const MAX_COMMANDS: u32 = 512;
const WINDOW: Duration = Duration::from_millis(20);
/// Bytes that go to a client in one piece.
const CHUNK: usize = 4096;

/// Serves `listening` in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take a socket.
pub fn serve(listening: Vec<Listening>, to_core: &ToCore, clock: Clock) -> io::Result<()> {
    for Listening { listener, buses } in listening {
        let listener = TcpListener::from_std(listener)?;
        tokio::spawn(accept(listener, buses, to_core.clone(), clock));
    }
    Ok(())
}

async fn accept(listener: TcpListener, mut buses: watch::Receiver<Vec<Bus>>, to_core: ToCore, clock: Clock) {
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    let mut number = 0;
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            changed = buses.changed() => match changed {
                Ok(()) => continue,
                Err(_) => return,
            },
        };
        let Ok((mut stream, address)) = accepted else {
            // Out of descriptors or the like: that passes when clients leave.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            // The client sees the connection end, whether or not it gets the reason.
            let _ = stream.try_write(b"< error too many clients >");
            let _ = stream.shutdown().await;
            continue;
        };
        number += 1;
        let client = Client {
            number,
            address,
            stream,
            buses: buses.clone(),
            to_core: to_core.clone(),
            clock,
            scanner: Scanner::default(),
            bus: None,
            frames: None,
            pace: Pace { window_end: Instant::now(), commands: 0 },
        };
        tokio::spawn(async move {
            // However a connection ends, it is over.
            let _ = client.serve().await;
            drop(place);
        });
    }
}

/// Holds back a client that sends more than a bus could carry.
struct Pace {
    window_end: Instant,
    commands: u32,
}

impl Pace {
    async fn step(&mut self) {
        self.commands += 1;
        if self.commands > MAX_COMMANDS {
            sleep_until(self.window_end).await;
        }
        let now = Instant::now();
        if now >= self.window_end {
            (self.window_end, self.commands) = (now + WINDOW, 1);
        }
    }
}

struct Client {
    number: u64,
    address: SocketAddr,
    stream: TcpStream,
    buses: watch::Receiver<Vec<Bus>>,
    to_core: ToCore,
    clock: Clock,
    scanner: Scanner,
    bus: Option<Bus>,
    /// What passes on the bus, in raw mode.
    frames: Option<broadcast::Receiver<Passed>>,
    pace: Pace,
}

impl Client {
    async fn serve(mut self) -> io::Result<()> {
        self.stream.set_nodelay(true)?;
        self.write("< hi >").await?;
        let mut input = [0; 1024];
        let mut output = String::with_capacity(CHUNK + 64);
        let mut quiet_until = Instant::now();
        loop {
            let frames = self.frames.as_mut();
            let next_frame = async {
                match frames {
                    Some(frames) => {
                        sleep_until(quiet_until).await;
                        frames.recv().await
                    }
                    None => core::future::pending().await,
                }
            };
            tokio::select! {
                length = self.stream.read(&mut input) => match length? {
                    0 => return Ok(()),
                    length => {
                        let was_raw = self.frames.is_some();
                        for byte in input.get(..length).unwrap_or_default() {
                            self.take(*byte).await?;
                        }
                        if !was_raw && self.frames.is_some() {
                            quiet_until = Instant::now() + QUIET_AFTER_OK;
                        }
                    }
                },
                passed = next_frame => match passed {
                    Ok(passed) => self.forward(passed, &mut output).await?,
                    // The ring says by itself how many were lost; the client sees the gap.
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Ok(()),
                },
                changed = self.buses.changed() => if changed.is_err() || !self.has_bus() {
                    return Ok(());
                },
            }
        }
    }

    /// Sends `first` and what has come behind it.
    async fn forward(&mut self, first: Passed, output: &mut String) -> io::Result<()> {
        output.clear();
        let mut next = Some(first);
        while let Some(Passed { at, sender, frame }) = next {
            if sender != Some(self.number) && !frame.is_remote {
                write_frame(output, self.clock.unix_time(at), &frame);
            }
            let frames = self.frames.as_mut().filter(|_| output.len() < CHUNK);
            next = frames.and_then(|frames| frames.try_recv().ok());
        }
        self.write(output).await
    }

    async fn take(&mut self, byte: u8) -> io::Result<()> {
        let Some(command) = self.scanner.take(byte) else { return Ok(()) };
        self.pace.step().await;
        let answer = match command {
            Ok(command) => self.obey(command).await,
            Err(refusal) => Err(refusal),
        };
        match answer {
            Ok("") => Ok(()),
            Ok(answer) => self.write(answer).await,
            Err(refusal) => self.write(&format!("< error {refusal} >")).await,
        }
    }

    async fn obey(&mut self, command: Command) -> Result<&'static str, Refusal> {
        match command {
            Command::Open(name) => {
                self.frames = None;
                self.bus = self.buses.borrow().iter().find(|bus| bus.name == name).cloned();
                self.bus.as_ref().map(|_| "< ok >").ok_or("could not open bus")
            }
            Command::RawMode => {
                self.frames = Some(self.bus.as_ref().ok_or("no open bus")?.frames.subscribe());
                Ok("< ok >")
            }
            Command::Echo => Ok("< echo >"),
            Command::Send(frame) => {
                let link = self.bus.as_ref().ok_or("no open bus")?.link;
                let sender = Sender::Client(Peer::Address(self.address));
                let inbound = Inbound { link, client: self.number, sender, at: self.clock.now(), frame };
                self.to_core.frames.send(inbound).await.map_err(|_| "shutting down")?;
                self.to_core.bell.ring();
                Ok("")
            }
        }
    }

    /// Whether the bus that it has opened, if it has, is still served.
    fn has_bus(&self) -> bool {
        self.bus.as_ref().is_none_or(|own| self.buses.borrow().iter().any(|bus| bus.is(own)))
    }

    async fn write(&mut self, text: &str) -> io::Result<()> {
        timeout(PATIENCE, self.stream.write_all(text.as_bytes())).await?
    }
}
