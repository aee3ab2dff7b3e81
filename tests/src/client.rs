//! A socketcand client that speaks the protocol's text itself.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpStream};

use crate::PATIENCE;

/// A socketcand client that speaks the protocol's text itself.
#[derive(Debug)]
pub struct Client(TcpStream);

impl Client {
    /// Connected to a server on this machine.
    #[must_use]
    pub fn connect(port: u16) -> Self {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).expect("connect to the daemon");
        stream.set_read_timeout(Some(PATIENCE)).expect("set a time-out");
        stream.set_nodelay(true).expect("send at once");
        Self(stream)
    }

    /// In raw mode on the bus `can0`.
    #[must_use]
    pub fn raw(port: u16) -> Self {
        Self::raw_on("can0", port)
    }

    /// In raw mode on this bus.
    #[must_use]
    pub fn raw_on(bus: &str, port: u16) -> Self {
        let mut client = Self::connect(port);
        client.expect("< hi >");
        client.send(&format!("< open {bus} >"));
        client.expect("< ok >");
        client.send("< rawmode >");
        client.expect("< ok >");
        client
    }

    /// Sends a message as it is.
    pub fn send(&mut self, text: &str) {
        self.0.write_all(text.as_bytes()).expect("send to the daemon");
    }

    /// The next `< ... >`.
    #[must_use]
    pub fn receive(&mut self) -> String {
        self.try_receive().unwrap_or_else(|error| panic!("{error}"))
    }

    /// Expects this message next.
    pub fn expect(&mut self, text: &str) {
        assert_eq!(self.receive(), text);
    }

    /// The next frame, without its time stamp.
    #[must_use]
    pub fn frame(&mut self) -> String {
        frame(&self.receive())
    }

    /// Sends a frame written as `601 8 40 0 10 0 0 0 0 0` and gives the next one, without its time stamp.
    ///
    /// # Errors
    /// The daemon is gone.
    pub fn try_ask(&mut self, request: &str) -> io::Result<String> {
        self.0.write_all(format!("< send {request} >").as_bytes())?;
        self.try_receive().map(|text| frame(&text))
    }

    fn try_receive(&mut self) -> io::Result<String> {
        let mut text = String::new();
        while !text.ends_with('>') {
            let mut byte = [0];
            self.0.read_exact(&mut byte)?;
            text.push(char::from(byte[0]));
        }
        Ok(text)
    }
}

fn frame(text: &str) -> String {
    match text.split(' ').collect::<Vec<_>>()[..] {
        ["<", "frame", id, stamp, data, ">"] => {
            let digits = stamp.split_once('.').map(|(seconds, micros)| (seconds.len(), micros.len()));
            assert!(matches!(digits, Some((1.., 6))), "no time stamp: {text}");
            format!("{id} {data}")
        }
        _ => panic!("no frame: {text}"),
    }
}
