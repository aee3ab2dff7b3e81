//! SDO server: expedited and segmented transfer (CiA 301 v4.2, section 7.2.4.3).

mod command;
mod server;

pub(crate) use server::{Server, Step};
