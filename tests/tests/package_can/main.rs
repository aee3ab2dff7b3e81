//! The Debian package on a machine that has SocketCAN and may do what a machine may.

use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use tests::system::{System, attempt, run};
use tests::{Vcan, Wire};

const PATIENCE: Duration = Duration::from_secs(60);
const POLL_PERIOD: Duration = Duration::from_millis(100);
const CONFIG: &str = "[[bus]]\nname = \"can0\"\nlink = \"socketcan:vcan0\"\n\n\
                      [[device]]\nname = \"axis1\"\nprofile = \"cia402-servo\"\nbus = \"can0\"\nnode_id = 1\n";

/// What `ip` tells of an interface, once that has this word in it.
fn wait_for_interface(name: &str, word: &str) -> String {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let output = attempt("ip", &["-details", "link", "show", name]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        if text.contains(word) {
            return text;
        }
        let journal = || run("journalctl", &["--no-pager", "--output=cat", "--unit=systemd-networkd"]);
        assert!(Instant::now() < deadline, "no {word} in: {text}\n{}", journal());
        thread::sleep(POLL_PERIOD);
    }
}

#[test]
fn the_interface_comes_up_by_networkd_and_the_service_serves_it() {
    let system = System::installed();
    for file in fs::read_dir("/usr/share/axisd/network").expect("it is there") {
        let file = file.expect("a readable directory");
        fs::copy(file.path(), format!("/etc/systemd/network/{}", file.file_name().display()))
            .expect("copy it");
    }
    // What scripts/vcan has made is in another network namespace. A virtual interface stands for can0: it has no bit rate.
    run("systemctl", &["start", "systemd-networkd"]);
    let vcan0 = Vcan::found("vcan0");
    wait_for_interface("vcan0", "UP,LOWER_UP");
    let complaints =
        run("journalctl", &["--no-pager", "--output=cat", "--unit=systemd-networkd", "--priority=warning"]);
    assert!(!complaints.contains("/etc/systemd/network/"), "{complaints}");
    run("ip", &["link", "set", "vcan0", "txqueuelen", "10"]);
    let queue = run("udevadm", &["test-builtin", "net_setup_link", "/sys/class/net/vcan0"]);
    assert!(wait_for_interface("vcan0", "qlen 1000").contains("vcan"), "{queue}");

    let service = system.service(Some(CONFIG));
    service.start();

    let mut wire = Wire::on(&vcan0);
    assert_eq!(wire.ask("601#4000100000000000", "581"), "581#4300100092010200");
    service.stop();
    assert_eq!(service.show("Result"), "success");
}

#[test]
fn the_rule_of_udev_sets_bit_rate_restart_and_queue_of_can0() {
    let _system = System::installed();
    fs::copy("/usr/share/axisd/udev/80-can0.rules", "/etc/udev/rules.d/80-can0.rules").expect("copy it");
    run("ip", &["link", "add", "can0", "type", "vcan"]);

    let output = attempt("udevadm", &["test", "--action=add", "/sys/class/net/can0"]);

    run("ip", &["link", "delete", "can0"]);
    let said =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    for command in
        ["ip link set can0 type can bitrate 500000 restart-ms 100", "ip link set can0 txqueuelen 1000 up"]
    {
        assert!(said.contains(&format!("run: '/usr/bin/{command}'")), "{said}");
    }
}

#[test]
fn the_service_may_run_in_real_time_and_lock_its_memory() {
    let system = System::installed();
    let lines = "ExecStartPre=/usr/bin/chrt --fifo 90 /bin/true\n\
                 ExecStartPre=/usr/bin/taskset 1 /bin/true\n\
                 CPUSchedulingPolicy=fifo\nCPUSchedulingPriority=50";
    let service = system.service(None).with(lines);
    service.start();

    let pid = service.pid().to_string();
    let told = run("chrt", &["--pid", &pid]);
    assert!(told.contains("SCHED_FIFO") && told.contains("priority: 50"), "{told}");
    let limits = fs::read_to_string(format!("/proc/{pid}/limits")).expect("the daemon runs");
    let has = |name: &str, value: &str| {
        let values = limits.lines().filter_map(|line| line.strip_prefix(name)?.split_whitespace().next());
        values.eq([value])
    };
    assert!(has("Max realtime priority", "90") && has("Max locked memory", "unlimited"), "{limits}");
}
