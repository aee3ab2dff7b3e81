//! System calls that no safe wrapper offers in full: `recvmmsg` with the time that it took, and the scheduling of a thread.

#![allow(unsafe_code)]

use core::mem::{size_of, zeroed};
use core::ptr;
use core::time::Duration;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};

use nix::errno::Errno;
use nix::sys::socket::sockopt::ReceiveTimestampns;
use nix::sys::socket::{MsgFlags, setsockopt};

/// Messages of `SIZE` bytes that one call takes at most.
pub(crate) const BATCH: usize = 64;

/// Longer than any call lasts: whoever waits sets the socket's own time-out.
const LONG: i64 = 1 << 30;

/// When messages arrived, in time since 1970; zero for one that the kernel says nothing of.
pub(crate) type Stamps = [Duration; BATCH];

/// Room for the control message with the time of one message.
const CONTROL: usize = 64;

/// Receives up to [`BATCH`] datagrams into `messages` and their lengths into `lengths`; how many, and how long that
/// took. With `stamps`, also when they arrived; [`stamp_arrivals`] has to be called for the socket before.
///
/// The kernel gives back what is left of the time-out it was given. So the caller knows the time without asking
/// for it, which is a system call of its own where the clock cannot be read from user space.
pub(crate) fn receive<const SIZE: usize>(
    socket: BorrowedFd<'_>,
    messages: &mut [[u8; SIZE]; BATCH],
    lengths: &mut [usize; BATCH],
    flags: MsgFlags,
    stamps: Option<&mut Stamps>,
) -> nix::Result<(usize, Duration)> {
    let mut places = messages
        .each_mut()
        .map(|message| libc::iovec { iov_base: message.as_mut_ptr().cast(), iov_len: SIZE });
    // SAFETY: these are C structures of numbers and pointers, for which zeros are valid.
    let mut headers: [libc::mmsghdr; BATCH] = unsafe { zeroed() };
    for (header, place) in headers.iter_mut().zip(&mut places) {
        header.msg_hdr.msg_iov = place;
        header.msg_hdr.msg_iovlen = 1;
    }
    // Only where they are wanted: it is memory to be cleared.
    let mut controls =
        if stamps.is_some() { Some([[0_u64; CONTROL / size_of::<u64>()]; BATCH]) } else { None };
    for (header, control) in headers.iter_mut().zip(controls.iter_mut().flatten()) {
        header.msg_hdr.msg_control = control.as_mut_ptr().cast();
        header.msg_hdr.msg_controllen = CONTROL;
    }
    let mut left = libc::timespec { tv_sec: LONG, tv_nsec: 0 };
    // SAFETY: `headers` has BATCH elements, each with one place of SIZE bytes that only this call writes to, no
    // name and either no control data or CONTROL bytes of its own; all of them and `left` outlive the call.
    let received = unsafe {
        libc::recvmmsg(socket.as_raw_fd(), headers.as_mut_ptr(), BATCH as u32, flags.bits(), &raw mut left)
    };
    let received = usize::try_from(Errno::result(received)?).unwrap_or(0);
    for (length, header) in lengths.iter_mut().zip(&headers) {
        *length = header.msg_len as usize;
    }
    for (stamp, header) in stamps.into_iter().flatten().zip(&headers).take(received) {
        *stamp = arrival(&header.msg_hdr);
    }
    let left =
        Duration::new(u64::try_from(left.tv_sec).unwrap_or(0), u32::try_from(left.tv_nsec).unwrap_or(0));
    Ok((received, Duration::from_secs(LONG.unsigned_abs()).saturating_sub(left)))
}

/// Makes the kernel tell when what comes to `socket` arrived.
pub(crate) fn stamp_arrivals(socket: &impl AsFd) -> nix::Result<()> {
    setsockopt(socket, ReceiveTimestampns, &true)
}

/// When the message behind a header that the kernel has filled in arrived.
fn arrival(header: &libc::msghdr) -> Duration {
    // SAFETY: the kernel has filled in `msg_controllen`, and what `msg_control` points to lives as long as `header`.
    let mut next = unsafe { libc::CMSG_FIRSTHDR(ptr::from_ref(header)) };
    while !next.is_null() {
        // SAFETY: CMSG_FIRSTHDR and CMSG_NXTHDR give whole headers within the control data, or null. They are aligned, as
        // those data are.
        let message = unsafe { &*next };
        if message.cmsg_level == libc::SOL_SOCKET && message.cmsg_type == libc::SCM_TIMESTAMPNS {
            // SAFETY: the data of this kind of message are a timespec, wherever they are aligned.
            let time: libc::timespec = unsafe { ptr::read_unaligned(libc::CMSG_DATA(next).cast()) };
            let nanos = u32::try_from(time.tv_nsec).unwrap_or(0);
            return Duration::new(u64::try_from(time.tv_sec).unwrap_or(0), nanos);
        }
        // SAFETY: as for the first one.
        next = unsafe { libc::CMSG_NXTHDR(ptr::from_ref(header), next) };
    }
    Duration::ZERO
}

/// Lets the calling thread run before all that have the usual scheduling or a lower `priority` (sched(7)); what it starts
/// does not inherit that.
pub(crate) fn schedule_first_in_first_out(priority: u8) -> nix::Result<()> {
    let parameters = libc::sched_param { sched_priority: priority.into() };
    let policy = libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK;
    // SAFETY: zero is the calling thread, and `parameters` outlives the call, which only reads it.
    let outcome = unsafe { libc::sched_setscheduler(0, policy, &raw const parameters) };
    Errno::result(outcome).map(drop)
}

/// Whether the calling thread runs before all that have the usual scheduling.
pub(crate) fn has_real_time_priority() -> bool {
    // SAFETY: zero is the calling thread, and the call only asks.
    let policy = unsafe { libc::sched_getscheduler(0) };
    matches!(policy & !libc::SCHED_RESET_ON_FORK, libc::SCHED_FIFO | libc::SCHED_RR)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Clock;
    use std::os::unix::net::UnixDatagram;
    use std::thread;

    #[test]
    fn what_waits_comes_in_one_call_with_the_time_it_took() {
        let (near, far) = UnixDatagram::pair().unwrap();
        let sender = thread::spawn(move || {
            thread::sleep(Duration::from_millis(20));
            far.send(&[1, 2, 3]).unwrap();
            far
        });
        let (mut messages, mut lengths) = ([[0; 4]; BATCH], [0; BATCH]);
        let flags = MsgFlags::MSG_WAITFORONE;
        let (received, time) = receive(near.as_fd(), &mut messages, &mut lengths, flags, None).unwrap();
        assert_eq!((received, lengths[0], messages[0]), (1, 3, [1, 2, 3, 0]));
        assert!((10..2000).contains(&time.as_millis()), "{time:?}");

        let far = sender.join().unwrap();
        far.send(&[4]).unwrap();
        far.send(&[5]).unwrap();
        let (received, _) =
            receive(near.as_fd(), &mut messages, &mut lengths, MsgFlags::MSG_DONTWAIT, None).unwrap();
        assert_eq!((received, messages[0][0], messages[1][0]), (2, 4, 5));
        let nothing = receive(near.as_fd(), &mut messages, &mut lengths, MsgFlags::MSG_DONTWAIT, None);
        assert_eq!(nothing, Err(Errno::EAGAIN));
    }

    #[test]
    fn the_kernel_tells_when_a_message_arrived_and_not_when_it_was_taken() {
        let (near, far) = UnixDatagram::pair().unwrap();
        stamp_arrivals(&near).unwrap();
        far.send(&[1]).unwrap();
        far.send(&[2]).unwrap();
        let sent = Clock::wall();
        thread::sleep(Duration::from_millis(20));
        let (mut messages, mut lengths) = ([[0; 4]; BATCH], [0; BATCH]);
        let mut stamps = [Duration::ZERO; BATCH];
        let flags = MsgFlags::MSG_DONTWAIT;
        receive(near.as_fd(), &mut messages, &mut lengths, flags, Some(&mut stamps)).unwrap();
        for stamp in &stamps[..2] {
            assert!(sent.abs_diff(*stamp) < Duration::from_millis(15), "{:?}", sent.abs_diff(*stamp));
        }
        assert_eq!(stamps[2], Duration::ZERO);
    }

    #[test]
    fn a_thread_runs_first_in_first_out_or_is_told_why_not() {
        thread::spawn(|| {
            let outcome = schedule_first_in_first_out(1);
            match outcome {
                Ok(()) => assert!(has_real_time_priority()),
                Err(error) => assert_eq!((error, has_real_time_priority()), (Errno::EPERM, false)),
            }
        })
        .join()
        .unwrap();
    }
}
