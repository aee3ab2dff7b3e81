//! The control socket, with a core loop that the test plays.

use std::fs;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::Duration;

use daemon::alarm::Alarm;
use daemon::clock::Clock;
use daemon::control::{
    AxisFaults, AxisOwner, Claim, ControlSocket, Errand, Inbox, Operation, Order, Outcome, Placed, Publisher,
    Response, Task, ToCore, Watched, board, orders, serve,
};
use daemon::core::{LinkId, Peer};
use daemon::services;
use daemon::status::Status;
use od::Instant;

const PATIENCE: Duration = Duration::from_secs(10);

/// A directory of its own for a test.
struct Directory(PathBuf);

impl Directory {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("axisd-control-{}-{number}", process::id()));
        fs::create_dir(&path).unwrap();
        Self(path)
    }

    fn socket(&self) -> PathBuf {
        self.0.join("control.sock")
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A served socket and the core's end of its board.
struct Server {
    directory: Directory,
    publisher: Publisher,
    inbox: Inbox,
    _socket: ControlSocket,
    _alarm: Alarm,
}

impl Server {
    fn start() -> Self {
        let directory = Directory::new();
        let alarm = Alarm::new().unwrap();
        let (publisher, reader) = board(alarm.bell());
        let (inbox, orders) = orders(alarm.bell());
        let (socket, listener) = ControlSocket::bind(&directory.socket()).unwrap();
        let to_core = ToCore { reader, orders, operation: Operation::default(), clock: Clock::start() };
        services::serve(|| serve(listener, to_core)).unwrap();
        Self { directory, publisher, inbox, _socket: socket, _alarm: alarm }
    }

    fn client(&self) -> Client {
        Client::connect(&self.directory.socket())
    }

    /// The next order that reaches the core.
    fn placed(&mut self) -> Placed {
        loop {
            match self.inbox.poll() {
                Some(placed) => return placed,
                None => thread::yield_now(),
            }
        }
    }

    fn errand(&mut self) -> Errand {
        self.placed().errand
    }

    /// The next order that reaches the core and concerns faults.
    fn order(&mut self) -> Task<Order, Outcome> {
        match self.errand() {
            Errand::Faults(task) => task,
            other => panic!("{other:?}"),
        }
    }

    /// Plays a core that gives one status after the other as soon as it may; `calls` in all.
    fn publish(mut self, calls: u64) -> thread::JoinHandle<Self> {
        thread::spawn(move || {
            for call in 1..=calls {
                // Time passes with every turn of this core, so it may always give one.
                let now = Instant::ZERO + Duration::from_secs(call);
                while !self.publisher.is_wanted(now) {
                    thread::yield_now();
                }
                self.publisher.publish(now, Status { uptime_s: call, ..Status::default() });
            }
            self
        })
    }
}

struct Client(BufReader<UnixStream>);

impl Client {
    fn connect(path: &Path) -> Self {
        let stream = UnixStream::connect(path).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Self(BufReader::new(stream))
    }

    fn say(&mut self, text: &str) {
        self.0.get_mut().write_all(text.as_bytes()).unwrap();
    }

    /// The next answer; an empty text when the connection is over.
    fn hear(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line
    }

    /// The error that `request` is answered with.
    fn refused(&mut self, request: &str) -> String {
        self.say(&format!("{request}\n"));
        match serde_json::from_str(&self.hear()).unwrap() {
            Response::Error(error) => error,
            other => panic!("{other:?}"),
        }
    }
}

fn uptime(line: &str) -> u64 {
    match serde_json::from_str(line).unwrap() {
        Response::Status(status) => status.uptime_s,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_request_line_has_an_answer_line() {
    let server = Server::start();
    let mut client = server.client();
    let core = server.publish(2);

    client.say("{\"request\":\"status\"}\n{\"request\":\"status\"}\n");

    assert_eq!([client.hear(), client.hear()].map(|line| uptime(&line)), [1, 2]);
    core.join().unwrap();
}

#[test]
fn while_nobody_asks_the_core_is_not_wanted() {
    let server = Server::start();
    let mut client = server.client();
    assert!(client.refused("{}").contains("request"));
    assert!(!server.publisher.is_wanted(Instant::ZERO + PATIENCE));

    client.say("{\"request\":\"status\"}\n");
    let server = server.publish(1).join().unwrap();
    assert_eq!(uptime(&client.hear()), 1);
    assert!(!server.publisher.is_wanted(Instant::ZERO + PATIENCE));
}

#[test]
fn there_are_at_most_twenty_statuses_a_second() {
    let mut server = Server::start();
    let mut client = server.client();
    let start = Instant::ZERO + PATIENCE;
    client.say("{\"request\":\"status\"}\n");
    while !server.publisher.is_wanted(start) {
        thread::yield_now();
    }
    server.publisher.publish(start, Status { uptime_s: 1, ..Status::default() });
    assert_eq!(uptime(&client.hear()), 1);

    client.say("{\"request\":\"status\"}\n");
    while !server.publisher.is_wanted(start + Duration::from_millis(50)) {
        thread::yield_now();
    }
    assert!(!server.publisher.is_wanted(start + Duration::from_micros(49_999)));
    server.publisher.publish(start + Duration::from_millis(50), Status { uptime_s: 2, ..Status::default() });
    assert_eq!(uptime(&client.hear()), 2);
}

#[test]
fn what_is_not_understood_is_said_and_the_connection_goes_on() {
    let server = Server::start();
    let mut client = server.client();
    assert!(client.refused("").starts_with("not understood: "));
    assert!(client.refused("status").starts_with("not understood: "));
    assert!(client.refused("{\"request\":\"stattus\"}").contains("unknown variant `stattus`"));
    assert!(client.refused("{\"request\":\"status\",\"of\":1}").contains("unknown field `of`"));
    assert!(client.refused("\u{0}\u{1}\u{2}").starts_with("not understood: "));

    let core = server.publish(1);
    client.say("{\"request\":\"status\"}\n");
    assert_eq!(uptime(&client.hear()), 1);
    core.join().unwrap();
}

#[test]
fn an_order_reaches_the_core_and_its_outcome_comes_back() {
    let mut server = Server::start();
    let mut client = server.client();
    client.say("{\"request\":\"fault-inject\",\"device\":\"x\",\"fault\":\"supply-dip:10\",\"axis\":2}\n");
    let errand = server.order();
    let (device, fault) = ("x".to_owned(), "supply-dip:10".parse().unwrap());
    assert_eq!(errand.order, Order::Inject { device, axis: Some(2), fault });
    let faults = vec!["supply-dip:10".to_owned()];
    errand.conclude(Ok(vec![AxisFaults { device: "x".to_owned(), axis: 2, faults }]));
    assert_eq!(
        client.hear(),
        "{\"faults\":[{\"device\":\"x\",\"axis\":2,\"faults\":[\"supply-dip:10\"]}]}\n"
    );

    client.say("{\"request\":\"fault-clear\",\"device\":\"y\",\"fault\":\"all\"}\n");
    let errand = server.order();
    let (device, repair) = ("y".to_owned(), "all".parse().unwrap());
    assert_eq!(errand.order, Order::Repair { device, axis: None, repair });
    errand.conclude(Err("no device `y`".to_owned()));
    assert_eq!(client.hear(), "{\"error\":\"no device `y`\"}\n");

    client.say("{\"request\":\"fault-list\"}\n");
    let errand = server.order();
    assert_eq!(errand.order, Order::List { device: None });
    errand.conclude(Ok(Vec::new()));
    assert_eq!(client.hear(), "{\"faults\":[]}\n");
}

#[test]
fn a_claim_reaches_the_core_and_the_owners_come_back() {
    let mut server = Server::start();
    let mut client = server.client();
    let claim = |server: &mut Server| match server.errand() {
        Errand::Claim(task) => task,
        other => panic!("{other:?}"),
    };
    client.say("{\"request\":\"claim\",\"device\":\"x\",\"axis\":2,\"for\":\"modbus\"}\n");
    let task = claim(&mut server);
    let (device, owner) = ("x".to_owned(), Some("modbus".to_owned()));
    assert_eq!(task.order, Claim { device: device.clone(), axis: Some(2), owner });
    task.conclude(Ok(vec![AxisOwner { device, axis: 2, owner: "modbus".to_owned() }]));
    assert_eq!(client.hear(), "{\"owners\":[{\"device\":\"x\",\"axis\":2,\"owner\":\"modbus\"}]}\n");

    client.say("{\"request\":\"release\",\"device\":\"x\"}\n");
    let task = claim(&mut server);
    assert_eq!(task.order, Claim { device: "x".to_owned(), axis: None, owner: None });
    task.conclude(Err("no device `x`".to_owned()));
    assert_eq!(client.hear(), "{\"error\":\"no device `x`\"}\n");

    assert!(client.refused("{\"request\":\"claim\",\"device\":\"x\"}").contains("missing field `for`"));
}

#[test]
fn an_order_reaches_the_core_with_the_process_that_gave_it() {
    let mut server = Server::start();
    let (uid, pid) = (nix::unistd::geteuid().as_raw(), nix::unistd::getpid().as_raw());
    for request in ["\"fault-list\"", "\"nmt\",\"target\":\"1\",\"command\":\"start\"", "\"stop\""] {
        let mut client = server.client();
        client.say(&format!("{{\"request\":{request}}}\n"));
        assert_eq!(server.placed().by, Some(Peer::Process { uid, pid: Some(pid) }), "{request}");
    }
}

#[test]
fn an_order_that_makes_no_sense_does_not_reach_the_core() {
    let mut server = Server::start();
    let mut client = server.client();
    let wrong = "{\"request\":\"fault-inject\",\"device\":\"x\",\"fault\":\"blocked-shft\"}";
    assert!(client.refused(wrong).starts_with("unknown fault `blocked-shft`; did you mean `blocked-shaft`?"));
    assert!(
        client.refused("{\"request\":\"fault-inject\",\"device\":\"x\"}").contains("missing field `fault`")
    );
    assert!(server.inbox.poll().is_none());
}

#[test]
fn the_protocol_has_a_version() {
    let server = Server::start();
    let mut client = server.client();
    client.say("{\"request\":\"version\"}\n");
    let daemon = env!("CARGO_PKG_VERSION");
    assert_eq!(client.hear(), format!("{{\"version\":{{\"protocol\":1,\"daemon\":\"{daemon}\"}}}}\n"));
}

#[test]
fn what_makes_no_sense_to_nodes_does_not_reach_the_core() {
    let mut server = Server::start();
    let mut client = server.client();
    let nmt = |target: &str, command: &str| {
        format!("{{\"request\":\"nmt\",\"target\":\"{target}\",\"command\":\"{command}\"}}")
    };
    let unknown = "unknown NMT command `halt`; known: start, stop, preop, reset, reset-comm";
    assert_eq!(client.refused(&nmt("x", "halt")), unknown);
    assert_eq!(client.refused(&nmt("128", "start")), "Node-ID 128 is not in 1..127");
    let lss = |fields: &str| format!("{{\"request\":\"lss\",\"action\":{fields}}}");
    assert!(client.refused(&lss("\"seek\"")).starts_with("unknown LSS action `seek`"));
    assert_eq!(client.refused(&lss("\"configure\",\"node_id\":0")), "Node-ID 0 is not in 1..127");
    assert!(client.refused(&lss("\"inquire\"")).starts_with("scan takes nothing"));
    assert!(server.inbox.poll().is_none());
}

#[test]
fn who_stops_watching_is_forgotten_and_asks_on() {
    let mut server = Server::start();
    let mut client = server.client();
    client.say("{\"request\":\"dump\"}\n");
    let Errand::Watch(task) = server.errand() else { panic!("it watches") };
    let tap = task.order.1.clone();
    let bus = Watched { link: LinkId(0), name: "can0".to_owned(), nodes: Vec::new() };
    task.conclude(Ok(vec![bus]));
    assert_eq!(client.hear(), "{\"watching\":[\"can0\"]}\n");
    assert!(tap.is_watched());

    client.say("{\"request\":\"version\"}\n");
    let Errand::Unwatch(task) = server.errand() else { panic!("it stops") };
    assert!(!tap.is_watched());
    task.conclude(());
    assert!(client.hear().starts_with("{\"version\":"));
}

#[test]
fn a_motion_of_what_is_not_there_is_refused() {
    let mut server = Server::start();
    let mut client = server.client();
    client.say("{\"request\":\"jog\",\"device\":\"x\",\"velocity\":1}\n");
    let Errand::Describe(task) = server.errand() else { panic!("it looks for the device") };
    assert_eq!(task.order.as_deref(), Some("x"));
    task.conclude(Err("no device `x`; there are: y".to_owned()));
    assert_eq!(client.hear(), "{\"error\":\"no device `x`; there are: y\"}\n");
}

#[test]
fn an_order_that_finds_no_place_or_no_core_is_refused_at_once() {
    let alarm = Alarm::new().unwrap();
    let (inbox, orders) = orders(alarm.bell());
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    let list = || orders.place(Errand::Faults, Order::List { device: None });
    runtime.unwrap().block_on(async {
        // A core that does nothing for too long: each of these gives up, but its order stays.
        for _ in 0..16 {
            assert_eq!(list().await, Err("the core does not answer".to_owned()));
        }
        assert_eq!(list().await, Err("too many orders wait".to_owned()));
        drop(inbox);
        assert_eq!(list().await, Err("the core does not answer".to_owned()));
    });
}

#[test]
fn a_line_that_is_too_long_ends_the_connection() {
    let server = Server::start();
    let mut client = server.client();
    // The longest that may be: not understood, but read.
    assert!(client.refused(&"x".repeat(4096)).starts_with("not understood: "));

    client.say(&"x".repeat(4097));

    assert_eq!(client.hear(), "{\"error\":\"a request has at most 4096 bytes\"}\n");
    assert_eq!(client.hear(), "");
}

#[test]
fn sixteen_clients_are_served_and_the_next_one_is_told_so() {
    let server = Server::start();
    let mut clients: Vec<Client> = (0..16).map(|_| server.client()).collect();
    for client in &mut clients {
        client.refused("{}");
    }
    let mut one_more = server.client();
    assert_eq!(one_more.hear(), "{\"error\":\"too many clients\"}\n");
    assert_eq!(one_more.0.read(&mut [0]).unwrap(), 0);

    // Its place is free when the server has seen it leave.
    drop(clients.pop());
    let is_served = (0..1000).any(|_| {
        let mut client = server.client();
        client.0.get_mut().write_all(b"{}\n").is_ok() && {
            let mut line = String::new();
            client.0.read_line(&mut line).is_ok() && line.contains("not understood")
        }
    });
    assert!(is_served);
}

#[test]
fn only_owner_and_group_may_open_the_socket_and_it_goes_with_its_daemon() {
    let directory = Directory::new();
    let (socket, _listener) = ControlSocket::bind(&directory.socket()).unwrap();
    let mode = fs::metadata(directory.socket()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o660);
    assert_eq!(directory.names(), ["control.sock"]);
    drop(socket);
    assert_eq!(directory.names(), [""; 0]);
}

#[test]
fn its_directory_is_made() {
    let directory = Directory::new();
    let path = directory.0.join("run/axisd/control.sock");
    let (socket, _listener) = ControlSocket::bind(&path).unwrap();
    assert!(path.exists());
    assert_eq!(socket.path(), path);
}

#[test]
fn the_socket_of_a_dead_daemon_is_replaced() {
    let directory = Directory::new();
    drop(UnixListener::bind(directory.socket()).unwrap());
    assert_eq!(UnixStream::connect(directory.socket()).unwrap_err().kind(), ErrorKind::ConnectionRefused);

    let (_socket, _listener) = ControlSocket::bind(&directory.socket()).unwrap();

    assert!(UnixStream::connect(directory.socket()).is_ok());
}

#[test]
fn the_socket_of_a_living_daemon_stays() {
    let directory = Directory::new();
    let first = ControlSocket::bind(&directory.socket()).unwrap();
    let error = ControlSocket::bind(&directory.socket()).unwrap_err();
    assert_eq!((error.kind(), error.to_string().as_str()), (ErrorKind::AddrInUse, "another axisd serves it"));
    assert!(UnixStream::connect(directory.socket()).is_ok());
    assert_eq!(directory.names(), ["control.sock"]);
    drop(first);
}

#[test]
fn what_is_no_socket_is_left_alone() {
    let directory = Directory::new();
    fs::write(directory.socket(), "precious").unwrap();
    let error = ControlSocket::bind(&directory.socket()).unwrap_err();
    assert_eq!(error.to_string(), "there is something that is no socket");
    assert_eq!(fs::read(directory.socket()).unwrap(), b"precious");
}

#[test]
fn a_socket_that_took_the_place_meanwhile_is_not_removed() {
    let directory = Directory::new();
    let (socket, _listener) = ControlSocket::bind(&directory.socket()).unwrap();
    fs::remove_file(directory.socket()).unwrap();
    let _other = UnixListener::bind(directory.socket()).unwrap();
    drop(socket);
    assert_eq!(directory.names(), ["control.sock"]);
}

#[test]
fn the_first_place_that_can_be_used_is_taken() {
    let directory = Directory::new();
    fs::write(directory.0.join("file"), "").unwrap();
    let blocked = directory.0.join("file/control.sock");

    let (socket, _listener) = ControlSocket::bind_first(&[blocked.clone(), directory.socket()]).unwrap();
    assert_eq!(socket.path(), directory.socket());

    let tried = ControlSocket::bind_first(&[blocked.clone(), directory.socket()]).unwrap_err();
    assert!(tried.starts_with(&format!("{}: ", blocked.display())), "{tried}");
    assert!(
        tried.ends_with(&format!("{}: another axisd serves it", directory.socket().display())),
        "{tried}"
    );
}
