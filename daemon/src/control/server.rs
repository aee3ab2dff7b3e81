//! The server's side of the control socket.

use core::time::Duration;
use std::io;
use std::os::unix::net;
use std::sync::Arc;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::{Order, Orders, Reader, Request, Response};

/// Clients at the same time.
const MAX_CLIENTS: usize = 16;
/// The longest request, in bytes, without its end of line.
const LONGEST: u64 = 4096;
/// How long a client may take to accept an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a client may say nothing.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);

/// What there is between a client and the core.
#[derive(Clone, Debug)]
struct ToCore {
    reader: Reader,
    orders: Orders,
}

/// Answers whoever connects to `listener`, in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take the socket.
pub fn serve(listener: net::UnixListener, reader: Reader, orders: Orders) -> io::Result<()> {
    tokio::spawn(accept(UnixListener::from_std(listener)?, ToCore { reader, orders }));
    Ok(())
}

async fn accept(listener: UnixListener, to_core: ToCore) {
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
        let to_core = to_core.clone();
        tokio::spawn(async move {
            // However a connection ends, it is over.
            let _ = talk(stream, to_core).await;
            drop(place);
        });
    }
}

/// Answers one client, line by line, until it leaves.
async fn talk(stream: UnixStream, mut to_core: ToCore) -> io::Result<()> {
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
                let response = answer(request, &mut to_core).await;
                say(stream.get_mut(), &response).await?;
            }
        }
    }
}

async fn answer(request: &[u8], ToCore { reader, orders }: &mut ToCore) -> Response {
    let order = match serde_json::from_slice(request) {
        Ok(Request::Status {}) => {
            let status = reader.read().await;
            return status.map_or_else(|| error("the core does not answer"), Response::Status);
        }
        Ok(Request::FaultInject { device, axis, fault }) => {
            fault.parse().map(|fault| Order::Inject { device, axis, fault })
        }
        Ok(Request::FaultClear { device, axis, fault }) => {
            fault.parse().map(|repair| Order::Repair { device, axis, repair })
        }
        Ok(Request::FaultList { device }) => Ok(Order::List { device }),
        Err(wrong) => return error(format!("not understood: {wrong}")),
    };
    match order {
        Ok(order) => orders.place(order).await.map_or_else(error, Response::Faults),
        Err(unknown) => error(unknown.to_string()),
    }
}

fn error(text: impl Into<String>) -> Response {
    Response::Error(text.into())
}

async fn say(stream: &mut UnixStream, response: &Response) -> io::Result<()> {
    let mut line = serde_json::to_vec(response)?;
    line.push(b'\n');
    timeout(PATIENCE, stream.write_all(&line)).await?
}
