//! SDO, both sides: expedited, segmented and block transfer (CiA 301 v4.2, section 7.2.4.3).

mod block;
mod client;
mod command;
mod connections;
mod crc;
mod server;

pub use client::{SdoClient, SdoError, SdoEvent, SdoMode};
pub(crate) use command::{ABORT, Request};
pub(crate) use connections::{Connections, FURTHER, is_cob_id};
pub(crate) use server::Step;
