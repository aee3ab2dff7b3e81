//! CAN traffic in words: what each frame says, with the names and values of the objects that it carries.
//!
//! A [`Decoder`] has no I/O: it is told which nodes there are ([`Decoder::learn`]) and given one frame after the other. It
//! serves `axisctl dump` both ways: on the daemon's side with the live parameters of our nodes, on the client's side with
//! a log of candump ([`log_line`]).

mod decoder;
mod log_file;
mod lss;
mod time;
mod words;

pub use decoder::{Decoded, Decoder, Known};
pub use log_file::{LogLine, log_line};
