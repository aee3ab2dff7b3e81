//! Every verb of `axisctl` against a running daemon, and that no axis outlives its operator.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tests::{Bus, Client, Daemon, TempDir, axisctl, axisctl_command, config, free_port, run_python};

const PATIENCE: Duration = Duration::from_secs(30);

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The demo with a socket and a store of its own, and where the socket is.
fn demo(dir: &TempDir) -> (Daemon, String) {
    let socket = dir.path().join("control.sock").display().to_string();
    let store = dir.path().join("store").display().to_string();
    let text = fs::read_to_string(root().join("config/examples/demo.toml")).unwrap();
    let text = text.replace("127.0.0.1:29536\"\n\n", &format!("127.0.0.1:{}\"\n\n", free_port()));
    let daemon = Daemon::start(&format!(
        "[control]\nsocket = \"{socket}\"\n\n[storage]\npath = \"{store}\"\n\n{text}"
    ));
    (daemon, socket)
}

/// What a command prints: standard output, and what the program itself says on standard error.
fn said(output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let own = errors.lines().filter(|line| line.starts_with("axisctl: ")).map(|line| format!("{line}\n"));
    String::from_utf8_lossy(&output.stdout).into_owned() + &own.collect::<String>()
}

/// A text without its numbers and its widths.
fn shape(text: &str) -> String {
    let mut shape = String::new();
    for word in text.split_whitespace() {
        let mut rest = word;
        while let Some(c) = rest.chars().next() {
            let length = number(rest);
            shape.push(if length > 0 { '#' } else { c });
            rest = &rest[length.max(c.len_utf8())..];
        }
        shape.push(' ');
    }
    shape
}

/// The length of the number that `text` begins with: decimal with sign and point, or hexadecimal.
fn number(text: &str) -> usize {
    if let Some(digits) = text.strip_prefix("0x") {
        return 2 + digits.chars().take_while(char::is_ascii_hexdigit).count();
    }
    let unsigned = text.strip_prefix('-').unwrap_or(text);
    if !unsigned.starts_with(|c: char| c.is_ascii_digit()) {
        return 0;
    }
    let length = unsigned.chars().take_while(|c| c.is_ascii_digit() || *c == '.').count();
    text.len() - unsigned.len() + length
}

/// The words of a command line, with double quotes around those that have spaces.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    parts
        .flat_map(|(number, part)| match number % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        })
        .collect()
}

/// Runs the commands of a document one after the other.
struct Session {
    socket: String,
    background: Option<Child>,
    /// A device that can be asked.
    probe: &'static str,
}

impl Session {
    /// What the command `line` prints.
    fn run(&mut self, line: &str) -> String {
        if line == "wait" {
            return said(&self.background.take().expect("something runs").wait_with_output().unwrap());
        }
        let (line, in_background) = line.strip_suffix(" &").map_or((line, false), |line| (line, true));
        let words = words(line);
        assert_eq!(words[0], "axisctl", "{line}");
        let mut command = axisctl_command(&["--socket", &self.socket]);
        command.args(&words[1..]).current_dir(root());
        if in_background {
            let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
            self.background = Some(child);
            self.await_watcher();
            return String::new();
        }
        let output = command.output().unwrap();
        let text = said(&output);
        assert_eq!(output.status.success(), !text.starts_with("axisctl: "), "{line}: {text}");
        text
    }

    /// Waits until the watcher in the background is served: one more client can then see it in what it is shown.
    fn await_watcher(&self) {
        let child = self.background.as_ref().expect("something runs");
        let fd = format!("/proc/{}/fd", child.id());
        let deadline = Instant::now() + PATIENCE;
        let is_connected = || {
            fs::read_dir(&fd).is_ok_and(|fds| {
                let links = fds.filter_map(|entry| fs::read_link(entry.ok()?.path()).ok());
                links.filter(|link| link.to_string_lossy().starts_with("socket:")).count() > 0
            })
        };
        while !is_connected() {
            assert!(Instant::now() < deadline, "it does not connect");
            thread::sleep(Duration::from_millis(5));
        }
        // It has asked before anybody who asks now: errands are done in their order.
        let output = axisctl(&["--socket", &self.socket, "od", "read", self.probe, "6041"]);
        assert!(output.status.success());
    }
}

#[test]
fn every_verb_prints_json_and_long_ones_their_progress() {
    const VERBS: [&str; 25] = [
        "status",
        "watch --interval 0.05 --count 2",
        "od list axis1 velocity",
        "od read axis1 statusword",
        "od read axis1 6041",
        "od write axis1 0x6083:00 200000",
        "move axis1 20000 --velocity 20000",
        "jog axis1 1000 --time 0.5",
        "stop axis1",
        "home axis1 --method 33",
        "fault inject axis2 supply-dip:40",
        "fault list",
        "fault clear axis2 all",
        "nmt axis1 preop",
        "lss inquire 279:256:0x10003:0xA0C28D1F",
        "dump --file docs/candump.log --config config/examples/demo.toml",
        "claim axis1 --for local",
        "release axis1",
        "signal set axis1 analog-input:2.5",
        "signal list axis2",
        // A heartbeat each 20 ms.
        "od write axis1 0x1017 20",
        "dump --count 3",
        "log",
        "audit",
        "version",
    ];
    let dir = TempDir::new();
    let (mut daemon, socket) = demo(&dir);
    for (number, verb) in VERBS.into_iter().enumerate() {
        let mut command = axisctl_command(&["--socket", &socket, "--json"]);
        let output = command.args(verb.split(' ')).current_dir(root()).output().unwrap();
        assert!(output.status.success(), "{verb}: {output:?}");
        dir.write(&format!("{number}.json"), std::str::from_utf8(&output.stdout).unwrap());
    }
    daemon.terminate();
    daemon.wait_until_stopped();
    // The status is one object over several lines, all else an object or a list on each line.
    let told = run_python(&format!(
        "import json\n\
         for number, verb in enumerate({VERBS:?}):\n    \
             text = open(f'{}/{{number}}.json').read()\n    \
             answers = [json.loads(text)] if number == 0 else [json.loads(line) for line in text.splitlines()]\n    \
             assert answers, verb\n    \
             word = verb.split()[0]\n    \
             if word in ('move', 'jog'):\n        \
                 print(word, *(next(iter(answer)) for answer in (answers[0], answers[-1])))\n    \
             if word in ('claim', 'release', 'signal'):\n        \
                 print(word, *(list(axis.values()) for axis in answers[0]))\n    \
             if verb.startswith('dump --count'):\n        \
                 assert all(1.7e9 < frame['time'] < 1e10 for frame in answers), answers\n        \
                 print(word, *(frame['id'] + '#' + frame['data'] for frame in answers))",
        dir.path().display()
    ));
    assert_eq!(
        told.lines().collect::<Vec<_>>(),
        [
            "move progress done",
            "jog progress done",
            "claim ['axis1', 1, 'local']",
            "release ['axis1', 1, 'any']",
            "signal ['axis1', 1, 2.5, 0.0]",
            "signal ['axis2', 1, 0.0, 0.0]",
            "dump 701#7F 701#7F 701#7F",
        ]
    );
}

/// Every command of the documented session, and what it is said to print. `UPDATE_DOCS=1` writes down what it prints now.
#[test]
fn every_documented_command_does_what_the_document_says() {
    let path = root().join("docs/axisctl.md");
    let document = fs::read_to_string(&path).unwrap();
    let dir = TempDir::new();
    let (_daemon, socket) = demo(&dir);
    let mut session = Session { socket, background: None, probe: "axis1" };
    let (mut renewed, mut verbs) = (String::new(), Vec::new());
    for (number, part) in document.split("```").enumerate() {
        let is_session = number % 2 == 1 && part.starts_with("console\n");
        if !is_session {
            renewed += &format!("{}{part}", if number == 0 { "" } else { "```" });
            continue;
        }
        renewed += "```console\n";
        for block in part.trim_start_matches("console\n").split("$ ").skip(1) {
            let (command, documented) = block.split_once('\n').expect("a command has its line");
            let printed = session.run(command);
            verbs.extend(words(command).get(1).cloned());
            renewed += &format!("$ {command}\n{printed}");
            if std::env::var_os("UPDATE_DOCS").is_none() {
                assert_eq!(shape(&printed), shape(documented), "$ {command}\n{printed}");
            }
        }
    }
    for verb in [
        "status", "watch", "od", "move", "jog", "home", "stop", "claim", "release", "nmt", "lss", "dump",
        "fault", "version",
    ] {
        assert!(verbs.iter().any(|known| known == verb), "{verb} is not documented");
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, renewed).unwrap();
    }
}

/// The actual position of `axis1`.
fn position(socket: &str) -> i64 {
    let output = axisctl(&["--socket", socket, "od", "read", "axis1", "6064", "--json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let value = text.split("\"value\":").nth(1).unwrap_or_else(|| panic!("{text}"));
    value.split([',', '}']).next().unwrap().parse().unwrap()
}

/// Waits until the axis is not where it was, or is.
fn wait_until(socket: &str, is_moving: bool) {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let before = position(socket);
        thread::sleep(Duration::from_millis(200));
        let distance = (position(socket) - before).abs();
        if (distance > 50) == is_moving {
            return;
        }
        assert!(Instant::now() < deadline, "is_moving: {is_moving}, {distance}");
    }
}

/// A jog of `axis1` that runs.
fn jog(socket: &str) -> Child {
    let mut command =
        axisctl_command(&["--socket", socket, "jog", "axis1", "5000", "--acceleration", "50000"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(socket, true);
    child
}

fn signal(child: &Child, signal: Signal) {
    kill(Pid::from_raw(child.id() as i32), signal).unwrap();
}

#[test]
fn a_jog_ends_with_its_operator_however_that_ends() {
    let dir = TempDir::new();
    let (_daemon, socket) = demo(&dir);

    let interrupted = jog(&socket);
    signal(&interrupted, Signal::SIGINT);
    let output = interrupted.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(said(&output).starts_with("axis1, axis 1: stopped, OPERATION ENABLED; position "), "{output:?}");
    wait_until(&socket, false);

    let mut killed = jog(&socket);
    signal(&killed, Signal::SIGKILL);
    killed.wait().unwrap();
    wait_until(&socket, false);

    // One that is there and does nothing is as good as none.
    let mut stopped = jog(&socket);
    signal(&stopped, Signal::SIGSTOP);
    wait_until(&socket, false);
    signal(&stopped, Signal::SIGKILL);
    stopped.wait().unwrap();
}

#[test]
fn a_move_that_is_interrupted_halts_and_fails() {
    let dir = TempDir::new();
    let (_daemon, socket) = demo(&dir);
    let mut command =
        axisctl_command(&["--socket", &socket, "--json", "move", "axis1", "10000000", "--velocity", "5000"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(&socket, true);
    signal(&child, Signal::SIGTERM);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let lines = String::from_utf8(output.stdout).unwrap();
    assert!(
        lines.lines().next().unwrap().starts_with("{\"progress\":{\"device\":\"axis1\",\"axis\":1,"),
        "{lines}"
    );
    assert!(lines.lines().last().unwrap().starts_with("{\"error\":\"axis1: interrupted"), "{lines}");
    wait_until(&socket, false);
}

#[test]
fn an_axis_is_claimed_for_one_read_by_all_stopped_by_the_operator_and_released() {
    let (port, dir) = (free_port(), TempDir::new());
    let socket = dir.path().join("control.sock").display().to_string();
    let config = config(Bus::Socketcand(port), &[("axis1", "jvl-mac00-fc4", 1)]);
    let _daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let ask = |arguments: &[&str]| said(&axisctl(&[&["--socket", &socket], arguments].concat()));
    let mut master = Client::raw(port);
    let mut shut_down = || {
        master.send("< send 601 8 2B 40 60 0 6 0 0 0 >");
        master.frame()
    };
    let mut running = jog(&socket);

    assert!(ask(&["claim", "axis1", "--for", "can0"]).ends_with("1  can0\n"));

    for order in [&["move", "axis1", "0"][..], &["od", "write", "axis1", "controlword", "6"]] {
        assert!(ask(order).contains("0x08000022"), "{order:?}");
    }
    assert!(ask(&["od", "read", "axis1", "controlword"]).contains("15 (0x000F)"), "everybody reads");
    assert!(ask(&["status"]).contains("axis1, axis 1: commanded by can0 alone"));
    let stopped = ask(&["stop", "axis1"]);
    assert!(stopped.starts_with("axis1, axis 1: stopped, SWITCH ON DISABLED"), "{stopped}");
    assert!(!running.wait().unwrap().success(), "the jog tells that it was stopped");
    assert_eq!(shut_down(), "581 6040600000000000");

    assert!(ask(&["claim", "axis1", "--axis", "1", "--for", "local"]).ends_with("1  local\n"));
    assert_eq!(shut_down(), "581 8040600022000008");
    assert!(ask(&["move", "axis1", "100", "--relative", "--velocity", "50000"]).contains("target reached"));

    assert!(ask(&["release", "axis1"]).ends_with("1  any\n"));
    assert_eq!(shut_down(), "581 6040600000000000");
    assert!(!ask(&["status"]).contains("commanded by"));
}

#[test]
fn a_watch_ends_well_when_the_daemon_ends() {
    let dir = TempDir::new();
    let (mut daemon, socket) = demo(&dir);
    let mut command = axisctl_command(&["--socket", &socket, "watch", "--interval", "0.05", "--json"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    let first: Vec<_> = lines.by_ref().take(2).collect();
    daemon.terminate();
    daemon.wait_until_stopped();
    let rest: Vec<_> = lines.collect();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(String::from_utf8_lossy(&output.stderr), "axisctl: the daemon has ended\n");
    assert_eq!(first.len(), 2);
    for line in first.iter().chain(&rest) {
        assert!(line.starts_with("{\"version\":"), "{line}");
    }
}

#[test]
fn a_watcher_reads_every_pdo_by_the_mapping_it_was_sent_with() {
    let dir = TempDir::new();
    let socket = dir.path().join("control.sock").display().to_string();
    let config = config(Bus::Virtual, &[("drive", "cia402-servo", 2)]);
    let _daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let run = |arguments: &[&str]| {
        let output = axisctl(&[&["--socket", &socket], arguments].concat());
        assert!(output.status.success(), "{output:?}");
    };
    let mut session = Session { socket: socket.clone(), background: None, probe: "drive" };
    session.run("axisctl dump --count 2 &");

    // TPDO 1 is to carry the position.
    for (object, value) in [
        ("1800:1", "0xC0000182"),
        ("1A00:0", "0"),
        ("1A00:1", "0x60640020"),
        ("1A00:0", "1"),
        ("1800:1", "0x40000182"),
    ] {
        run(&["od", "write", "drive", object, value]);
    }
    run(&["nmt", "drive", "start"]);

    let told = session.run("wait");
    assert!(
        told.contains("NMT start, drive (2)") && told.contains("TPDO1 drive (2): Position actual value = 0"),
        "{told}"
    );
}

#[test]
fn parameters_are_stored_by_an_operator() {
    let dir = TempDir::new();
    let (_daemon, socket) = demo(&dir);
    let od = |arguments: &[&str]| {
        let output = axisctl(&[&["--socket", &socket, "od"], arguments].concat());
        assert!(output.status.success(), "{output:?}");
    };
    od(&["write", "axis1", "0x1017", "500"]);
    od(&["write", "axis1", "1010:1", "save"]);
    // It is there when the answer is.
    assert!(fs::read_dir(dir.path().join("store")).unwrap().count() >= 2);
}

#[test]
fn slaves_on_a_bus_are_numbered_by_an_operator() {
    let dir = TempDir::new();
    let socket = dir.path().join("control.sock").display().to_string();
    let store = dir.path().join("store").display().to_string();
    let devices = [("first", "canopen-reference", 255), ("second", "canopen-reference", 255)];
    let config = config(Bus::Virtual, &devices);
    let head = format!("[control]\nsocket = \"{socket}\"\n\n[storage]\npath = \"{store}\"\n\n");
    let _daemon = Daemon::start(&(head + &config));
    let lss = |arguments: &[&str]| {
        let output = axisctl(&[&["--socket", &socket, "lss"], arguments].concat());
        (output.status.code(), said(&output))
    };

    for node_id in ["10", "11"] {
        let (code, text) = lss(&["configure", node_id]);
        assert!(code == Some(0) && text.trim_end().ends_with(node_id), "{text}");
    }

    assert_eq!(lss(&["scan"]), (Some(1), "axisctl: no slave answers\n".to_owned()));
    let output = axisctl(&["--socket", &socket, "status"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("can0/10  PRE-OPERATIONAL") && text.contains("can0/11  PRE-OPERATIONAL"), "{text}");
}
