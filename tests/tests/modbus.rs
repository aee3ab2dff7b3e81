//! Modbus clients that are not ours: each reads, writes and moves an axis.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use tests::{Bus, Daemon, PATIENCE, TempDir, axisd, config, free_port, run_peer};
use tokio_modbus::client::{Context, tcp};
use tokio_modbus::prelude::{Reader, Slave, Writer};

const OBJECTS: [(&str, &str); 7] = [
    ("controlword", "0x6040:00"),
    ("statusword", "0x6041:00"),
    ("mode", "0x6060:00"),
    ("position", "0x6064:00"),
    ("target", "0x607A:00"),
    ("velocity", "0x6081:00"),
    ("acceleration", "0x6083:00"),
];

/// A servo, reached by Modbus at a port.
struct Servo {
    _daemon: Daemon,
    port: u16,
    registers: BTreeMap<&'static str, u16>,
}

impl Servo {
    fn start() -> Self {
        let port = free_port();
        let text = format!(
            "[modbus]\nlisten = \"127.0.0.1:{port}\"\n\n{}",
            config(Bus::Virtual, &[("axis1", "cia402-servo", 1)])
        );
        Self { registers: registers(&text), _daemon: Daemon::start(&text), port }
    }

    fn at(&self, name: &str) -> String {
        self.registers[name].to_string()
    }
}

/// Where `axisd registers` says the objects are.
fn registers(text: &str) -> BTreeMap<&'static str, u16> {
    let dir = TempDir::new();
    let file = dir.write("axisd.toml", text);
    let output = axisd(&["registers", "--config", file.to_str().unwrap(), "--device", "axis1"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8(output.stdout).unwrap();
    let find = |object: &str| {
        let line = table.lines().find(|line| line.split_whitespace().nth(3) == Some(object)).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    OBJECTS.into_iter().map(|(name, object)| (name, find(object))).collect()
}

#[test]
fn pymodbus_moves_an_axis() {
    let servo = Servo::start();
    let mut arguments = vec![servo.port.to_string()];
    arguments.extend(servo.registers.iter().map(|(name, address)| format!("{name}={address}")));
    insta::assert_snapshot!(run_peer("modbus_pymodbus", &arguments), @r"
    identification 1: 3 objects
    identification 2: 7 objects
    identification 3: 10 objects
    name: axis1
    server: 01 ff
    echo: b'\xa57'
    coils: [True, True, False, True, False]
    inputs: 32
    enabled
    moved to the target
    switched off
    missing: exception 2
    read only: exception 2
    half a value: exception 3
    nobody: exception 11
    ");
}

#[test]
fn libmodbus_moves_an_axis() {
    let dir = TempDir::new();
    let program = dir.path().join("modbus_libmodbus");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/modbus_libmodbus.c");
    let flags = run(Command::new("pkg-config").args(["--cflags", "--libs", "libmodbus"]));
    let mut cc = Command::new("cc");
    cc.args(["-Wall", "-Wextra", "-Werror", "-o"]).arg(&program).arg(source).args(flags.split_whitespace());
    run(&mut cc);
    let servo = Servo::start();
    let addresses = OBJECTS.map(|(name, _)| servo.at(name));
    let story = run(Command::new(&program).arg(servo.port.to_string()).args(addresses));
    insta::assert_snapshot!(story, @r"
    coils: 1101
    inputs: 32
    enabled
    moved to the target
    switched off
    missing: Illegal data address
    read only: Illegal data address
    half a value: Illegal data value
    nobody: Target device failed to respond
    ");
}

#[test]
fn mbpoll_moves_an_axis() {
    let servo = Servo::start();
    // Addresses from zero, one look, quiet.
    let mbpoll = |arguments: &[&str]| {
        let port = servo.port.to_string();
        let mut command = Command::new("mbpoll");
        command.args(["-m", "tcp", "-p", &port, "-a", "1", "-0", "-1", "-q"]).args(arguments);
        run(&mut command)
    };
    let write = |name: &str, kind: &str, value: &str| {
        mbpoll(&["-t", kind, "-r", &servo.at(name), "127.0.0.1", "--", value]);
    };
    // `[4164]: 	1234 (-5678)`
    let read = |name: &str, kind: &str| -> i64 {
        let text = mbpoll(&["-t", kind, "-r", &servo.at(name), "127.0.0.1"]);
        let line = text.lines().find(|line| line.starts_with('[')).unwrap_or_else(|| panic!("{text}"));
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    write("velocity", "4:int", "20000");
    write("acceleration", "4:int", "200000");
    write("mode", "4", "1");
    for (controlword, state) in [("6", 0x21), ("7", 0x23), ("15", 0x27)] {
        write("controlword", "4", controlword);
        wait_until(|| read("statusword", "4") & 0x6F == state);
    }
    write("target", "4:int", "10000");
    write("controlword", "4", "31");
    wait_until(|| (9_950..=10_050).contains(&read("position", "4:int")));
    // Coil 16 and the inputs.
    mbpoll(&["-t", "0", "-r", "16", "127.0.0.1", "--", "1"]);
    assert!(mbpoll(&["-t", "0", "-r", "16", "127.0.0.1"]).contains("[16]: \t1"));
    assert!(mbpoll(&["-t", "1", "-r", "0", "-c", "32", "127.0.0.1"]).contains("[31]:"));
}

#[tokio::test]
async fn tokio_modbus_moves_an_axis() {
    let servo = Servo::start();
    let address: SocketAddr = format!("127.0.0.1:{}", servo.port).parse().unwrap();
    let mut client = tcp::connect_slave(address, Slave(1)).await.unwrap();
    let at = |name: &str| servo.registers[name];
    let low_first = |value: i32| [value as u16, (value as u32 >> 16) as u16];
    for (name, value) in [("velocity", 20_000), ("acceleration", 200_000)] {
        client.write_multiple_registers(at(name), &low_first(value)).await.unwrap().unwrap();
    }
    client.write_single_register(at("mode"), 1).await.unwrap().unwrap();
    for (controlword, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)] {
        client.write_single_register(at("controlword"), controlword).await.unwrap().unwrap();
        wait_for(&mut client, at("statusword"), 1, |words| words[0] & 0x6F == state).await;
    }
    let position = |words: &[u16]| i32::from(words[1].cast_signed()) << 16 | i32::from(words[0]);
    client.write_multiple_registers(at("target"), &low_first(-12_000)).await.unwrap().unwrap();
    client.masked_write_register(at("controlword"), !0x10, 0x10).await.unwrap().unwrap();
    wait_for(&mut client, at("position"), 2, |words| (position(words) + 12_000).abs() < 50).await;
    let seen = client.read_write_multiple_registers(at("position"), 2, at("controlword"), &[6]).await;
    assert!((position(&seen.unwrap().unwrap()) + 12_000).abs() < 50);
    wait_for(&mut client, at("statusword"), 1, |words| words[0] & 0x6F == 0x21).await;
    assert_eq!(client.read_coils(0, 32).await.unwrap().unwrap().len(), 32);
    assert_eq!(client.read_discrete_inputs(0, 32).await.unwrap().unwrap().len(), 32);
    let refusal = client.write_single_register(at("statusword"), 0).await.unwrap().unwrap_err();
    assert_eq!(u8::from(refusal), 2);
}

async fn wait_for(client: &mut Context, address: u16, count: u16, is_it: impl Fn(&[u16]) -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !is_it(&client.read_holding_registers(address, count).await.unwrap().unwrap()) {
        assert!(Instant::now() < deadline, "registers {address} stay");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

fn wait_until(mut is_it: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !is_it() {
        assert!(Instant::now() < deadline, "it never is");
    }
}

/// Runs a program to its end, which has to be good, and gives what it printed.
fn run(command: &mut Command) -> String {
    let output =
        command.output().unwrap_or_else(|error| panic!("{command:?}: {error}; scripts/test installs it"));
    let (out, wrong) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}: {}\n{out}{wrong}", output.status);
    out.into_owned()
}
