//! The server's side of the control socket.

use core::time::Duration;
use std::io;
use std::os::unix::net;
use std::sync::Arc;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::{Reader, Request, Response};

/// Clients at the same time.
const MAX_CLIENTS: usize = 16;
/// The longest request, in bytes, without its end of line.
const LONGEST: u64 = 4096;
/// How long a client may take to accept an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a client may say nothing.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);

/// Answers whoever connects to `listener`, in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take the socket.
pub fn serve(listener: net::UnixListener, reader: Reader) -> io::Result<()> {
    tokio::spawn(accept(UnixListener::from_std(listener)?, reader));
    Ok(())
}

async fn accept(listener: UnixListener, reader: Reader) {
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    loop {
        let Ok((mut stream, _)) = listener.accept().await else {
            // Out of descriptors or the like: that passes when clients leave.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            // The client sees the connection end, whether or not it gets the reason.
            let _ = say(&mut stream, &Response::Error("too many clients".to_owned())).await;
            continue;
        };
        let reader = reader.clone();
        tokio::spawn(async move {
            // However a connection ends, it is over.
            let _ = talk(stream, reader).await;
            drop(place);
        });
    }
}

/// Answers one client, line by line, until it leaves.
async fn talk(stream: UnixStream, mut reader: Reader) -> io::Result<()> {
    let mut stream = BufReader::new(stream);
    let mut line = Vec::new();
    loop {
        line.clear();
        // One byte more than the longest line and its end shows that a line is longer.
        let mut bounded = (&mut stream).take(LONGEST + 1);
        timeout(LONGEST_SILENCE, bounded.read_until(b'\n', &mut line)).await??;
        match line.strip_suffix(b"\n").unwrap_or(&line) {
            [] if line.is_empty() => return Ok(()),
            long if long.len() as u64 > LONGEST => {
                let response = Response::Error(format!("a request has at most {LONGEST} bytes"));
                return say(stream.get_mut(), &response).await;
            }
            request => {
                let response = answer(request, &mut reader).await;
                say(stream.get_mut(), &response).await?;
            }
        }
    }
}

async fn answer(request: &[u8], reader: &mut Reader) -> Response {
    match serde_json::from_slice(request) {
        Ok(Request::Status {}) => match reader.read().await {
            Some(status) => Response::Status(status),
            None => Response::Error("the core does not answer".to_owned()),
        },
        Err(error) => Response::Error(format!("not understood: {error}")),
    }
}

async fn say(stream: &mut UnixStream, response: &Response) -> io::Result<()> {
    let mut line = serde_json::to_vec(response)?;
    line.push(b'\n');
    timeout(PATIENCE, stream.write_all(&line)).await?
}
