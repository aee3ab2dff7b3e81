//! A server of `tokio-modbus` with 65536 registers, to compare axisd with: `modbus_tokio_server PORT`.

use std::future::{Ready, ready};
use std::net::Ipv4Addr;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::net::TcpListener;
use tokio_modbus::ExceptionCode;
use tokio_modbus::prelude::{Request, Response};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::{Server, accept_tcp_connection};

#[derive(Clone)]
struct Registers(Arc<Mutex<Vec<u16>>>);

impl Service for Registers {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        let mut registers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        ready(match request {
            Request::ReadHoldingRegisters(start, count) => registers
                .get(usize::from(start)..usize::from(start) + usize::from(count))
                .map(|words| Response::ReadHoldingRegisters(words.to_vec()))
                .ok_or(ExceptionCode::IllegalDataAddress),
            Request::WriteMultipleRegisters(start, words) => registers
                .get_mut(usize::from(start)..usize::from(start) + words.len())
                .map(|place| {
                    place.copy_from_slice(&words);
                    Response::WriteMultipleRegisters(start, words.len() as u16)
                })
                .ok_or(ExceptionCode::IllegalDataAddress),
            _ => Err(ExceptionCode::IllegalFunction),
        })
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let port: u16 = std::env::args().nth(1).ok_or("usage: modbus_tokio_server PORT")?.parse()?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await?;
    let registers = Registers(Arc::new(Mutex::new(vec![0; 65536])));
    let connected = |stream, address| {
        let registers = registers.clone();
        async move { accept_tcp_connection(stream, address, move |_| Ok(Some(registers.clone()))) }
    };
    Server::new(listener).serve(&connected, |error| eprintln!("{error}")).await?;
    Ok(())
}
