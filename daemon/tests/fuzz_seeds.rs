//! The seeds of the fuzz targets, replayed without a fuzzer: stories that reached much of the engine.

#[path = "../../fuzz/src/story.rs"]
#[allow(unreachable_pub, reason = "a library there, a module here")]
mod story;

use std::fs;
use std::path::Path;

#[test]
fn every_seed_of_the_node_is_a_legal_story() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds/node");
    let mut seeds: Vec<_> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    seeds.sort_unstable();
    assert!(!seeds.is_empty());
    for seed in seeds {
        story::tell(&fs::read(&seed).unwrap());
    }
}

#[test]
fn a_client_that_says_anything_is_answered_legally() {
    let requests: Vec<u8> =
        (0..=255).flat_map(|command| [command, 0x21, 0x21, 0, command, 0, 0, 0]).collect();
    story::request(&requests);
}
