"""Takes one axis through every mode of operation of CiA 402 with python-canopen's BaseNode402.

Modes are changed while the drive is enabled; each is made to move the axis in its own way, and the
next one begins when 0x6061 shows it.
"""

import time

from common import arguments, connected, say, wait_until
from drive import CONTROLWORD, ENABLED, MODE_DISPLAY, SYNC_PERIOD, Drive

SPEED = 20_000
ACCELERATION = 100_000
POSITION_TOLERANCE = 5
# Per mille of the rated torque: above the friction, which is a hundredth.
TORQUE, NO_TORQUE = 30, 0
TARGET_TORQUE, TORQUE_SLOPE = 0x6071, 0x6087
VL_TARGET, VL_ENABLED = 0x6042, ENABLED | 0x70
HOMING_METHOD, HOME_OFFSET = 0x6098, 0x607C
INTERPOLATION_RECORD, INTERPOLATION_TIME = 0x60C1, 0x60C2
IP_ENABLED = ENABLED | 0x10


def position(drive):
    drive.samples_from_now()
    return drive.positions[-1]


def turns(drive):
    """Wait until the axis turns in positive direction."""
    wait_until("positive velocity", lambda: drive.velocities[-1] > 1000)


def stands(drive):
    wait_until("velocity 0", lambda: drive.velocities[-1] == 0)


def arrives(drive, target):
    wait_until(f"position {target}", lambda: abs(drive.positions[-1] - target) <= POSITION_TOLERANCE)


def word(drive, value):
    drive.controlword = value


def profiled_position(drive):
    target = position(drive) + 5000
    drive.set_point(target)
    drive.wait_for_target()
    arrives(drive, target)


def velocity(drive):
    word(drive, VL_ENABLED)
    drive.sdo[VL_TARGET].raw = 300
    turns(drive)
    drive.sdo[VL_TARGET].raw = 0
    stands(drive)
    word(drive, ENABLED)


def profiled_velocity(drive):
    drive.send(4, ENABLED, SPEED)
    turns(drive)
    drive.wait_for_target()
    drive.send(4, ENABLED, 0)
    stands(drive)


def profiled_torque(drive):
    drive.sdo[TORQUE_SLOPE].raw = 1000
    drive.sdo[TARGET_TORQUE].raw = TORQUE
    turns(drive)
    drive.wait_for_target()
    drive.sdo[TARGET_TORQUE].raw = NO_TORQUE


def homing(drive):
    """The next index pulse upwards, and then the place where the axis stands."""
    drive.sdo[HOME_OFFSET].raw = 0
    for method in (34, 37):
        drive.sdo[HOMING_METHOD].raw = method
        assert drive.homing(), f"method {method}: {drive._homing_status()}"
        arrives(drive, 0)
        word(drive, ENABLED)


def interpolated_position(drive):
    set_cycle(drive)
    start = position(drive)
    word(drive, IP_ENABLED)
    for step in range(1, 21):
        drive.sdo[INTERPOLATION_RECORD][1].raw = start + 50 * step
        time.sleep(SYNC_PERIOD)
    arrives(drive, start + 1000)
    word(drive, ENABLED)


def cyclic_position(drive):
    set_cycle(drive)
    start = position(drive)
    # A master goes on telling where to be when it is there; a stream that breaks off is a lost master.
    for step in range(1, 41):
        drive.send(3, ENABLED, start + 50 * min(step, 20))
        time.sleep(SYNC_PERIOD)
    arrives(drive, start + 1000)


def cyclic_velocity(drive):
    for _ in range(20):
        drive.send(4, ENABLED, SPEED)
        time.sleep(SYNC_PERIOD)
    turns(drive)
    drive.send(4, ENABLED, 0)
    stands(drive)


def cyclic_torque(drive):
    drive.sdo[TARGET_TORQUE].raw = TORQUE
    turns(drive)
    drive.sdo[TARGET_TORQUE].raw = NO_TORQUE


def set_cycle(drive):
    """The interpolation time is the SYNC period: 2 times 10^-2 s."""
    drive.sdo[INTERPOLATION_TIME][1].raw = 2
    drive.sdo[INTERPOLATION_TIME][2].raw = -2


MODES = {
    "PROFILED POSITION": profiled_position,
    "VELOCITY": velocity,
    "PROFILED VELOCITY": profiled_velocity,
    "PROFILED TORQUE": profiled_torque,
    "HOMING": homing,
    "INTERPOLATED POSITION": interpolated_position,
    "CYCLIC SYNCHRONOUS POSITION": cyclic_position,
    "CYCLIC SYNCHRONOUS VELOCITY": cyclic_velocity,
    "CYCLIC SYNCHRONOUS TORQUE": cyclic_torque,
}


def main():
    args = arguments(__doc__, node=dict(type=int, default=1, nargs="?"))
    with connected(args) as network:
        drive = Drive(args.node, args.eds)
        network.sync.start(SYNC_PERIOD)
        drive.start(network, SPEED, ACCELERATION)
        drive.enable("PROFILED POSITION")
        # The RPDO that carries the mode carries the controlword, too.
        drive.rpdo[2][CONTROLWORD].raw = ENABLED
        for mode, exercise in MODES.items():
            drive.op_mode = mode
            shown = lambda: drive.tpdo[2][MODE_DISPLAY].raw == drive.rpdo[2][0x6060].raw
            wait_until(f"{mode} in TPDO2", shown)
            exercise(drive)
            say(f"{mode}: {drive.state}")
        drive.op_mode = "PROFILED POSITION"
        stands(drive)
        say("back in PROFILED POSITION: stands")
        drive.nmt.state = "PRE-OPERATIONAL"


main()
