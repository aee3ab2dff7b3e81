//! Modbus clients that behave badly, on real sockets.

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpStream};
use std::time::Duration;

use tests::{Bus, Daemon, PATIENCE, TempDir, axisctl, config, free_port};

/// Reads the controlword of unit 1.
const READ: [u8; 12] = [0, 7, 0, 0, 0, 6, 1, 3, 0x10, 2, 0, 1];
const ANSWER: [u8; 11] = [0, 7, 0, 0, 0, 5, 1, 3, 2, 0, 0];

/// A servo behind a listener with these keys.
fn start(keys: &str) -> (Daemon, u16) {
    let port = free_port();
    let text = format!(
        "[modbus]\nlisten = \"127.0.0.1:{port}\"\n{keys}\n{}",
        config(Bus::Virtual, &[("axis1", "cia402-servo", 1)])
    );
    (Daemon::start(&text), port)
}

fn connect(port: u16) -> TcpStream {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
    stream.set_nodelay(true).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

fn is_served(stream: &mut TcpStream) -> bool {
    let mut answer = [0; ANSWER.len()];
    stream.write_all(&READ).and_then(|()| stream.read_exact(&mut answer)).is_ok() && answer == ANSWER
}

/// Whether the other side has closed the connection.
fn is_closed(stream: &mut TcpStream) -> bool {
    match stream.read(&mut [0; 64]) {
        Ok(length) => length == 0,
        Err(error) => error.kind() == ErrorKind::ConnectionReset,
    }
}

#[test]
fn one_byte_per_segment_is_answered() {
    let (_daemon, port) = start("");
    let mut client = connect(port);
    for byte in READ {
        client.write_all(&[byte]).unwrap();
    }
    let mut answer = [0; ANSWER.len()];
    client.read_exact(&mut answer).unwrap();
    assert_eq!(answer, ANSWER);
}

#[test]
fn half_requests_of_many_do_not_hold_up_others() {
    let (_daemon, port) = start("");
    let mut halves: Vec<TcpStream> = (0..63).map(|_| connect(port)).collect();
    for half in &mut halves {
        half.write_all(&READ[..9]).unwrap();
    }
    let mut whole = connect(port);
    (0..100).for_each(|_| assert!(is_served(&mut whole)));
    for half in &mut halves {
        half.write_all(&READ[9..]).unwrap();
        let mut answer = [0; ANSWER.len()];
        half.read_exact(&mut answer).unwrap();
        assert_eq!(answer, ANSWER);
    }
}

#[test]
fn a_client_that_takes_no_answers_is_read_from_no_more_and_others_are_served() {
    let (_daemon, port) = start("");
    let mut deaf = connect(port);
    deaf.set_nonblocking(true).unwrap();
    let requests = READ.repeat(1000);
    let (mut sent, mut refusals) = (0_usize, 0);
    let mut other = connect(port);
    // Until all buffers on the way are full for good.
    while refusals < 50 {
        match deaf.write(&requests[sent % READ.len()..]) {
            Ok(length) => (sent, refusals) = (sent + length, 0),
            Err(error) => {
                assert_eq!(error.kind(), ErrorKind::WouldBlock);
                refusals += 1;
                assert!(is_served(&mut other));
            }
        }
    }
    // Then it listens, and gets all that it asked for.
    deaf.set_nonblocking(false).unwrap();
    let mut answers = vec![0; sent / READ.len() * ANSWER.len()];
    deaf.read_exact(&mut answers).unwrap();
    assert!(answers.chunks(ANSWER.len()).all(|answer| answer == ANSWER));
}

#[test]
fn the_client_that_is_too_many_is_sent_away() {
    let (_daemon, port) = start("max_clients = 2");
    let (mut first, mut second) = (connect(port), connect(port));
    assert!(is_served(&mut first) && is_served(&mut second));
    assert!(is_closed(&mut connect(port)));
    drop(first);
    // It may take a moment until the server has seen it.
    let mut attempts = std::iter::repeat_with(|| connect(port));
    assert!(attempts.by_ref().take(1000).any(|mut next| is_served(&mut next)));
    assert!(is_served(&mut second));
}

#[test]
fn or_takes_the_place_of_the_one_before() {
    let (_daemon, port) = start("max_clients = 1\nwhen_full = \"replace\"");
    let mut first = connect(port);
    assert!(is_served(&mut first));
    let mut second = connect(port);
    assert!(is_served(&mut second));
    assert!(is_closed(&mut first));
}

#[test]
fn only_networks_on_the_list_may_connect() {
    let (_daemon, port) = start("allow = [\"127.0.0.2\", \"10.0.0.0/8\"]");
    assert!(is_closed(&mut connect(port)));
    let (_daemon, port) = start("allow = \"127.0.0.0/8\"\nread_only = \"127.0.0.1\"");
    let mut reader = connect(port);
    assert!(is_served(&mut reader));
    reader.write_all(&[0, 1, 0, 0, 0, 6, 1, 6, 0x10, 2, 0, 6]).unwrap();
    let mut answer = [0; 9];
    reader.read_exact(&mut answer).unwrap();
    assert_eq!(answer, [0, 1, 0, 0, 0, 3, 1, 0x86, 2]);
}

#[test]
fn a_silent_client_is_sent_away() {
    let (_daemon, port) = start("idle_timeout_s = 1");
    let mut silent = connect(port);
    assert!(is_served(&mut silent));
    silent.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    assert!(is_closed(&mut silent));
}

#[test]
fn a_length_that_no_frame_has_ends_the_connection_after_the_answers_before() {
    let (_daemon, port) = start("");
    let mut client = connect(port);
    client.write_all(&[&READ[..], &[0, 1, 0, 0, 0xFF, 0xFF, 1, 3]].concat()).unwrap();
    let mut answer = [0; ANSWER.len()];
    client.read_exact(&mut answer).unwrap();
    assert_eq!(answer, ANSWER);
    assert!(is_closed(&mut client));
}

#[test]
fn a_client_that_ends_its_requests_gets_all_answers_before_its_connection_ends() {
    let (_daemon, port) = start("");
    // One that ends with its requests, one that has got its answer, one that has asked for nothing.
    for (requests, is_answered_before) in [(1000, false), (1, true), (0, false)] {
        let mut client = connect(port);
        client.write_all(&READ.repeat(requests)).unwrap();
        let mut answers = vec![0; requests * ANSWER.len()];
        if is_answered_before {
            client.read_exact(&mut answers).unwrap();
        }
        client.shutdown(Shutdown::Write).unwrap();
        if !is_answered_before {
            client.read_exact(&mut answers).unwrap();
        }
        assert!(answers.chunks(ANSWER.len()).all(|answer| answer == ANSWER));
        assert!(is_closed(&mut client));
    }
}

#[test]
fn axisctl_shows_clients_owners_and_who_commanded() {
    let (dir, port) = (TempDir::new(), free_port());
    let socket = dir.path().join("control.sock").display().to_string();
    let text = format!(
        "[control]\nsocket = \"{socket}\"\n[modbus]\nlisten = \"127.0.0.1:{port}\"\n{}owner = \"modbus\"\n",
        config(Bus::Virtual, &[("axis1", "cia402-servo", 1)])
    );
    let _daemon = Daemon::start(&text);
    let mut client = connect(port);
    assert!(is_served(&mut client));
    client.write_all(&[0, 1, 0, 0, 0, 6, 1, 6, 0x10, 2, 0, 6]).unwrap();
    client.read_exact(&mut [0; 12]).unwrap();
    client.write_all(&[0, 1, 0, 0, 0, 6, 1, 3, 0xFF, 0, 0, 1]).unwrap();
    client.read_exact(&mut [0; 9]).unwrap();

    let output = axisctl(&["--socket", &socket, "status"]);

    let text = String::from_utf8(output.stdout).unwrap();
    let has = |parts: &[&str]| text.lines().any(|line| line.split_whitespace().collect::<Vec<_>>() == parts);
    assert!(has(&[&format!("127.0.0.1:{port}"), "1", "1", "0", "0", "0"]), "{text}");
    let peer = client.local_addr().unwrap().to_string();
    let line = text.lines().find(|line| line.starts_with(&peer)).unwrap_or_else(|| panic!("{text}"));
    assert!(line.split_whitespace().rev().take(3).eq(["0", "1", "3"]), "{text}");
    assert!(text.contains("axis1, axis 1: commanded by modbus alone"), "{text}");
    assert!(text.contains(&format!("modbus {peer}: 0x6040:00 = 0x6 (1 times)")), "{text}");
}

#[test]
fn a_port_that_is_taken_is_said() {
    let port = free_port();
    let _taken = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, port)).unwrap();
    let dir = TempDir::new();
    let file = dir.write("axisd.toml", &format!("[modbus]\nlisten = \"127.0.0.1:{port}\"\n"));
    let output = tests::axisd(&["run", "--config", file.to_str().unwrap()]);
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains(&format!("cannot serve Modbus on 127.0.0.1:{port}")), "{text}");
}
