//! One client of the ASCII gateway.

use core::time::Duration;
use std::io;

use canopen::ascii::{LONGEST_LINE, Told};
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, BufReader};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::{Lines, Said};
use crate::core::Peer;

/// Lines that may wait for a client.
const QUEUE: usize = 1024;
/// How long a client may take to accept a line.
const PATIENCE: Duration = Duration::from_secs(10);
/// The end of a line that is sent; in one that is received the carriage return may be missing.
const END: &[u8] = b"\r\n";

/// A client as the engine's task knows it.
#[derive(Debug)]
pub(super) struct Client {
    pub(super) number: u64,
    /// Who it is, as far as that is known.
    pub(super) peer: Option<Peer>,
    lines: Lines,
    /// Events that found no room.
    lost: u64,
}

impl Client {
    /// Gives it a line; whether it is to go on. Events never take the place of the answer that it waits for: what is too much is
    /// counted, and told when there is room again.
    pub(super) fn tell(&mut self, told: Told) -> bool {
        const RESERVED: usize = 2;
        match told {
            Told::Answer(_) => self.lines.try_send(told).is_ok(),
            Told::Event(_) if self.lines.capacity() <= RESERVED => {
                self.lost += 1;
                !self.lines.is_closed()
            }
            Told::Event(_) => {
                let lost = core::mem::take(&mut self.lost);
                let notice = Told::Event(format!("# {lost} events lost"));
                (lost == 0 || self.lines.try_send(notice).is_ok()) && self.lines.try_send(told).is_ok()
            }
        }
    }
}

/// Serves a client until it leaves; the engine's task hears of that.
pub(super) async fn serve<S: AsyncRead + AsyncWrite + Unpin>(
    stream: S,
    (number, peer): (u64, Option<Peer>),
    said: mpsc::Sender<Said>,
) {
    let (lines, told) = mpsc::channel(QUEUE);
    let client = Client { number, peer, lines, lost: 0 };
    if said.send(Said::Came(client)).await.is_ok() {
        // However a connection ends, it is over.
        let _ = talk(BufReader::new(stream), number, &said, told).await;
        let _ = said.send(Said::Left(number)).await;
    }
}

async fn talk<S: AsyncRead + AsyncWrite + Unpin>(
    mut stream: BufReader<S>,
    number: u64,
    said: &mpsc::Sender<Said>,
    mut told: mpsc::Receiver<Told>,
) -> io::Result<()> {
    let mut line = Vec::new();
    let mut waits = false;
    loop {
        // What has been read of a line stays in it, if something is to be told before its end.
        let room = (LONGEST_LINE + END.len()).saturating_sub(line.len());
        let mut bounded = (&mut stream).take(room as u64);
        tokio::select! {
            read = bounded.read_until(b'\n', &mut line), if !waits => {
                read?;
                let Some(text) = line.strip_suffix(b"\n") else {
                    // It has left, or its line is too long to be one.
                    return Ok(());
                };
                let text = text.strip_suffix(b"\r").unwrap_or(text).to_vec();
                line.clear();
                waits = said.send(Said::Line(number, text)).await.is_ok();
            }
            next = told.recv() => {
                let Some(next) = next else { return Ok(()) };
                waits &= !matches!(next, Told::Answer(_));
                let (Told::Answer(text) | Told::Event(text)) = next;
                if !text.is_empty() {
                    let text = [text.as_bytes(), END].concat();
                    timeout(PATIENCE, stream.write_all(&text)).await??;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_leave_room_for_the_answer_and_what_is_lost_is_told() {
        let (lines, mut told) = mpsc::channel(5);
        let mut client = Client { number: 1, peer: None, lines, lost: 0 };
        let event = |number: u32| Told::Event(number.to_string());
        for number in 0..10 {
            assert!(client.tell(event(number)), "it goes on");
        }
        assert!(client.tell(Told::Answer("[1] OK".to_owned())));
        let heard: Vec<Told> = core::iter::from_fn(|| told.try_recv().ok()).collect();
        assert_eq!(heard, [event(0), event(1), event(2), Told::Answer("[1] OK".to_owned())]);
        assert!(client.tell(event(10)));
        let heard: Vec<Told> = core::iter::from_fn(|| told.try_recv().ok()).collect();
        assert_eq!(heard, [Told::Event("# 7 events lost".to_owned()), event(10)]);
        drop(told);
        assert!(!client.tell(event(11)), "it has left");
        assert!(!client.tell(Told::Answer(String::new())));
    }
}
