//! The server of the ASCII gateway, with a core that the test plays.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use canopen::ascii::LONGEST_LINE;
use canopen::{Frame, Id};
use daemon::alarm::Alarm;
use daemon::ascii_gateway::{Listener, Listening, serve};
use daemon::clock::Clock;
use daemon::control::{Errand, Placed, orders};
use daemon::core::{LinkId, Peer, Sender};
use daemon::services;
use daemon::socketcand::{Bus, Inbound, Passed, ToCore};
use tokio::sync::mpsc;

const PATIENCE: Duration = Duration::from_secs(30);
/// Clients at a place.
const MAX_CLIENTS: usize = 16;

/// A served bus, as net 1, and the core's ends of its ways.
struct Server {
    address: SocketAddr,
    bus: Bus,
    inbound: mpsc::Receiver<Inbound>,
    /// What is asked of the interface: to take every frame, or not.
    heard: std::sync::mpsc::Receiver<bool>,
    _alarm: Alarm,
}

impl Server {
    fn start() -> Self {
        let alarm = Alarm::new().unwrap();
        let (to_core, inbound) = ToCore::new(alarm.bell());
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let bus = Bus::new("can0", LinkId(0));
        let listening = Listening { listener: Listener::Tcp(listener), buses: vec![(1, bus.clone())] };
        let (mut inbox, orders) = orders(alarm.bell());
        services::serve(|| serve(vec![listening], &to_core, &orders, Clock::start())).unwrap();
        let (told, heard) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            loop {
                match inbox.poll() {
                    None => std::thread::sleep(Duration::from_millis(1)),
                    Some(Placed { errand: Errand::Hear(task), .. }) => {
                        let (LinkId(0), is_heard) = task.order else { panic!("{task:?}") };
                        if told.send(is_heard).is_err() {
                            return;
                        }
                        task.conclude(());
                    }
                    Some(other) => panic!("{other:?}"),
                }
            }
        });
        Self { address, bus, inbound, heard, _alarm: alarm }
    }

    fn client(&self) -> Client {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Client(BufReader::new(stream))
    }

    fn pass(&self, id: u16, payload: &[u8]) {
        let frame = Frame::new(Id::Standard(id), payload);
        let at = od::Instant::ZERO;
        // Nobody may be listening any more.
        let _ = self.bus.frames.send(Passed { at, sender: None, frame });
    }
}

struct Client(BufReader<TcpStream>);

impl Client {
    fn say(&mut self, text: &str) {
        self.0.get_mut().write_all(text.as_bytes()).unwrap();
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line
    }

    fn ask(&mut self, text: &str) -> String {
        self.say(text);
        self.line()
    }

    /// Whether the server closes the connection, whatever it has said before.
    fn is_closed(&mut self) -> bool {
        let mut rest = Vec::new();
        let read = self.0.read_to_end(&mut rest);
        read.is_ok() || read.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset)
    }
}

fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < PATIENCE, "not yet: {what}");
        std::thread::yield_now();
    }
}

#[test]
fn lines_end_with_or_without_a_carriage_return_and_may_come_ahead() {
    let mut server = Server::start();
    let mut client = server.client();
    client.say("\r\n# hello\n[1] 5 start\n[2] 6 sta");
    assert_eq!(client.line(), "[1] OK\r\n");
    client.say("rt\r\n");
    assert_eq!(client.line(), "[2] OK\r\n");
    let sent = [server.inbound.blocking_recv().unwrap(), server.inbound.blocking_recv().unwrap()];
    assert_eq!(sent.map(|inbound| inbound.frame.to_string()), ["000#0105", "000#0106"]);
}

#[test]
fn what_is_sent_for_a_client_has_its_address() {
    let mut server = Server::start();
    let mut clients = [server.client(), server.client()];
    let orders = ["[1] 5 start\n", "[2] lss_switch_glob 1\n", "[3] 5 preop\n"];
    for (client, order) in [0, 1, 0].into_iter().zip(orders) {
        let address = clients[client].0.get_ref().local_addr().unwrap();
        assert!(clients[client].ask(order).ends_with("OK\r\n"));
        let inbound = server.inbound.blocking_recv().unwrap();
        assert_eq!(inbound.sender, Sender::Gateway(Some(Peer::Address(address))), "{}", inbound.frame);
    }
}

#[test]
fn the_bus_is_listened_to_while_there_are_clients() {
    let server = Server::start();
    assert_eq!(server.bus.frames.receiver_count(), 0);
    let (mut first, second) = (server.client(), server.client());
    assert_eq!(first.ask("[1] set node 5\n"), "[1] OK\r\n");
    // What is answered is asked of a bus that is heard.
    assert_eq!((server.bus.frames.receiver_count(), server.heard.try_iter().collect()), (1, vec![true]));
    server.pass(0x705, &[0]);
    assert_eq!(first.line(), "1 5 BOOT_UP\r\n");
    drop((first, second));
    until("left", || server.bus.frames.receiver_count() == 0);
    assert_eq!(server.heard.recv_timeout(PATIENCE), Ok(false));
    let mut third = server.client();
    assert_eq!(
        third.ask("[1] start\n"),
        "[1] ERROR:105 #no default node set\r\n",
        "what others set is theirs"
    );
    assert_eq!(server.heard.try_iter().collect::<Vec<_>>(), [true]);
}

#[test]
fn one_client_too_many_is_sent_away() {
    let server = Server::start();
    let mut clients: Vec<Client> = (0..MAX_CLIENTS).map(|_| server.client()).collect();
    for client in &mut clients {
        assert_eq!(client.ask("[1] set node 5\n"), "[1] OK\r\n");
    }
    assert!(server.client().is_closed());
    clients.pop();
    until("a free place", || {
        // One that still is too many may be cut off at any point.
        let (mut client, mut line) = (server.client(), String::new());
        let is_said = client.0.get_mut().write_all(b"[1] set node 5\n").is_ok();
        is_said && client.0.read_line(&mut line).is_ok() && line == "[1] OK\r\n"
    });
}

#[test]
fn a_line_without_an_end_ends_the_connection() {
    let server = Server::start();
    let mut client = server.client();
    // The server may close before it has taken all of it.
    let _ = client.0.get_mut().write_all(&vec![b'x'; LONGEST_LINE + 10]);
    assert!(client.is_closed());
    let mut long = server.client();
    let line = format!("[1] 5 w 0x2000 0 hex {}\n", "00".repeat(100));
    assert_eq!(long.ask("[0] set command_size 100\n"), "[0] OK\r\n");
    assert_eq!(long.ask(&line), "[0] ERROR:101 #syntax error\r\n");
}
