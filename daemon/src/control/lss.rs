//! LSS by the control socket: a master that lasts for one task.

use core::time::Duration;

use canopen::{Id, LssAddress, LssFound, LssMaster, LssStep, LssTask, UNCONFIGURED};
use serde::{Deserialize, Serialize};
use tokio::time::sleep;

use super::errand::{Errand, SendOrder};
use super::request::Response;
use super::server::ToCore;
use crate::core::LinkId;
use crate::link::{Record, Watch, tap};

/// Where slaves answer.
const ANSWER: Id = Id::Standard(0x7E4);
/// How often answers are looked for.
const PERIOD: Duration = Duration::from_millis(2);

/// What became of a task.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LssResult {
    /// Name of the bus.
    pub bus: String,
    /// Vendor-ID (0x1018:01).
    pub vendor_id: u32,
    /// Product code.
    pub product_code: u32,
    /// Revision number.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
    /// The Node-ID that the slave has or gets; none if it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node_id: Option<u8>,
}

/// The task of a request: `scan`, `inquire` or `configure`.
///
/// # Errors
/// What is missing or wrong, for a reader.
pub(super) fn task(
    action: &str,
    address: Option<LssAddress>,
    node_id: Option<u8>,
) -> Result<LssTask, String> {
    match (action, address, node_id) {
        ("scan", None, None) => Ok(LssTask::Scan),
        ("inquire", Some(address), None) => Ok(LssTask::Inquire(address)),
        ("configure", address, Some(node_id @ (1..=127 | UNCONFIGURED))) => {
            Ok(LssTask::Configure { node_id, address })
        }
        ("configure", _, Some(node_id)) => Err(format!("Node-ID {node_id} is not in 1..127")),
        ("scan" | "inquire" | "configure", _, _) => {
            Err("scan takes nothing, inquire an address, configure a Node-ID and perhaps an address"
                .to_owned())
        }
        (unknown, _, _) => Err(format!("unknown LSS action `{unknown}`; known: scan, inquire, configure")),
    }
}

/// Does the task on a bus, which may be left out where there is only one.
pub(super) async fn run(to_core: &ToCore, bus: Option<String>, task: LssTask) -> Result<Response, String> {
    let (tap, mut watch) = tap();
    let watched = to_core.orders.place(Errand::Watch, (bus, tap)).await??;
    let outcome = match &*watched {
        [bus] => {
            let found = master(to_core, bus.link, &mut watch, task).await;
            found.map(|found| (bus.name.clone(), found))
        }
        several => {
            let names: Vec<&str> = several.iter().map(|bus| bus.name.as_str()).collect();
            Err(format!("say on which bus: {}", names.join(", ")))
        }
    };
    drop(watch);
    // One that is not forgotten now is when the next frame passes.
    let _ = to_core.orders.place(Errand::Unwatch, ()).await;
    let (bus, found) = outcome?;
    let [vendor_id, product_code, revision, serial] = found.address;
    let node_id = Some(found.node_id).filter(|node_id| *node_id != UNCONFIGURED);
    Ok(Response::Lss(LssResult { bus, vendor_id, product_code, revision, serial, node_id }))
}

async fn master(
    to_core: &ToCore,
    link: LinkId,
    watch: &mut Watch,
    task: LssTask,
) -> Result<LssFound, String> {
    let mut master = LssMaster::new(task);
    loop {
        let answer = core::iter::from_fn(|| watch.poll()).find_map(|record| answer(&record));
        match master.next(to_core.clock.now(), answer) {
            LssStep::Send(frame) => {
                // Answers to the question before come too late.
                while watch.poll().is_some() {}
                to_core.orders.place(Errand::Send, SendOrder { link, frame }).await??;
            }
            LssStep::Wait(deadline) => {
                let left = deadline.saturating_since(to_core.clock.now());
                sleep(left.min(PERIOD)).await;
            }
            LssStep::Done(outcome) => return outcome.map_err(|failure| failure.to_string()),
        }
    }
}

fn answer(record: &Record) -> Option<[u8; 8]> {
    match record {
        Record::Frame { frame, .. } if frame.id == ANSWER => frame.eight(),
        Record::Frame { .. } | Record::Nodes(..) => None,
    }
}
