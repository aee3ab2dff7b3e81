//! Metrics for Prometheus: `GET /metrics` on the configured address.
//!
//! They are made from the same snapshot that the control socket gives out, so the core takes notice only while somebody
//! asks ([`crate::control`]).

mod page;
mod text;

use core::convert::Infallible;
use core::time::Duration;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{ALLOW, CONTENT_TYPE, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tracing::warn;

use crate::control::Reader;
use crate::log::module::METRICS;

pub use text::text;

/// Clients at the same time.
const MAX_CLIENTS: usize = 8;
/// Bytes of a request line and its headers: more than any client of this needs.
const LARGEST_HEAD: usize = 8192;
/// How long a request may take to come.
const LONGEST_HEAD: Duration = Duration::from_secs(5);
/// How long a connection lasts at most; its client makes another one.
const LONGEST_CONNECTION: Duration = Duration::from_secs(60);
/// The text format (Prometheus, "Exposition formats").
const FORMAT: HeaderValue = HeaderValue::from_static("text/plain; version=0.0.4; charset=utf-8");

/// Listens where metrics are to be had.
///
/// # Errors
/// What the operating system says.
pub(crate) fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Answers whoever connects to `listener`, in the runtime that this is called in.
///
/// # Errors
/// The runtime does not take the socket.
pub fn serve(listener: TcpListener, reader: Reader) -> std::io::Result<()> {
    tokio::spawn(accept(tokio::net::TcpListener::from_std(listener)?, reader));
    Ok(())
}

async fn accept(listener: tokio::net::TcpListener, reader: Reader) {
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    let mut had_trouble = false;
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                // Out of descriptors or the like: that passes when clients leave.
                if !core::mem::replace(&mut had_trouble, true) {
                    warn!(target: METRICS, "metrics: a client could not connect: {error}");
                }
                sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        had_trouble = false;
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        let reader = reader.clone();
        tokio::spawn(async move {
            // However a connection ends, it is over.
            let _ = timeout(LONGEST_CONNECTION, converse(stream, reader)).await;
            drop(place);
        });
    }
}

async fn converse(stream: TcpStream, reader: Reader) -> hyper::Result<()> {
    let service = service_fn(move |request| answer(request, reader.clone()));
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(LONGEST_HEAD)
        .max_buf_size(LARGEST_HEAD)
        .serve_connection(TokioIo::new(stream), service)
        .await
}

async fn answer(request: Request<Incoming>, mut reader: Reader) -> Result<Response<Full<Bytes>>, Infallible> {
    let is_read = [Method::GET, Method::HEAD].contains(request.method());
    Ok(match request.uri().path() {
        "/metrics" if is_read => match reader.read().await {
            Some(status) => plain(StatusCode::OK, text(&status)),
            None => plain(StatusCode::SERVICE_UNAVAILABLE, "the core does not answer\n".to_owned()),
        },
        "/metrics" => {
            let mut response = plain(StatusCode::METHOD_NOT_ALLOWED, "only GET\n".to_owned());
            response.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            response
        }
        _ => plain(StatusCode::NOT_FOUND, "metrics are at /metrics\n".to_owned()),
    })
}

fn plain(status: StatusCode, text: String) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(Bytes::from(text)));
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, FORMAT);
    response
}
