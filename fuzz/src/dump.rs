//! What somebody sees who only listens: any frames of any log are told in words, and no state grows beyond its bounds.
use std::sync::{Arc, OnceLock};

use canopen::{Frame, Id};
use daemon::dump::{Decoder, Known, log_line};
use od::Dictionary;
use profiles::Profile;

/// A drive as node 2.
fn known() -> &'static Known {
    static KNOWN: OnceLock<Known> = OnceLock::new();
    KNOWN.get_or_init(|| {
        let profile = Profile::embedded("cia402-servo", None).expect("it is shipped").expect("it is right");
        let profile = Arc::new(profile);
        let communication = Dictionary::new(Arc::clone(&profile.communication), 2);
        Known { node_id: 2, device: "drive".to_owned(), profile, communication }
    })
}

/// A frame of ten bytes: identifier, flags and data; half of the identifiers are those of node 2 or of everybody.
fn frame(bytes: &[u8]) -> Option<Frame> {
    const SERVICES: [u16; 12] =
        [0x000, 0x080, 0x100, 0x082, 0x182, 0x202, 0x282, 0x582, 0x602, 0x702, 0x7E4, 0x7E5];
    let [low, high, data @ ..] = bytes else { return None };
    let number = u16::from_le_bytes([*low, *high]);
    let id = match number & 0x8000 {
        0 => SERVICES.get(usize::from(*low) % SERVICES.len()).copied()?,
        _ => number & 0x7FF,
    };
    let length = data.len().min(8);
    let is_remote = number & 0x7000 == 0x7000;
    let id = if number & 0xF800 == 0xA000 { Id::Extended(id.into()) } else { Id::Standard(id) };
    Some(if is_remote { Frame::remote(id, length as u8) } else { Frame::new(id, data) })
}

/// Lets somebody hear `bytes` as frames, and read them as a log.
pub fn run(bytes: &[u8]) {
    let mut decoder = Decoder::default();
    decoder.learn("can0", known().clone());
    for frame in bytes.chunks(10).filter_map(frame) {
        let told = decoder.decode("can0", &frame);
        assert!(told.text.len() < 4096, "{told:?}");
    }
    for line in String::from_utf8_lossy(bytes).lines() {
        if let Ok(Some(read)) = log_line(line) {
            let again = log_line(&format!("(0.0) {} {}", read.interface, read.frame));
            assert_eq!(again.map(|read| read.map(|read| read.frame)), Ok(Some(read.frame)));
            let _ = decoder.decode(&read.interface, &read.frame);
        }
    }
}
