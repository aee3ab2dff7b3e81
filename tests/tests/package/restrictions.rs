//! What systemd lets the service do, and what not.

use std::fs;

use nix::unistd::{Group, User};
use tests::system::{System, attempt, run};

/// Bit of CAP_NET_BIND_SERVICE (capabilities(7)).
const NET_BIND_SERVICE: u64 = 1 << 10;

#[test]
fn systemd_finds_nothing_wrong_with_the_units() {
    let _system = System::installed();
    for unit in ["axisd.service", "axisd@left.service"] {
        let output = attempt("systemd-analyze", &["verify", unit]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{unit}: {said}");
    }
}

#[test]
fn systemd_says_that_the_units_expose_little() {
    let _system = System::installed();
    // Of 100; a service without any restriction has 96.
    const MOST: &str = "--threshold=25";
    for unit in ["axisd.service", "axisd@.service"] {
        let file = format!("/usr/lib/systemd/system/{unit}");
        run("systemd-analyze", &["security", "--no-pager", "--offline=true", MOST, &file]);
    }
}

/// The value of a line of `/proc/PID/status`.
fn of_process(pid: i32, name: &str) -> String {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("the daemon runs");
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(":\t"));
    line.expect("the kernel tells it").to_owned()
}

#[test]
fn the_daemon_has_its_own_user_one_capability_and_a_filter() {
    let system = System::installed();
    let service = system.service(None);
    service.start();

    let user = User::from_name("axisd").expect("users can be read").expect("there is one");
    let pid = service.pid();
    assert_eq!(of_process(pid, "Uid"), [user.uid; 4].map(|uid| uid.to_string()).join("\t"));
    for set in ["CapEff", "CapBnd"] {
        assert_eq!(of_process(pid, set), format!("{NET_BIND_SERVICE:016x}"));
    }
    assert_eq!([of_process(pid, "NoNewPrivs"), of_process(pid, "Seccomp")], ["1", "2"]);
}

/// What runs before the daemon under its very restrictions: a line of Perl, which every Debian has.
fn before_start(code: &str) -> String {
    format!("ExecStartPre=/usr/bin/perl -e '{}'", code.replace('$', "$$"))
}

#[test]
fn under_the_restrictions_only_families_of_fieldbuses_and_networks_are_there() {
    let system = System::installed();
    // AF_NETLINK, AF_UNIX, AF_INET, AF_INET6 of socket(2); AF_CAN is tried where the kernel has it.
    let allowed = "for (16, 1, 2, 10) { socket(my $s, $_, 2, 0) or die qq($_: $!) }";
    system.service(None).with(&before_start(allowed)).start();

    // AF_KEY, AF_ALG and AF_VSOCK with type and protocol, as far as this kernel has them.
    let open =
        |(family, kind, protocol): &(u8, u8, u8)| format!("socket(my $s, {family}, {kind}, {protocol})");
    let is_there =
        |other: &(u8, u8, u8)| attempt("perl", &["-e", &format!("{} or die", open(other))]).status.success();
    let others: Vec<_> = [(15, 3, 2), (38, 5, 0), (40, 1, 0)].into_iter().filter(is_there).collect();
    assert!(!others.is_empty(), "this kernel has none of them");
    for other in &others {
        // 97 is EAFNOSUPPORT.
        let forbidden = format!("{} and die; $!+0 == 97 or die $!", open(other));
        system.service(None).with(&before_start(&forbidden)).start();
    }
}

#[test]
fn under_the_restrictions_nothing_is_written_but_what_is_stored() {
    let system = System::installed();
    let code = "for (qw(/etc/axisd/x /usr/x /var/lib/x /root/x)) { open(my $f, q(>), $_) and die $_ } \
                open(my $f, q(>), q(/var/lib/axisd/x)) or die $!; unlink q(/var/lib/axisd/x)";
    system.service(None).with(&before_start(code)).start();
}

#[test]
fn members_of_the_group_may_ask_and_nobody_else() {
    let system = System::installed();
    let service = system.service(None);
    service.start();
    let group = Group::from_name("axisd").expect("groups can be read").expect("there is one").gid;
    let ask =
        |groups: &str| attempt("setpriv", &["--reuid=65534", "--regid=65534", groups, "axisctl", "status"]);

    let member = ask(&format!("--groups={group}"));
    assert!(String::from_utf8_lossy(&member.stdout).contains("axis1   can0/1"), "{member:?}");

    let stranger = ask("--clear-groups");
    let stderr = String::from_utf8_lossy(&stranger.stderr);
    assert_eq!(stranger.status.code(), Some(1));
    assert!(stderr.contains("/run/axisd/control.sock: Permission denied"), "{stderr}");
}
