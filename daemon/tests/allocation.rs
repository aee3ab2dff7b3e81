//! Memory over a thousand reloads.

mod common;

use std::sync::Arc;

use allocation_counter::measure;
use common::{Bench, LINK, plan};
use daemon::core::{LinkId, Unit};
use profiles::Profile;

/// Rounds after which vectors have their sizes.
const WARM_UP: usize = 20;

/// A device of two nodes goes and another one comes, and the others have traffic.
fn reload(bench: &mut Bench, profiles: &[Arc<Profile>; 2], round: usize) {
    let device = bench.core.find("y").unwrap();
    bench.core.shut_down_device(bench.now, device);
    bench.core.conclude_audit(device);
    while bench.core.poll_notice().is_some() {}
    while bench.core.poll_audit().is_some() {}
    assert!(bench.core.leave(device).is_some());
    let unit = Unit::new(&plan("y", &profiles[round % 2], &[(0, 2), (1, 2)]), bench.now).unwrap();
    bench.core.join(unit);
    for link in [0, 1] {
        bench.core.start(bench.now, LinkId(link));
    }
    bench.sent_on(LINK);
    while bench.core.poll_resubscribed().is_some() {}
    assert_eq!(bench.send("601#4000100000000000"), ["581#4300100092010200"]);
    // The last command of the device that then leaves.
    bench.send("602#2B40600006000000");
}

#[test]
fn memory_does_not_grow_over_a_thousand_reloads() {
    let profiles = ["cia402-servo", "jvl-mac00-fc4"]
        .map(|name| Arc::new(Profile::embedded(name, None).unwrap().unwrap()));
    let mut bench = Bench::new(&[&[(0, 1)], &[(0, 2), (1, 2)]]);
    bench.core.keep_audit();
    (0..WARM_UP).for_each(|round| reload(&mut bench, &profiles, round));

    let counted = measure(|| (0..1000).for_each(|round| reload(&mut bench, &profiles, round)));

    assert!(counted.count_total > 1000, "{counted:?}");
    assert_eq!(counted.bytes_current, 0, "{counted:?}");
}
