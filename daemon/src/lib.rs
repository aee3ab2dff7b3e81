//! The daemon that puts motion axes on fieldbuses.
//!
//! [`core::Core`] is the part without I/O: every device and bus engine, by value, under whatever time it is told.
//! Around it one thread moves frames between the core and the links, and a second one serves
//! the clients of [`socketcand`], of the [`ascii_gateway`] and of the [`control`] socket. Between the two pass frames, by bounded queues, and the
//! [`status`] when somebody wants it. A third one writes what devices want to be stored: [`storage`].

#![warn(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

pub mod alarm;
pub mod ascii_gateway;
pub mod audit;
pub mod axisctl;
mod build;
pub mod cli;
pub mod clock;
mod commands;
pub mod control;
pub mod core;
mod core_loop;
mod demo;
pub mod dump;
mod explain;
pub mod latency;
mod link;
pub mod log;
pub mod metrics;
mod modbus_tcp;
pub mod motion;
pub mod objects;
mod realtime;
pub mod registers;
pub mod reload;
mod reporter;
mod run;
mod service_manager;
pub mod services;
pub mod socketcand;
pub mod status;
pub mod storage;
mod sys;
mod wait;
