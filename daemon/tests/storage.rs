//! Parameter files: what they look like, and that they are whole whatever happens.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::Duration;

use canopen::LssSetting;
use daemon::alarm::Alarm;
use daemon::core::{NodeParameters, Parameters};
use daemon::storage::{
    Claim, Corrupt, Done, Failure, Replacement, Storage, decode, encode, file_name, load, replace,
};
use od::{AbortCode, Address, Saved};
use proptest::prelude::*;

const OLD: &[u8] = b"old";
const NEW: &[u8] = b"the new one";

/// A directory of its own for a test.
struct Directory(PathBuf);

impl Directory {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("axisd-storage-{}-{number}", process::id()));
        fs::create_dir(&path).unwrap();
        Self(path)
    }

    fn path(&self) -> &Path {
        &self.0
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.join(name)).unwrap()
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.0.join(name), bytes).unwrap();
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn saved(values: &[(u16, u8, &[u8])]) -> Saved {
    let mut saved = Saved::default();
    for (index, sub, bytes) in values {
        saved.insert(Address::new(*index, *sub), bytes.to_vec());
    }
    saved
}

fn parameters() -> Parameters {
    Parameters {
        application: saved(&[(0x2005, 0, b""), (0x6081, 0, &[0, 0xA0, 0, 0])]),
        nodes: vec![
            node(saved(&[(0x1017, 0, &[0xE8, 3]), (0x1600, 0x0A, &[1])]), LssSetting::default()),
            node(saved(&[]), LssSetting { node_id: 5, bit_timing: Some(2) }),
        ],
    }
}

fn node(communication: Saved, lss: LssSetting) -> NodeParameters {
    NodeParameters { communication, lss }
}

const TEXT: &str = "\
axisd parameters 1
application
2005:00=
6081:00=00A00000
node 0
1017:00=E803
1600:0A=01
node 1
lss 5 2
crc32 2B93B793
";

#[test]
fn a_file_is_text_and_says_what_was_stored() {
    assert_eq!(encode(&parameters()), TEXT);
    assert_eq!(decode(TEXT.as_bytes()), Ok(parameters()));
    let nothing = Parameters::default();
    assert_eq!(decode(encode(&nothing).as_bytes()), Ok(nothing));
}

#[test]
fn a_file_changed_in_any_byte_is_refused() {
    for position in 0..TEXT.len() {
        for change in 1..=255 {
            let mut bytes = TEXT.as_bytes().to_vec();
            bytes[position] ^= change;
            assert!(decode(&bytes).is_err(), "byte {position} changed by {change:#04X}");
        }
    }
}

#[test]
fn a_file_cut_short_or_grown_at_any_byte_is_refused() {
    for length in 0..TEXT.len() {
        assert!(decode(&TEXT.as_bytes()[..length]).is_err(), "{length} bytes");
        let grown = [&TEXT[..length], "0", &TEXT[length..]].concat();
        assert!(decode(grown.as_bytes()).is_err(), "one more at {length}");
    }
    assert!(decode(format!("{TEXT}\n").as_bytes()).is_err());
    assert!(decode(&[0; 4096]).is_err());
}

#[test]
fn a_right_checksum_does_not_make_sense_of_nonsense() {
    let with = |from: &str, to: &str| {
        let text = TEXT.replace(from, to);
        let end = text.rfind("crc32").unwrap();
        // The checksum of the changed text, found by what a good file has behind it.
        let body = &text[..end];
        let table = (0..256_u32).map(|n| (0..8).fold(n, |c, _| c >> 1 ^ (0xEDB8_8320 * (c & 1))));
        let table: Vec<u32> = table.collect();
        let crc = body.bytes().fold(!0_u32, |c, b| table[((c ^ u32::from(b)) & 0xFF) as usize] ^ c >> 8);
        decode(format!("{body}crc32 {:08X}\n", !crc).as_bytes())
    };
    assert_eq!(with("node", "node"), Ok(parameters()));
    assert_eq!(with("parameters 1", "parameters 2"), Err(Corrupt::Version("2".to_owned())));
    assert_eq!(with("axisd", "other"), Err(Corrupt::Line(1)));
    assert_eq!(with("application", "device"), Err(Corrupt::Line(2)));
    assert_eq!(with("node 0", "node 1"), Err(Corrupt::Line(5)));
    for (from, to) in [("E803", "E80"), ("E803", "E8x3"), ("1017", "1x17"), ("1017", "11017")] {
        assert_eq!(with(from, to), Err(Corrupt::Line(6)), "{to}");
    }
    for (from, to) in [(":00=E", ":000=E"), ("E803", "e803"), ("E803", "E8+3"), ("node 0", "node +0")] {
        assert_eq!(with(from, to), Err(Corrupt::Spelling), "{to}");
    }
    assert_eq!(with("1600:0A", "1017:00"), Err(Corrupt::Line(7)), "twice");
}

#[test]
fn a_missing_file_is_a_first_start_and_a_bad_one_an_error() {
    let directory = Directory::new();
    assert!(load(directory.path(), "axis1").unwrap().is_none());
    replace(directory.path(), &file_name("axis1"), TEXT.as_bytes()).unwrap();
    assert_eq!(load(directory.path(), "axis1").unwrap(), Some(parameters()));
    directory.write("axis1.parameters", b"");
    assert_eq!(load(directory.path(), "axis1").unwrap_err().to_string(), "the checksum is wrong");
    fs::create_dir(directory.path().join("axis2.parameters")).unwrap();
    assert!(load(directory.path(), "axis2").is_err());
}

#[test]
fn no_name_of_a_device_leaves_the_directory_or_meets_another() {
    let names = [
        "",
        ".",
        "..",
        "../x",
        "/etc/passwd",
        "a/b",
        "a%2Fb",
        "a b",
        "a.b",
        "a\0b",
        "A",
        "a",
        "Ähre",
        "x.new",
    ];
    let files: Vec<String> = names.iter().map(|name| file_name(name)).collect();
    for (position, file) in files.iter().enumerate() {
        let stem = file.strip_suffix(".parameters").unwrap();
        assert!(stem.bytes().all(|c| c.is_ascii_alphanumeric() || b"-_%".contains(&c)), "{file}");
        assert!(!files[..position].contains(file), "{file}");
    }
    assert_eq!(file_name("left-feed_2"), "left-feed_2.parameters");
    assert_eq!(file_name("../x"), "%2E%2E%2Fx.parameters");
}

/// Does `steps` steps of a replacement and then nothing more, as if the power had gone.
fn crash_after(directory: &Directory, steps: usize) -> bool {
    let mut replacement = Replacement::new(directory.path(), "file", NEW);
    (0..steps).all(|_| replacement.advance().unwrap())
}

#[test]
fn a_crash_between_any_two_steps_leaves_the_old_file_or_the_new_one() {
    let mut seen = Vec::new();
    for steps in 0.. {
        let directory = Directory::new();
        directory.write("file", OLD);
        let is_unfinished = crash_after(&directory, steps);
        let left = directory.read("file");
        assert!(left == OLD || left == NEW, "after {steps} steps");
        seen.push(left == NEW);
        replace(directory.path(), "file", NEW).unwrap();
        assert_eq!(directory.read("file"), NEW, "the next one is not disturbed");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "nothing is left over");
        if !is_unfinished {
            break;
        }
    }
    assert_eq!(seen, [false, false, false, false, true, true], "the rename makes the difference");
}

#[test]
fn a_crash_at_any_byte_of_the_draft_leaves_the_old_file() {
    let directory = Directory::new();
    replace(directory.path(), "axis1.parameters", TEXT.as_bytes()).unwrap();
    for length in 0..=TEXT.len() {
        directory.write("axis1.parameters.new", &TEXT.as_bytes()[..length]);
        assert_eq!(load(directory.path(), "axis1").unwrap(), Some(parameters()));
    }
}

#[test]
fn a_full_disk_leaves_the_old_file() {
    let directory = Directory::new();
    directory.write("file", OLD);
    symlink("/dev/full", directory.path().join("file.new")).unwrap();
    let error = replace(directory.path(), "file", NEW).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::StorageFull);
    assert_eq!(directory.read("file"), OLD);
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "the draft is gone");
    replace(directory.path(), "file", NEW).unwrap();
    assert_eq!(directory.read("file"), NEW);
}

#[test]
fn a_directory_that_has_gone_is_an_error() {
    let directory = Directory::new();
    assert!(replace(&directory.path().join("gone"), "file", NEW).is_err());
}

/// Waits for the end of the next order.
fn wait(storage: &mut Storage) -> Done {
    for _ in 0..3000 {
        if let Some(done) = storage.poll() {
            return done;
        }
        thread::sleep(Duration::from_millis(1));
    }
    panic!("the order does not end");
}

#[test]
fn orders_are_written_by_another_thread() {
    let directory = Directory::new();
    let alarm = Alarm::new().unwrap();
    let claim = Claim::take(directory.path()).unwrap();
    let mut storage = Storage::start(claim, alarm.bell()).unwrap();
    assert!(storage.is_idle());
    storage.submit(1, &"axis/2".into(), parameters());
    storage.submit(0, &"axis1".into(), Parameters::default());
    assert!(!storage.is_idle());
    for device in [1, 0] {
        let done = wait(&mut storage);
        assert!(done.device == device && done.outcome.is_ok());
    }
    assert!(storage.is_idle() && storage.poll().is_none());
    assert_eq!(load(directory.path(), "axis/2").unwrap(), Some(parameters()));
    assert_eq!(load(directory.path(), "axis1").unwrap(), Some(Parameters::default()));
}

#[test]
fn a_failed_write_is_a_hardware_error() {
    let directory = Directory::new();
    let alarm = Alarm::new().unwrap();
    let claim = Claim::take(&directory.path().join("gone")).unwrap();
    let mut storage = Storage::start(claim, alarm.bell()).unwrap();
    fs::remove_dir_all(directory.path().join("gone")).unwrap();
    storage.submit(0, &"axis1".into(), parameters());
    let failure = wait(&mut storage).outcome.unwrap_err();
    assert!(matches!(failure, Failure::File(_)));
    assert_eq!(failure.code(), AbortCode::Hardware);
}

#[test]
fn a_directory_belongs_to_one_daemon_as_long_as_that_lives() {
    let directory = Directory::new();
    let path = directory.path().join("var/axisd");
    let alarm = Alarm::new().unwrap();
    let storage = Storage::start(Claim::take(&path).unwrap(), alarm.bell()).unwrap();

    let error = Claim::take(&path).unwrap_err();
    assert_eq!(error.to_string(), "another axisd stores there");
    assert!(Claim::take(directory.path()).is_ok(), "another directory");

    drop(storage);
    // The thread that writes there ends with it, and not at once.
    let is_free = |_| {
        thread::sleep(Duration::from_millis(1));
        Claim::take(&path).is_ok()
    };
    assert!((0..3000).any(is_free));
}

#[test]
fn a_claim_that_was_left_behind_holds_nobody_up() {
    let directory = Directory::new();
    directory.write("lock", b"left by a daemon that was killed");
    assert!(Claim::take(directory.path()).is_ok());
    assert_ne!(file_name("lock"), "lock", "that of a device is another one");
}

#[test]
fn without_a_directory_only_defaults_can_be_stored() {
    let mut storage = Storage::default();
    storage.submit(0, &"axis1".into(), parameters());
    assert!(!storage.is_idle());
    let failure = storage.poll().unwrap().outcome.unwrap_err();
    assert_eq!(failure.code(), AbortCode::CannotStore);
    storage.submit(0, &"axis1".into(), Parameters::default());
    assert!(storage.poll().unwrap().outcome.is_ok());
    assert!(storage.is_idle());
}

fn any_node() -> impl Strategy<Value = NodeParameters> {
    let node_id = prop_oneof![1..=127_u8, Just(255)];
    let bit_timing = prop::option::of(prop_oneof![0..=4_u8, 6..=9_u8]);
    (any_saved(), node_id, bit_timing).prop_map(|(communication, node_id, bit_timing)| {
        node(communication, LssSetting { node_id, bit_timing })
    })
}

fn any_saved() -> impl Strategy<Value = Saved> {
    let value = (any::<u16>(), any::<u8>(), prop::collection::vec(any::<u8>(), 0..20));
    prop::collection::vec(value, 0..20).prop_map(|values| {
        let mut saved = Saved::default();
        for (index, sub, bytes) in values {
            saved.insert(Address::new(index, sub), bytes);
        }
        saved
    })
}

proptest! {
    #[test]
    fn whatever_is_written_is_read_back(application in any_saved(), nodes in prop::collection::vec(any_node(), 0..4)) {
        let parameters = Parameters { application, nodes };
        prop_assert_eq!(decode(encode(&parameters).as_bytes()), Ok(parameters));
    }

    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(decode(&bytes).is_err());
    }
}
