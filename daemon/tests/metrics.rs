//! Metrics over HTTP, with a core loop that the test plays.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use daemon::alarm::Alarm;
use daemon::control::board;
use daemon::latency::Histogram;
use daemon::reload::Report;
use daemon::status::{Axis, Bus, Device, Fault, Histograms, Listener, Modbus, Node, Status};
use daemon::{metrics, services};
use od::Instant;

const PATIENCE: Duration = Duration::from_secs(10);

/// Served metrics and a core loop that gives out a status whenever somebody asks.
struct Server {
    address: SocketAddr,
    is_over: Arc<AtomicBool>,
    core: Option<JoinHandle<u32>>,
}

impl Server {
    fn start(status: Status) -> Self {
        let alarm = Alarm::new().unwrap();
        let (mut publisher, reader) = board(alarm.bell());
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        services::serve(|| metrics::serve(listener, reader)).unwrap();
        let is_over = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&is_over);
        let core = thread::spawn(move || {
            let (mut now, mut published) = (Instant::ZERO, 0);
            while !over.load(Ordering::Relaxed) {
                now = now + Duration::from_millis(100);
                if publisher.is_wanted(now) {
                    publisher.publish(now, status.clone());
                    published += 1;
                }
                thread::sleep(Duration::from_millis(1));
            }
            drop(alarm);
            published
        });
        Self { address, is_over, core: Some(core) }
    }

    /// The answer to a request, which is the last one of its connection.
    fn ask(&self, request: &str) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    fn get(&self, path: &str) -> String {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"))
    }

    /// Ends it; how often it gave out a status.
    fn stop(mut self) -> u32 {
        self.is_over.store(true, Ordering::Relaxed);
        self.core.take().unwrap().join().unwrap()
    }
}

fn status() -> Status {
    let mut lateness = Histogram::default();
    [5, 300, 700].into_iter().for_each(|micros| lateness.record(Duration::from_micros(micros)));
    let axis = Axis {
        state: "OPERATION ENABLED".to_owned(),
        position_counts: -1.5,
        fault: Some(Fault { code: 0x8611, text: String::new() }),
        ..Axis::default()
    };
    let node = Node { bus: "can\"0\"".to_owned(), node_id: 7, ..Node::default() };
    let device = Device { name: "x".to_owned(), axes: vec![axis], nodes: vec![node], ..Device::default() };
    let received_kinds = [("sdo".to_owned(), 3)].into();
    let bus = Bus { name: "can\"0\"".to_owned(), received_kinds, unsent: 4, ..Bus::default() };
    Status {
        buses: vec![bus],
        devices: vec![device],
        histograms: Histograms {
            sdo: vec![("can0".to_owned(), lateness.clone())],
            lateness,
            ..Histograms::default()
        },
        ..Status::default()
    }
}

#[test]
fn metrics_say_what_the_status_says() {
    let text = metrics::text(&status());
    for line in [
        "axisd_bus_frames_total{bus=\"can\\\"0\\\"\",direction=\"received\",kind=\"sdo\"} 3",
        "axisd_bus_errors_total{bus=\"can\\\"0\\\"\",kind=\"unsent\"} 4",
        "axisd_axis_position_counts{device=\"x\",axis=\"1\"} -1.5",
        "axisd_axis_fault_code{device=\"x\",axis=\"1\"} 34321",
        "axisd_core_overruns_total 1",
        "axisd_core_lateness_seconds_bucket{le=\"0.000010000\"} 1",
        "axisd_core_lateness_seconds_bucket{le=\"0.000500000\"} 2",
        "axisd_core_lateness_seconds_bucket{le=\"+Inf\"} 3",
        "axisd_sdo_latency_seconds_count{bus=\"can0\"} 3",
    ] {
        assert!(text.lines().any(|known| known == line), "{line}\n{text}");
    }
}

#[test]
fn every_metric_is_in_the_document_and_no_other_one() {
    let status = status();
    let (turns, pieces) = (Some(Histogram::default()), Some(Histogram::default()));
    let histograms = Histograms { turns, pieces, ..status.histograms.clone() };
    let modbus = Modbus { listeners: vec![Listener::default()], ..Modbus::default() };
    let reload = Some(Report::default());
    let page = metrics::text(&Status { histograms, modbus, lost_audit: Some(0), reload, ..status });
    let told: BTreeSet<&str> =
        page.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next()).collect();
    let document = include_str!("../../docs/operation.md");
    let documented: BTreeSet<&str> =
        document.lines().filter_map(|line| line.strip_prefix("| `axisd_")?.split('`').next()).collect();
    let told: BTreeSet<&str> = told.iter().filter_map(|name| name.strip_prefix("axisd_")).collect();
    assert_eq!(told, documented);
}

#[test]
fn metrics_are_served_while_somebody_asks() {
    let server = Server::start(status());
    let answer = server.get("/metrics");
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    assert!(head.contains("content-type: text/plain; version=0.0.4; charset=utf-8"), "{head}");
    assert_eq!(body, metrics::text(&status()));
    assert_eq!(server.stop(), 1);
}

#[test]
fn other_requests_have_clear_answers_and_cost_the_core_nothing() {
    let server = Server::start(status());
    assert!(server.get("/").starts_with("HTTP/1.1 404 "));
    assert!(
        server
            .ask("POST /metrics HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
            .starts_with("HTTP/1.1 405 ")
    );
    assert!(server.ask("nonsense\r\n\r\n").starts_with("HTTP/1.1 400 "));
    let long = format!("GET /metrics HTTP/1.1\r\nHost: x\r\nX: {}\r\n\r\n", "y".repeat(20_000));
    assert!(server.ask(&long).starts_with("HTTP/1.1 431 "));
    assert_eq!(server.stop(), 0);
}

#[test]
fn more_clients_than_there_are_places_for_are_sent_away_and_later_ones_served() {
    let server = Server::start(status());
    let idle: Vec<_> = (0..8).map(|_| TcpStream::connect(server.address).unwrap()).collect();
    // The places are taken in the order of connecting.
    let mut late = TcpStream::connect(server.address).unwrap();
    late.set_read_timeout(Some(PATIENCE)).unwrap();
    assert_eq!(late.read(&mut [0; 16]).unwrap_or(0), 0, "it is closed");
    drop(idle);
    let served = (0..100).any(|_| {
        thread::sleep(Duration::from_millis(20));
        let mut stream = TcpStream::connect(server.address).unwrap();
        let _ = stream.write_all(b"GET /metrics HTTP/1.0\r\n\r\n");
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer.starts_with("HTTP/1.0 200 ")
    });
    assert!(served);
    server.stop();
}
