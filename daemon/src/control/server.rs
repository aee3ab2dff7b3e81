//! The server's side of the control socket.

use core::time::Duration;
use std::io;
use std::os::unix::net;
use std::sync::Arc;

use profiles::UnknownSignal;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::errand::{Errand, NmtOrder, Target};
use super::objects::Objects;
use super::request::{NMT_COMMANDS, PROTOCOL, Version};
use super::{Claim, Operation, Order, Orders, Reader, Request, Response, SignalOrder, lss, motion, traffic};
use crate::clock::Clock;
use crate::services;

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
pub struct ToCore {
    /// The status.
    pub reader: Reader,
    /// Orders.
    pub orders: Orders,
    /// Log and audit trail.
    pub operation: Operation,
    /// The clock of the core.
    pub clock: Clock,
}

/// Answers whoever connects to `listener`, in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take the socket.
pub fn serve(listener: net::UnixListener, to_core: ToCore) -> io::Result<()> {
    tokio::spawn(accept(UnixListener::from_std(listener)?, to_core));
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
        let mut to_core = to_core.clone();
        to_core.orders = to_core.orders.of(services::peer(&stream));
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
            request => serve_request(&mut stream, &mut to_core, request).await?,
        }
    }
}

/// Answers a request: by one line, or by many as long as something goes on.
async fn serve_request(
    stream: &mut BufReader<UnixStream>,
    to_core: &mut ToCore,
    request: &[u8],
) -> io::Result<()> {
    let response = match serde_json::from_slice(request) {
        Err(wrong) => error(format!("not understood: {wrong}")),
        Ok(Request::Dump { bus }) => return traffic::serve(stream, to_core, bus).await,
        Ok(
            request @ (Request::Move { .. }
            | Request::Jog { .. }
            | Request::Home { .. }
            | Request::Stop { .. }),
        ) => return motion::serve(stream, to_core, request).await,
        Ok(request) => answer(request, to_core).await.unwrap_or_else(error),
    };
    say(stream.get_mut(), &response).await
}

async fn answer(request: Request, to_core: &mut ToCore) -> Result<Response, String> {
    if let Request::Lss { action, address, node_id, bus } = request {
        return lss::run(to_core, bus, lss::task(&action, address, node_id)?).await;
    }
    let ToCore { reader, orders, operation, .. } = to_core;
    let order = match request {
        Request::Version {} => {
            let daemon = env!("CARGO_PKG_VERSION").to_owned();
            return Ok(Response::Version(Version { protocol: PROTOCOL, daemon }));
        }
        Request::Status {} => {
            let status = reader.read().await;
            return status.map(Response::Status).ok_or_else(|| "the core does not answer".to_owned());
        }
        Request::Reload {} => return operation.reload().await,
        Request::Log { change } => return operation.log(change.as_deref()),
        Request::Audit { count } => return operation.audit(count).await,
        Request::OdList { device, bus, filter } => {
            return Objects::of(orders, device, bus.as_deref()).await?.list(filter.as_deref()).await;
        }
        Request::OdRead { device, object, bus } => {
            return Objects::of(orders, device, bus.as_deref()).await?.read(&object).await;
        }
        Request::OdWrite { device, object, value, bus } => {
            return Objects::of(orders, device, bus.as_deref()).await?.write(&object, &value).await;
        }
        Request::OdExport { device, format, bus } => {
            return Objects::of(orders, device, bus.as_deref()).await?.export(&format).await;
        }
        Request::Claim { device, axis, owner } => {
            let claim = Claim { device, axis, owner: Some(owner) };
            return orders.place(Errand::Claim, claim).await?.map(Response::Owners);
        }
        Request::Release { device, axis } => {
            let claim = Claim { device, axis, owner: None };
            return orders.place(Errand::Claim, claim).await?.map(Response::Owners);
        }
        Request::Nmt { target, command, bus } => {
            let order = nmt(&target, &command, bus)?;
            return orders.place(Errand::Nmt, order).await?.map(Response::Commanded);
        }
        Request::FaultInject { device, axis, fault } => {
            fault.parse().map(|fault| Order::Inject { device, axis, fault })
        }
        Request::FaultClear { device, axis, fault } => {
            fault.parse().map(|repair| Order::Repair { device, axis, repair })
        }
        Request::FaultList { device } => Ok(Order::List { device }),
        Request::SignalSet { device, axis, signal } => {
            let signal = signal.parse().map_err(|unknown: UnknownSignal| unknown.to_string())?;
            let order = SignalOrder::Set { device, axis, signal };
            return orders.place(Errand::Signals, order).await?.map(Response::Signals);
        }
        Request::SignalList { device } => {
            let order = SignalOrder::List { device };
            return orders.place(Errand::Signals, order).await?.map(Response::Signals);
        }
        // They have answers of many lines.
        Request::Move { .. }
        | Request::Jog { .. }
        | Request::Home { .. }
        | Request::Stop { .. }
        | Request::Lss { .. }
        | Request::Dump { .. } => return Err("that goes on for a while".to_owned()),
    };
    let order = order.map_err(|unknown| unknown.to_string())?;
    orders.place(Errand::Faults, order).await?.map(Response::Faults)
}

/// An NMT command in words: the target is a Node-ID, `all` or the name of a device.
fn nmt(target: &str, command: &str, bus: Option<String>) -> Result<NmtOrder, String> {
    const HIGHEST_NODE_ID: u8 = 127;
    let found = NMT_COMMANDS.into_iter().find(|(word, _)| *word == command);
    let (_, command) = found.ok_or_else(|| {
        let known = NMT_COMMANDS.map(|(word, _)| word).join(", ");
        format!("unknown NMT command `{command}`; known: {known}")
    })?;
    let target = match (target, target.parse::<u8>()) {
        ("all", _) => Target::Node(0),
        (_, Ok(node_id @ 1..=HIGHEST_NODE_ID)) => Target::Node(node_id),
        (_, Ok(node_id)) => return Err(format!("Node-ID {node_id} is not in 1..{HIGHEST_NODE_ID}")),
        (device, Err(_)) => Target::Device(device.to_owned()),
    };
    Ok(NmtOrder { target, bus, command })
}

fn error(text: impl Into<String>) -> Response {
    Response::Error(text.into())
}

pub(super) async fn say(stream: &mut UnixStream, response: &Response) -> io::Result<()> {
    let mut line = serde_json::to_vec(response)?;
    line.push(b'\n');
    timeout(PATIENCE, stream.write_all(&line)).await?
}
