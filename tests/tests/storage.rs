//! Parameters that are stored survive the daemon, whenever it is killed.

use std::env;
use std::fs;
use std::thread;
use std::time::Duration;

use tests::parameters::{PARAMETERS, read, request, save, store_until_gone, write};
use tests::{Bus, Client, Daemon, TempDir, axisd, config, free_port};

fn daemon(port: u16, storage: &TempDir) -> Daemon {
    let config = config(Bus::Socketcand(port), &[("axis 1", "cia402-servo", 1)]);
    Daemon::start(&format!("[storage]\npath = \"{}\"\n{config}", storage.path().display()))
}

#[test]
fn killed_at_any_moment_it_has_the_old_set_or_the_new_one() {
    // A longer run: `AXISD_KILLS=200 cargo test -p tests --test storage`.
    let kills: u64 = env::var("AXISD_KILLS").map_or(40, |number| number.parse().expect("a number"));
    let storage = TempDir::new();
    let mut generation = 0;
    let mut in_flight = 0;
    for kill in 0..=kills {
        let port = free_port();
        let mut daemon = daemon(port, &storage);
        let mut client = Client::raw(port);
        let set = PARAMETERS.map(|address| read(&mut client, address));
        if kill > 0 {
            assert_eq!(set, [set[0]; PARAMETERS.len()], "kill {kill}: half a set");
            assert!(
                [generation, generation + 1].contains(&set[0]),
                "kill {kill}: {generation} was confirmed"
            );
            in_flight += u32::from(set[0] > generation);
            generation = set[0];
        }
        let client = thread::spawn(move || store_until_gone(&mut client, generation));
        // Steps of 1.7 ms over a few stores, so that every part of one is met.
        thread::sleep(Duration::from_micros(20_000 + kill * 1_700));
        daemon.kill();
        generation = client.join().expect("only good answers");
    }
    println!("{generation} stores, {kills} kills, {in_flight} of them between a store and its answer");
    assert!(u64::from(generation) > kills, "only {generation} stores");
}

#[test]
fn a_file_that_cannot_be_used_means_defaults_and_an_emergency() {
    let storage = TempDir::new();
    storage.write("axis%201.parameters", "axisd parameters 1\n");
    let port = free_port();
    let mut daemon = daemon(port, &storage);
    daemon.logged("axis 1: starts with the defaults");
    let mut client = Client::raw(port);
    assert_eq!(read(&mut client, (0x1020, 1)), 0);
    assert_eq!(read(&mut client, (0x1003, 1)), 0x6310, "loss of parameters");

    assert_eq!(save(&mut client), Some(()));
    let text = fs::read_to_string(storage.path().join("axis%201.parameters")).expect("the file is there");
    assert!(text.starts_with("axisd parameters 1\napplication\n"), "{text}");
}

#[test]
fn a_second_daemon_in_the_same_directory_is_a_clear_error() {
    let storage = TempDir::new();
    let mut first = daemon(free_port(), &storage);
    let path = storage.path().display();
    let text = format!("[storage]\npath = \"{path}\"\n{}", config(Bus::Virtual, &[]));
    let file = storage.write("second.toml", &text).display().to_string();

    let output = axisd(&["run", "--config", &file]);

    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains(&format!("{path}: another axisd stores there")), "{stderr}");

    first.kill();
    drop(first);
    let _next = daemon(free_port(), &storage);
}

#[test]
fn without_a_directory_nothing_can_be_saved() {
    let port = free_port();
    let _daemon = Daemon::start(&config(Bus::Socketcand(port), &[("axis1", "cia402-servo", 1)]));
    let mut client = Client::raw(port);

    let save = client.try_ask(&request(0x23, (0x1010, 1), u32::from_le_bytes(*b"save")));
    assert_eq!(save.expect("the daemon is there"), "581 8010100120000008");

    assert_eq!(
        write(&mut client, (0x1011, 1), u32::from_le_bytes(*b"load")),
        Some(()),
        "there is nothing to undo"
    );
}
