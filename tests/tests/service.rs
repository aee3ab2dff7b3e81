//! What concerns the daemon as a service, each seen from outside: configuration, log, metrics, real-time scheduling and the
//! audit trail.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::MetadataExt;
use std::thread;
use std::time::{Duration, Instant};

use tests::{Bus, Client, Daemon, PATIENCE, TempDir, axisctl, axisd, config, free_port, run_python};

/// What `axisd check` with these arguments prints, for a file of this text.
fn check(text: &str, arguments: &[&str]) -> String {
    let dir = TempDir::new();
    let file = dir.write("axisd.toml", text);
    let output = axisd(&[&["check"], arguments, &[file.to_str().expect("UTF-8")]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The metrics page at this port.
fn metrics(port: u16) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("metrics are served");
    stream.set_read_timeout(Some(PATIENCE)).expect("set a time-out");
    stream.write_all(b"GET /metrics HTTP/1.0\r\n\r\n").expect("send a request");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head and a body");
    assert!(head.starts_with("HTTP/1.0 200 OK"), "{head}");
    body.to_owned()
}

/// Waits until `is_so`.
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
        thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_configuration_is_explained_with_all_that_it_leaves_to_defaults() {
    let text = include_str!("../../config/examples/service.toml");
    let explained = check(text, &["--explain"]);
    for line in [
        "  - name: can0, link: socketcan:can0, bit_rate_kbit_s: -, socketcand: -, gateway: -",
        "    profile: cia402-servo",
        "      max_speed_rpm: 3000",
        "      - bus: can0, node_id: 1",
        "    unit_id: 1",
        "      - object: 0x607D:01, name: Min position limit, value: -100000",
        "      - object: 0x1400:01, name: COB-ID used by RPDO, value: $NODEID+0x200",
        "storage: /var/lib/axisd",
        "metrics: http://127.0.0.1:9464/metrics",
        "  priority: 50",
    ] {
        assert!(explained.lines().any(|known| known == line), "{line}\n{explained}");
    }
    let json = check(text, &["--explain", "--json"]);
    let told = run_python(&format!(
        "import json\ne = json.loads(r'''{json}''')\nd = e['devices'][0]\n\
         print(d['motor']['raster_ns'], d['nodes'], len(d['limits']), e['audit']['files'])"
    ));
    assert_eq!(told.trim(), "1000000 [{'bus': 'can0', 'node_id': 1}] 9 8");
}

#[test]
fn a_mapping_that_the_node_refuses_is_found_by_check() {
    let text =
        config(Bus::Virtual, &[("x", "cia402-servo", 1)]) + "[device.objects]\n\"0x1600:01\" = 0x60410010\n";
    let dir = TempDir::new();
    let file = dir.write("axisd.toml", &text);
    let output = axisd(&["check", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(78));
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("device `x`: the default mapping of RPDO 1 is refused"), "{told}");
}

#[test]
fn metrics_are_what_a_stranger_can_parse_and_counts_are_right() {
    let (port, page) = (free_port(), free_port());
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1), ("y", "jvl-mac00-fc4", 2)]);
    let _daemon = Daemon::start(&format!("[metrics]\nlisten = \"127.0.0.1:{page}\"\n{config}"));
    let mut client = Client::raw(port);
    for _ in 0..5 {
        let answer = client.try_ask("601 8 40 0 10 0 0 0 0 0").expect("the daemon is there");
        assert!(answer.starts_with("581 43"), "{answer}");
    }
    let page = metrics(page);
    let dir = TempDir::new();
    let file = dir.write("page", &page);
    let told = run_python(&format!(
        "from prometheus_client.parser import text_string_to_metric_families as parse\n\
         families = {{f.name: f for f in parse(open({file:?}).read())}}\n\
         def value(name, **labels):\n    \
             return [s.value for s in families[name].samples if labels.items() <= s.labels.items()][0]\n\
         assert all(f.type != 'unknown' and f.documentation for f in families.values())\n\
         print(value('axisd_node_frames', device='x', kind='sdo-request'),\n      \
               value('axisd_node_frames', device='x', kind='sdo-answer'),\n      \
               value('axisd_bus_frames', direction='received', kind='sdo'),\n      \
               value('axisd_axis_state', device='y', state='SWITCH ON DISABLED'),\n      \
               families['axisd_core_turn_seconds'].type)"
    ));
    assert_eq!(told.trim(), "5 5 5 1 histogram", "{page}");
}

#[test]
fn who_commanded_what_is_on_disk_when_the_daemon_is_gone() {
    let (port, storage) = (free_port(), TempDir::new());
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&format!("[storage]\npath = \"{}\"\n{config}", storage.path().display()));
    let mut client = Client::raw(port);
    assert!(client.try_ask("601 8 2B 40 60 0 6 0 0 0").expect("an answer").starts_with("581 60"));
    client.send("< send 0 2 1 0 >");
    // Controlword and target position by RPDO 3.
    client.send("< send 401 6 7 0 5 0 0 0 >");
    assert!(client.try_ask("601 8 2B 40 60 0 6 0 0 0").is_ok());
    let file = storage.path().join("audit/audit-00000001.jsonl");
    assert!(client.try_ask("601 8 2F 60 60 0 63 0 0 0").is_ok());
    wait_until("a refused command", || fs::read_to_string(&file).is_ok_and(|text| text.contains("refused")));
    daemon.terminate();
    daemon.wait_until_stopped();
    // The stream may be over before or after the last commands.
    let told = run_python(&format!(
        "import json\n\
         for e in map(json.loads, open({:?})):\n    \
             what = e.get('name') or e['order']\n    \
             if e['event'] != 'stream-end':\n        \
                 print(e['event'], e['device'], e['by']['bus'], what, e.get('value'), e.get('code', ''))",
        file.display().to_string()
    ));
    let lines: Vec<&str> = told.lines().map(str::trim_end).collect();
    assert_eq!(
        lines,
        [
            "write x can0 Controlword 6",
            "nmt x can0 start None",
            "change x can0 Controlword 7",
            "stream-start x can0 Target position 5",
            "write x can0 Controlword 6",
            "refused x can0 Modes of operation 99 0x06090030",
        ]
    );
}

#[test]
fn what_is_stored_comes_before_a_default_of_the_configuration() {
    let (port, storage) = (free_port(), TempDir::new());
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let config = format!(
        "[storage]\npath = \"{}\"\n{config}[device.objects]\n\"0x6081\" = 0x123\n",
        storage.path().display()
    );
    let read = |client: &mut Client| client.try_ask("601 8 40 81 60 0 0 0 0 0").expect("an answer");
    let daemon = Daemon::start(&config);
    let mut client = Client::raw(port);
    assert_eq!(read(&mut client), "581 4381600023010000");
    assert!(client.try_ask("601 8 23 81 60 0 7 0 0 0").expect("an answer").starts_with("581 60"));
    assert!(client.try_ask("601 8 23 10 10 1 73 61 76 65").expect("an answer").starts_with("581 60"));
    drop(daemon);
    let _daemon = Daemon::start(&config);
    let mut client = Client::raw(port);
    assert_eq!(read(&mut client), "581 4381600007000000");
    // 0x1011: what the configuration says comes back with the next reset.
    assert!(client.try_ask("601 8 23 11 10 1 6C 6F 61 64").expect("an answer").starts_with("581 60"));
    client.send("< send 0 2 81 1 >");
    while !client.frame().starts_with("701 00") {}
    assert_eq!(read(&mut client), "581 4381600023010000");
}

#[test]
fn the_log_speaks_json_with_fields() {
    let port = free_port();
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&format!("[log]\nformat = \"json\"\n{config}"));
    daemon.logged(r#""message":"x: PRE-OPERATIONAL","device":"x","target":"device"}"#);
}

#[test]
fn modules_of_the_log_can_be_silent() {
    let port = free_port();
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&format!("[log.modules]\ndevice = \"off\"\n{config}"));
    let mut client = Client::raw(port);
    client.send("< send 0 2 1 0 >");
    assert!(client.try_ask("601 8 40 0 10 0 0 0 0 0").is_ok());
    daemon.terminate();
    daemon.logged("stopped");
    assert!(!daemon.printed().contains("OPERATIONAL"), "{}", daemon.printed());
    daemon.wait_until_stopped();
}

#[test]
fn axisctl_changes_the_log_at_run_time_and_shows_the_trail() {
    let (port, storage) = (free_port(), TempDir::new());
    let socket = storage.path().join("control.sock");
    let config = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&format!(
        "[control]\nsocket = \"{}\"\n[storage]\npath = \"{}\"\n{config}",
        socket.display(),
        storage.path().display()
    ));
    let socket = socket.to_str().expect("UTF-8");
    let ask = |arguments: &[&str]| {
        let output = axisctl(&[&["--socket", socket], arguments].concat());
        (
            output.status.success(),
            String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned(),
        )
    };
    assert_eq!(ask(&["log", "--json"]).1.matches("\"info\"").count(), 6);
    let (is_done, levels) = ask(&["log", "device=off"]);
    assert!(is_done && levels.contains("device   off"), "{levels}");
    let (is_done, refusal) = ask(&["log", "loud"]);
    assert!(!is_done && refusal.contains("no level `loud`; there are: off, error"), "{refusal}");
    let mut client = Client::raw(port);
    assert!(client.try_ask("601 8 2B 40 60 0 6 0 0 0").expect("an answer").starts_with("581 60"));
    client.send("< send 0 2 1 0 >");
    let trail = || ask(&["audit"]).1;
    wait_until("two entries", || trail().lines().count() == 3);
    assert!(trail().contains("0x6040:00 Controlword") && trail().contains("start, all nodes"), "{}", trail());
    assert!(ask(&["stop", "x"]).0);
    let own = fs::metadata("/proc/self").expect("this runs").uid();
    let is_stop = |line: &str| line.contains("  stop") && line.contains(&format!("  uid {own}  "));
    wait_until("the stop, and who gave it", || trail().lines().any(is_stop));
    daemon.terminate();
    daemon.logged("stopped");
    assert!(!daemon.printed().contains("x: OPERATIONAL"), "{}", daemon.printed());
    daemon.wait_until_stopped();
}

#[test]
fn the_core_thread_runs_where_it_is_told_to_and_the_others_everywhere() {
    let own = fs::read_to_string("/proc/self/status").expect("this runs");
    let own =
        own.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("it says so").trim();
    let cpu = own.split([',', '-']).next().expect("there is a processor");
    let config = config(Bus::Virtual, &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&format!(
        "[realtime]\ncpus = [{cpu}]\npriority = 5\nlock_memory = true\n[metrics]\nlisten = \"127.0.0.1:0\"\n{config}"
    ));
    daemon.logged("real time: ");
    let status = |thread: &str| {
        let text =
            fs::read_to_string(format!("/proc/{}/task/{thread}/status", daemon.id())).expect("it runs");
        let line = text.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("it says so");
        line.trim().to_owned()
    };
    let core = daemon.id().to_string();
    assert_eq!(status(&core), "0");
    let own = fs::read_to_string("/proc/self/status").expect("this runs");
    let own =
        own.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("it says so").trim();
    let threads = fs::read_dir(format!("/proc/{core}/task")).expect("it has threads");
    let names: Vec<String> = threads
        .map(|thread| thread.expect("it is there").file_name().into_string().expect("a number"))
        .collect();
    assert!(names.len() > 1);
    for other in names.iter().filter(|name| **name != core) {
        assert_eq!(status(other), own);
    }
}
