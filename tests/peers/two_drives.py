"""Moves two drives on one bus at the same time, and shows it by the samples of their TPDO3.

Both take the SYNC of one master, so the n-th sample of one belongs to the n-th of the other.
"""

from common import arguments, connected, say
from drive import SYNC_PERIOD, Drive

SPEED = 20_000
ACCELERATION = 100_000
# Two seconds each: long enough that two set-point handshakes one after the other do not matter.
DISTANCES = {1: 40_000, 2: -40_000}
TOLERANCE = 5


def main():
    args = arguments(__doc__)
    with connected(args) as network:
        network.sync.start(SYNC_PERIOD)
        drives = [Drive(node_id, args.eds) for node_id in DISTANCES]
        for drive in drives:
            drive.start(network, SPEED, ACCELERATION)
            drive.enable("PROFILED POSITION")
        starts = [drive.positions[-1] for drive in drives]
        together = record_pairs(network, drives)
        for drive, start in zip(drives, starts):
            drive.set_point(start + DISTANCES[drive.id])
        for drive in drives:
            drive.wait_for_target()
        both_moving = sum(1 for before, now in zip(together, together[1:]) if all(b != n for b, n in zip(before, now)))
        assert both_moving > 10, f"only {both_moving} samples with both moving"
        say("both moved at once")
        for drive, start in zip(drives, starts):
            drive.samples_from_now()
            assert abs(drive.positions[-1] - start - DISTANCES[drive.id]) <= TOLERANCE, drive.positions
            say(f"node {drive.id}: target reached at {DISTANCES[drive.id]:+d}")


def record_pairs(network, drives):
    """A list that grows by the positions of both with every SYNC that both answered."""
    pairs, latest = [], {}

    def keep(drive, pdo):
        latest[drive.id] = drive.positions[-1]
        if len(latest) == len(drives):
            pairs.append(tuple(latest[d.id] for d in drives))
            latest.clear()

    for drive in drives:
        drive.tpdo[3].add_callback(lambda pdo, drive=drive: keep(drive, pdo))
    return pairs


main()
