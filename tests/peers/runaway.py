"""Leaves a drive running at speed, says so, and watches how it comes to rest when its daemon is stopped.

Prints "running", then waits: the daemon is to be stopped now. A daemon that stops well ramps its axes
down first, and the samples of TPDO4 show the ramp.
"""

from common import arguments, connected, say, wait_until
from drive import ENABLED, SYNC_PERIOD, Drive, state_of

SPEED = 20_000
ACCELERATION = 20_000
TOLERANCE = SPEED // 50


def main():
    args = arguments(__doc__)
    with connected(args) as network:
        drive = Drive(1, args.eds)
        network.sync.start(SYNC_PERIOD)
        drive.start(network, SPEED, ACCELERATION)
        drive.enable("PROFILED VELOCITY")
        drive.send(4, ENABLED, SPEED)
        wait_until("speed", lambda: drive.velocities[-1] >= SPEED - TOLERANCE)
        say("running")
        seen = len(drive.velocities)
        wait_until("SWITCH ON DISABLED", lambda: state_of(drive.statuswords[-1]) == "SWITCH ON DISABLED")
        ramp = [v for v in drive.velocities[seen:] if v < SPEED - TOLERANCE]
        assert len(ramp) > 5 and ramp == sorted(ramp, reverse=True) and ramp[-1] < SPEED / 2, f"no ramp down: {ramp}"
        say("ramped down, then SWITCH ON DISABLED")


main()
