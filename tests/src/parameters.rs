//! Parameters of node 1 that are written, stored and read again, by a socketcand client.

use crate::Client;

/// Parameters in both areas, index and sub-index, all of 32 bits; all get the same value before each store.
pub const PARAMETERS: [(u16, u8); 4] = [(0x1020, 1), (0x1020, 2), (0x6065, 0), (0x6067, 0)];

/// An SDO request to node 1, as [`Client::try_ask`] takes it.
#[must_use]
pub fn request(command: u8, (index, sub): (u16, u8), value: u32) -> String {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    format!("601 8 {command:X} {low:X} {high:X} {sub:X} {a:X} {b:X} {c:X} {d:X}")
}

/// The value of the good answer to a read request.
#[must_use]
pub fn read(client: &mut Client, address: (u16, u8)) -> u32 {
    let answer = client.try_ask(&request(0x40, address, 0)).expect("the daemon is there");
    let digits = answer.strip_prefix("581 43").and_then(|rest| rest.get(6..)).expect("a good answer");
    u32::from_str_radix(digits, 16).expect("eight digits").swap_bytes()
}

/// Whether a write was answered, which must be well; `None` if the daemon is gone.
pub fn write(client: &mut Client, address: (u16, u8), value: u32) -> Option<()> {
    let answer = client.try_ask(&request(0x23, address, value)).ok()?;
    assert!(answer.starts_with("581 60"), "{answer}");
    Some(())
}

/// Stores all parameters; `None` if the daemon is gone.
pub fn save(client: &mut Client) -> Option<()> {
    write(client, (0x1010, 1), u32::from_le_bytes(*b"save"))
}

/// Stores one generation after the other until the daemon is gone; gives the last one that was confirmed.
pub fn store_until_gone(client: &mut Client, mut generation: u32) -> u32 {
    loop {
        let stored = PARAMETERS.iter().try_for_each(|address| write(client, *address, generation + 1));
        if stored.and_then(|()| save(client)).is_none() {
            return generation;
        }
        generation += 1;
    }
}
