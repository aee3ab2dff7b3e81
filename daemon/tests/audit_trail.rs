//! The audit trail on a disk that is not always there.

use std::fs;
use std::path::PathBuf;
use std::process;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use daemon::audit::{Files, Names, Trail, last_lines};
use daemon::clock::Clock;
use daemon::core::{AuditEntry, Item, LinkId, What, Who};
use daemon::reload::Report;
use od::Address;
use profiles::Profile;

const PATIENCE: Duration = Duration::from_secs(10);

struct Directory(PathBuf);

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_disk_that_takes_nothing_costs_entries_and_the_trail_tells_how_many() {
    let directory = Directory(std::env::temp_dir().join(format!("axisd-trail-{}", process::id())));
    let clock = Clock::start();
    let entry = |value| AuditEntry {
        at: clock.now(),
        device: Some(0),
        who: Who::Local,
        peer: None,
        what: What::Write(Item { node_id: None, address: Address::new(0x6040, 0), value: Some(value) }),
        again: None,
    };
    // Each line has a file of its own, so that there is always one to be made.
    let files = Files::open(&directory.0, 1, 10).unwrap();
    let mut trail = Trail::start(files, Names::default(), clock).unwrap();
    trail.submit(entry(1));
    wait_until("the first line", || last_lines(&directory.0, 9).is_ok_and(|lines| lines.len() == 1));
    fs::remove_dir_all(&directory.0).unwrap();
    (2..5).for_each(|value| trail.submit(entry(value)));
    wait_until("three lost entries", || trail.lost() == 3);
    fs::create_dir(&directory.0).unwrap();
    trail.submit(entry(5));
    assert_eq!(trail.lost(), 3);
    drop(trail);
    let lines = last_lines(&directory.0, 9).unwrap();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[0].ends_with(r#""event":"lost","lost":3}"#), "{lines:?}");
    assert!(lines[1].contains(r#""event":"write""#) && lines[1].ends_with(r#""value":5}"#), "{lines:?}");
}

#[test]
fn entries_are_told_of_the_device_that_was_there_and_a_reload_stands_between_them() {
    let directory = Directory(std::env::temp_dir().join(format!("axisd-trail-names-{}", process::id())));
    let clock = Clock::start();
    let entry = |value| AuditEntry {
        at: clock.now(),
        device: Some(0),
        who: Who::CanOpen(LinkId(1)),
        peer: None,
        what: What::Write(Item { node_id: Some(1), address: Address::new(0x6040, 0), value: Some(value) }),
        again: None,
    };
    let profile = Arc::new(Profile::embedded("cia402-servo", None).unwrap().unwrap());
    let names = Names {
        devices: vec![("old".to_owned(), Arc::clone(&profile))],
        buses: vec!["can0".to_owned(), "can1".to_owned()],
    };
    let mut trail = Trail::start(Files::open(&directory.0, 1 << 20, 2).unwrap(), names, clock).unwrap();
    let report =
        Report { removed: vec!["old".to_owned()], added: vec!["new".to_owned()], ..Report::default() };

    trail.submit(entry(1));
    trail.name_device(0, "new", &profile);
    trail.name_bus(1, "line");
    trail.note_reload(clock.now(), &Arc::new(report));
    trail.submit(entry(2));
    drop(trail);

    let lines = last_lines(&directory.0, 9).unwrap();
    let told = |line: &str, parts: [&str; 3]| parts.iter().all(|part| line.contains(part));
    assert!(told(&lines[0], [r#""device":"old""#, r#""bus":"can1""#, r#""value":1}"#]), "{lines:?}");
    assert!(
        told(&lines[1], [r#""event":"reload""#, r#""added":["new"]"#, r#""removed":["old"]"#]),
        "{lines:?}"
    );
    assert!(told(&lines[2], [r#""device":"new""#, r#""bus":"line""#, r#""value":2}"#]), "{lines:?}");
}
