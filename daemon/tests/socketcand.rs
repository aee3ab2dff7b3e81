//! The socketcand server over real TCP connections, with a core loop that the test plays.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use canopen::{Frame, Id};
use daemon::alarm::Alarm;
use daemon::clock::Clock;
use daemon::core::{LinkId, Peer, Sender};
use daemon::services;
use daemon::socketcand::{Bus, Inbound, Listening, Passed, Port, ToCore, listen, serve};
use tokio::sync::{broadcast, mpsc};

const PATIENCE: Duration = Duration::from_secs(10);

/// A server for the buses can0 and can1, and the core's ends.
struct Server {
    address: SocketAddr,
    received: mpsc::Receiver<Inbound>,
    frames: [broadcast::Sender<Passed>; 2],
    port: Port,
    _alarm: Alarm,
}

impl Server {
    fn start() -> Self {
        let alarm = Alarm::new().unwrap();
        let (to_core, received) = ToCore::new(alarm.bell());
        let listener = listen("127.0.0.1:0".parse().unwrap()).unwrap();
        let address = listener.local_addr().unwrap();
        let buses = vec![Bus::new("can0", LinkId(0)), Bus::new("can1", LinkId(1))];
        let frames = [buses[0].frames.clone(), buses[1].frames.clone()];
        let (listening, port) = Listening::new(listener, buses);
        services::serve(|| serve(vec![listening], &to_core, Clock::start())).unwrap();
        Self { address, received, frames, port, _alarm: alarm }
    }

    /// The next frame of a client, handed to the other clients as the core loop does.
    fn pass(&mut self) -> Inbound {
        let inbound = self.received.blocking_recv().unwrap();
        self.show(usize::from(inbound.link.0), Some(inbound.client), inbound.frame);
        inbound
    }

    fn show(&self, bus: usize, sender: Option<u64>, frame: Frame) {
        let at = od::Instant::ZERO;
        // Nobody may be there.
        let _ = self.frames[bus].send(Passed { at, sender, frame });
    }

    fn client(&self) -> Client {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut client = Client(stream);
        assert_eq!(client.hear(), "< hi >");
        client
    }

    /// A client that hears the frames of `bus`.
    fn raw_client(&self, bus: &str) -> Client {
        let mut client = self.client();
        assert_eq!(client.ask(&format!("< open {bus} >")), "< ok >");
        assert_eq!(client.ask("< rawmode >"), "< ok >");
        client
    }
}

struct Client(TcpStream);

impl Client {
    fn say(&mut self, text: &str) {
        self.0.write_all(text.as_bytes()).unwrap();
    }

    /// The next `< ... >`.
    fn hear(&mut self) -> String {
        let mut text = String::new();
        while !text.ends_with('>') {
            let mut byte = [0];
            self.0.read_exact(&mut byte).unwrap_or_else(|error| panic!("{error} after {text:?}"));
            text.push(char::from(byte[0]));
        }
        text
    }

    fn ask(&mut self, text: &str) -> String {
        self.say(text);
        self.hear()
    }

    /// The next frame without its time stamp.
    fn hear_frame(&mut self) -> String {
        let text = self.hear();
        let words: Vec<_> = text.split(' ').collect();
        assert!(words.len() == 6 && words[1] == "frame", "no frame: {text}");
        format!("{}#{}", words[2], words[4])
    }
}

fn frame(id: u16, payload: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), payload)
}

#[test]
fn a_frame_reaches_the_core_with_the_address_of_its_client() {
    let mut server = Server::start();
    for mut client in [server.raw_client("can0"), server.raw_client("can1")] {
        client.say("< send 123 0 >");
        let address = client.0.local_addr().unwrap();
        assert_eq!(server.pass().sender, Sender::Client(Peer::Address(address)));
    }
}

#[test]
fn a_frame_reaches_the_core_and_other_clients_but_not_its_sender() {
    let mut server = Server::start();
    let (mut sender, mut other) = (server.raw_client("can0"), server.raw_client("can0"));

    sender.say("< send 601 2 40 a >");

    let inbound = server.pass();
    assert_eq!((inbound.link, inbound.frame), (LinkId(0), frame(0x601, &[0x40, 0x0A])));
    server.show(0, None, frame(0x581, &[0x43]));
    assert_eq!(other.hear_frame(), "601#400A");
    assert_eq!(other.hear_frame(), "581#43");
    assert_eq!(sender.hear_frame(), "581#43");
}

#[test]
fn buses_are_apart() {
    let mut server = Server::start();
    let mut client = server.raw_client("can1");

    client.say("< send 00000601 0  >");

    let inbound = server.pass();
    assert_eq!((inbound.link, inbound.frame), (LinkId(1), Frame::new(Id::Extended(0x601), &[])));
    server.show(0, None, frame(0x701, &[0]));
    server.show(1, None, frame(0x702, &[0]));
    assert_eq!(client.hear_frame(), "702#00");
}

#[test]
fn remote_frames_do_not_pass() {
    let server = Server::start();
    let mut client = server.raw_client("can0");

    server.show(0, None, Frame::remote(Id::Standard(0x701), 1));
    server.show(0, None, frame(0x701, &[5]));

    assert_eq!(client.hear_frame(), "701#05");
}

#[test]
fn what_a_client_may_not_do_is_answered_by_an_error() {
    let server = Server::start();
    let mut client = server.client();
    for command in ["< open can7 >", "< open >", "< rawmode >", "< send 601 0 >", "< nonsense >", "< >"] {
        let answer = client.ask(command);
        assert!(answer.starts_with("< error "), "{command}: {answer}");
    }
    assert_eq!(client.ask("< open can0 >"), "< ok >");
    assert!(client.ask("< bcmmode >").starts_with("< error "));
    assert!(client.ask("< send 601 9 0 >").starts_with("< error "));
    assert_eq!(client.ask("< echo >"), "< echo >");
}

#[test]
fn noise_and_endless_commands_are_survived() {
    let server = Server::start();
    let mut client = server.client();

    client.say(&"x".repeat(1 << 20));
    client.say(&format!("<{}>", "y".repeat(1 << 20)));

    assert_eq!(client.hear(), "< error command too long >");
    assert_eq!(client.ask("< echo >"), "< echo >");
}

#[test]
fn a_client_that_does_not_read_holds_up_nobody() {
    let server = Server::start();
    let _asleep = server.raw_client("can0");
    let mut awake = server.raw_client("can0");

    let start = Instant::now();
    for _ in 0..1_000_000 {
        server.show(0, None, frame(0x181, &[0; 8]));
    }
    assert!(start.elapsed() < PATIENCE, "a million frames took {:?}", start.elapsed());

    server.show(0, None, frame(0x701, &[5]));
    while awake.hear_frame() != "701#05" {}
}

#[test]
fn a_client_that_sends_too_fast_has_to_wait() {
    let mut server = Server::start();
    let mut client = server.raw_client("can0");
    let sender = std::thread::spawn(move || {
        client.say(&"< send 080 0 >".repeat(20_000));
        client
    });

    let start = Instant::now();
    for _ in 0..20_000 {
        server.pass();
    }

    // At most 25600 a second.
    assert!(start.elapsed() > Duration::from_millis(700), "{:?}", start.elapsed());
    let mut client = sender.join().unwrap();
    assert_eq!(client.ask("< echo >"), "< echo >");
}

#[test]
fn clients_come_and_go() {
    let server = Server::start();
    for _ in 0..200 {
        server.raw_client("can0");
    }
    assert_eq!(server.client().ask("< echo >"), "< echo >");
}

/// Whether the server has closed the connection; what it still says is passed over.
fn is_over(client: &mut Client) -> bool {
    client.0.read_to_end(&mut Vec::new()).is_ok()
}

#[test]
fn clients_of_a_bus_that_goes_are_disconnected_and_the_others_notice_nothing() {
    let server = Server::start();
    let mut clients = ["can0", "can1"].map(|bus| server.raw_client(bus));
    let mut idle = server.client();
    let frames = server.frames[0].clone();

    // Another bus of the same name is not the same bus.
    let kept = Bus { name: "can0".to_owned(), link: LinkId(0), frames };
    server.port.serve(vec![kept.clone(), Bus::new("can1", LinkId(2))]);

    assert!(is_over(&mut clients[1]));
    server.show(0, None, frame(0x581, &[0x43]));
    assert_eq!(clients[0].hear_frame(), "581#43");
    assert_eq!(idle.ask("< open can1 >"), "< ok >");
    server.port.serve(vec![kept]);
    assert!(is_over(&mut idle));
    assert_eq!(server.client().ask("< open can1 >"), "< error could not open bus >");
}

#[test]
fn a_port_that_goes_is_closed_with_its_connections() {
    let Server { address, port, mut received, _alarm, .. } = Server::start();
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut client = Client(stream);
    assert_eq!(client.hear(), "< hi >");

    drop(port);

    assert!(is_over(&mut client));
    let end = Instant::now() + PATIENCE;
    while TcpStream::connect(address).is_ok() {
        assert!(Instant::now() < end, "the port is still open");
    }
    assert!(received.try_recv().is_err());
}

#[test]
fn a_crowd_of_clients_is_turned_away() {
    let server = Server::start();
    let crowd: Vec<Client> = (0..64).map(|_| server.client()).collect();

    let mut one_more = TcpStream::connect(server.address).unwrap();
    one_more.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut text = String::new();
    one_more.read_to_string(&mut text).unwrap();

    assert_eq!(text, "< error too many clients >");
    drop(crowd);
}
