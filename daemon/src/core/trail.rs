//! Who commanded what: for each device the last commands, those of one kind from one place as one.

use std::net::SocketAddr;

use od::{Address, Instant};

use super::LinkId;

/// Commands that are remembered.
const KEPT: usize = 16;

/// Where a command came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Who {
    /// A bus.
    CanOpen(LinkId),
    /// A Modbus client.
    Modbus(SocketAddr),
    /// A Modbus client that has left meanwhile.
    ModbusGone,
    /// The operator on this machine.
    Local,
}

/// Who is at the other end of a connection to this daemon, as the kernel tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    /// A process on this machine.
    Process {
        /// The user that it ran as when it connected.
        uid: u32,
        /// Its number, unless it cannot be seen from here.
        pid: Option<i32>,
    },
    /// A client by TCP.
    Address(SocketAddr),
}

impl Peer {
    /// Whether it is the same one, also if it has connected again meanwhile.
    pub(super) fn is(self, other: Self) -> bool {
        match (self, other) {
            (Self::Process { uid, .. }, Self::Process { uid: other, .. }) => uid == other,
            (Self::Address(one), Self::Address(other)) => one.ip() == other.ip(),
            (Self::Process { .. } | Self::Address(_), _) => false,
        }
    }
}

/// A command, given once or again and again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Who gave it.
    pub who: Who,
    /// What was written.
    pub address: Address,
    /// Its value when it was last given.
    pub raw: u64,
    /// How often it was another one than before.
    pub count: u64,
    /// When it was last given.
    pub at: Instant,
}

/// The last commands of a device.
#[derive(Debug)]
pub(super) struct Trail(Vec<Command>);

impl Default for Trail {
    fn default() -> Self {
        Self(Vec::with_capacity(KEPT))
    }
}

impl Trail {
    /// Takes note of a command; the one that was given longest ago makes room.
    pub(super) fn note(&mut self, at: Instant, who: Who, address: Address, raw: u64) {
        let known = self.0.iter_mut().find(|known| known.who == who && known.address == address);
        if let Some(known) = known {
            *known = Command { raw, count: known.count + 1, at, ..*known };
            return;
        }
        let command = Command { who, address, raw, count: 1, at };
        if self.0.len() < KEPT {
            self.0.push(command);
        } else if let Some(oldest) = self.0.iter_mut().min_by_key(|known| known.at) {
            *oldest = command;
        }
    }

    /// The commands, the last one first.
    pub(super) fn commands(&self) -> Vec<Command> {
        let mut commands = self.0.clone();
        commands.sort_by_key(|command| core::cmp::Reverse(command.at));
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nanos: u64) -> Instant {
        Instant::from_nanos(nanos)
    }

    #[test]
    fn what_is_given_again_and_again_is_one_command_and_the_oldest_makes_room() {
        let mut trail = Trail::default();
        let controlword = Address::new(0x6040, 0);
        trail.note(at(1), Who::Local, controlword, 6);
        for cycle in 0..1000 {
            trail.note(at(2 + cycle), Who::CanOpen(LinkId(0)), Address::new(0x607A, 0), cycle);
        }
        let commands = trail.commands();
        assert_eq!(commands.len(), 2);
        assert_eq!((commands[0].count, commands[0].raw, commands[0].at), (1000, 999, at(1001)));
        assert_eq!((commands[1].who, commands[1].count), (Who::Local, 1));
        for index in 0..15 {
            trail.note(at(2000 + u64::from(index)), Who::Local, Address::new(0x2000 + index, 0), 1);
        }
        assert_eq!(trail.commands().len(), KEPT);
        assert!(trail.commands().iter().all(|command| command.address != controlword));
    }
}
