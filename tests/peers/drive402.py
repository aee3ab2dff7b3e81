"""Drives one axis through the profile position and profile velocity modes with python-canopen.

From reset: enable, a move of +10000 counts, a move back, a velocity run, a quick stop. Everything is
commanded and checked by PDO; the master produces the SYNC.
"""

from common import arguments, connected, say, wait_until
from drive import ENABLED, SYNC_PERIOD, Drive, state_of
from canopen.profiles.p402 import State402

DISTANCE = 10_000
SPEED = 20_000
ACCELERATION = 100_000
# What a position controller may be off at rest, and a speed while it is constant.
POSITION_TOLERANCE = 5
SPEED_TOLERANCE = SPEED // 50


def move(drive, start, offset):
    """A profile position move to `start + offset`, its path checked in TPDO3."""
    target = start + offset
    drive.samples_from_now()
    came_from = drive.positions[-1]
    drive.set_point(target)
    drive.wait_for_target()
    path = list(drive.positions)
    low, high = sorted((came_from, target))
    assert all(low - POSITION_TOLERANCE <= p <= high + POSITION_TOLERANCE for p in path), path
    assert len(set(path)) > 5, f"no motion to be seen: {path}"
    drive.samples_from_now()
    assert abs(drive.positions[-1] - target) <= POSITION_TOLERANCE, drive.positions
    say(f"at start {offset:+d}: target reached")


def run(drive):
    """A velocity run up to speed, checked in TPDO4."""
    drive.send(4, ENABLED, SPEED)
    wait_until("end of target reached", lambda: drive.velocities[-1] > 0)
    drive.wait_for_target()
    drive.samples_from_now()
    assert abs(drive.velocities[-1] - SPEED) <= SPEED_TOLERANCE, drive.velocities
    say(f"at velocity {SPEED}: target reached")


def quick_stop(drive):
    """A quick stop out of the run: the drive ramps down and disables itself (0x605A = 2)."""
    seen = len(drive.statuswords)
    drive.samples_from_now()
    drive.send(4, State402.CW_QUICK_STOP, SPEED)
    wait_until("SWITCH ON DISABLED", lambda: state_of(drive.statuswords[-1]) == "SWITCH ON DISABLED")
    states = [state_of(statusword) for statusword in drive.statuswords[seen:]]
    assert "QUICK STOP ACTIVE" in states, states
    ramp = [v for v in drive.velocities if v < SPEED - SPEED_TOLERANCE]
    assert ramp == sorted(ramp, reverse=True), f"not a ramp down: {ramp}"
    # The power goes with the end of the ramp; friction takes the last counts per second.
    wait_until("velocity 0", lambda: drive.velocities[-1] == 0)
    say("quick stop: QUICK STOP ACTIVE, SWITCH ON DISABLED, velocity 0")


def main():
    args = arguments(__doc__, node=dict(type=int, default=1, nargs="?"))
    with connected(args) as network:
        drive = Drive(args.node, args.eds)
        network.sync.start(SYNC_PERIOD)
        drive.start(network, SPEED, ACCELERATION)
        say("after reset:", drive.state)
        drive.enable("PROFILED POSITION")
        say("PROFILED POSITION:", drive.state)
        start = drive.positions[-1]
        move(drive, start, DISTANCE)
        move(drive, start, 0)
        drive.enable("PROFILED VELOCITY")
        say("PROFILED VELOCITY:", drive.state)
        run(drive)
        quick_stop(drive)
        drive.nmt.state = "PRE-OPERATIONAL"


main()
