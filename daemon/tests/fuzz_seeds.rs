//! The targets of the fuzzer without a fuzzer: each with its seeds, with what is one change away from them, and with nothing.

#[path = "../../fuzz/src/lib.rs"]
#[allow(unreachable_pub, clippy::expect_used, reason = "a library there, a module here")]
mod fuzz;

use std::fs;
use std::path::{Path, PathBuf};

/// Changed seeds of each target: enough to notice what no seed meets any more, and soon done.
const CHANGED: usize = 150;
/// Of longer seeds this much is changed.
const LONGEST: usize = 4096;

#[test]
fn every_target_survives_its_seeds_and_their_neighbours() {
    for (name, target) in fuzz::TARGETS {
        let seeds = seeds(name);
        assert!(!seeds.is_empty(), "{name} has no seeds");
        target(&[]);
        for (file, seed) in &seeds {
            // If it panics, this is the last line.
            println!("{name}: {}", file.display());
            target(seed);
        }
        let mut random = Random(0x2545_F491_4F6C_DD1D);
        let short: Vec<&[u8]> = seeds.iter().map(|(_, seed)| &seed[..seed.len().min(LONGEST)]).collect();
        for _ in 0..CHANGED {
            let (seed, other) = (random.below(short.len()), random.below(short.len()));
            let changed = random.change(short[seed], short[other]);
            println!("{name}: {changed:02X?}");
            target(&changed);
        }
    }
}

#[test]
fn a_client_that_says_anything_is_answered_legally() {
    let requests: Vec<u8> =
        (0..=255).flat_map(|command| [command, 0x21, 0x21, 0, command, 0, 0, 0]).collect();
    fuzz::story::request(&requests);
}

/// The files that `scripts/fuzz` starts with.
fn seeds(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let own = format!("fuzz/seeds/{name}");
    let folders = match name {
        "dump" => vec!["daemon/tests/recorded"],
        "eds" => vec!["profiles/tests/data_sheets/sheets"],
        "gateway_toml" => vec!["config/examples"],
        "profile_toml" => vec!["profiles/devices"],
        _ => vec![&*own],
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let files = folders.iter().flat_map(|folder| fs::read_dir(root.join(folder)).unwrap());
    let mut files: Vec<_> = files.map(|file| file.unwrap().path()).filter(|file| file.is_file()).collect();
    files.sort_unstable();
    files.into_iter().map(|file| (file.clone(), fs::read(file).unwrap())).collect()
}

/// The same numbers in every run (Marsaglia, "Xorshift RNGs", 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    /// One of the changes that a fuzzer makes.
    fn change(&mut self, seed: &[u8], other: &[u8]) -> Vec<u8> {
        let mut changed = seed.to_vec();
        let place = self.below(changed.len());
        match self.next() % 5 {
            0 if place < changed.len() => changed[place] ^= 1 << self.below(8),
            1 if place < changed.len() => changed[place] = self.next() as u8,
            2 => changed.truncate(place),
            3 => drop(changed.splice(place..place, [self.next() as u8, self.next() as u8])),
            _ => {
                changed.truncate(place);
                changed.extend_from_slice(&other[self.below(other.len())..]);
            }
        }
        changed
    }
}
