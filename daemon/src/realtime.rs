//! What the thread that moves the axes asks of the operating system. Whatever is refused is said once, and it goes on
//! without.

use config::Realtime;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use nix::unistd::Pid;
use tracing::{info, warn};

use crate::log::module::SERVICE;
use crate::sys;

/// The calling thread.
const ITSELF: Pid = Pid::from_raw(0);

/// Asks for it, for the calling thread; memory is locked for the whole process. Threads that were started before keep what
/// they have.
pub(crate) fn apply(wanted: &Realtime) {
    let Realtime { priority, cpus, lock_memory } = wanted;
    if *lock_memory {
        tell("memory locked", "memory is not locked", lock());
    }
    if !cpus.is_empty() {
        tell(&format!("on processors {cpus:?}"), "runs on any processor", pin(cpus));
    }
    if let Some(priority) = priority {
        let done = sys::schedule_first_in_first_out(*priority);
        let done = done.map_err(|error| format!("SCHED_FIFO {priority}: {error}; LimitRTPRIO= of the unit"));
        tell(&format!("priority {priority}, SCHED_FIFO"), "runs with the usual priority", done);
    }
}

fn tell(done: &str, otherwise: &str, outcome: Result<(), String>) {
    match outcome {
        Ok(()) => info!(target: SERVICE, "real time: {done}"),
        Err(refused) => warn!(target: SERVICE, "real time: {otherwise}: {refused}"),
    }
}

fn pin(cpus: &[u16]) -> Result<(), String> {
    let mut set = CpuSet::new();
    for cpu in cpus {
        set.set(usize::from(*cpu)).map_err(|error| format!("processor {cpu}: {error}"))?;
    }
    sched_setaffinity(ITSELF, &set).map_err(|error| format!("processors {cpus:?}: {error}"))
}

/// Locks what there is and what will be. With a limit that would be met only later, by an allocation that fails.
fn lock() -> Result<(), String> {
    let (limit, _) = getrlimit(Resource::RLIMIT_MEMLOCK).map_err(|error| error.to_string())?;
    if limit != RLIM_INFINITY && !nix::unistd::geteuid().is_root() {
        return Err(format!("the limit is {limit} bytes; LimitMEMLOCK=infinity of the unit"));
    }
    let all = MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE;
    mlockall(all).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sched::sched_getaffinity;
    use std::thread;

    #[test]
    fn one_thread_is_pinned_and_what_cannot_be_is_an_error() {
        let on = || sched_getaffinity(ITSELF).unwrap();
        let own = on();
        let first = (0..CpuSet::count()).find(|cpu| own.is_set(*cpu).unwrap()).unwrap() as u16;
        thread::spawn(move || {
            pin(&[first]).unwrap();
            let all = (0..CpuSet::count()).filter(|cpu| on().is_set(*cpu).unwrap());
            assert_eq!(all.collect::<Vec<_>>(), [usize::from(first)]);
            assert!(pin(&[1023]).unwrap_err().starts_with("processors [1023]: "));
        })
        .join()
        .unwrap();
        assert_eq!(on(), own, "the others stay as they are");
    }
}
