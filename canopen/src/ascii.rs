//! The ASCII gateway (CiA 309-3) without I/O: clients that know nothing of CAN read and write objects of any node on a
//! network, command nodes, exchange PDOs and configure slaves by LSS, in lines of text.
//!
//! Lines of clients and frames of the networks go in, lines and frames come out; time is an argument. One gateway serves
//! any number of clients on any number of networks. Each client has one command under way at a time, so what it can
//! occupy is bounded; clients that ask the same node wait for each other, since a node has one SDO channel for them all.

mod answer;
mod base64;
mod channel;
mod client;
mod command;
mod gateway;
mod lss;
mod network;
mod pdo;
mod value;
mod words;

pub use client::Told;
pub use gateway::{AsciiGateway, Outgoing};

/// The longest line that a client may send, in bytes without its end: enough for 48 KiB of a domain.
pub const LONGEST_LINE: usize = 65536;
