"""Moves the four axes of a MAC4 card at once: by their instructions, then by CiA 402, each by the PDOs of its axis.

Axis n, counted from 0, has the PDOs from 64n + 1 on, its instructions in 0x2100 + n and its CiA 402 objects 0x800 n
above those of axis 0. The COB-IDs are the master's to give.
"""

import canopen

from common import add_node, arguments, connected, reset, say, wait_until

AXES = range(4)
RECORD, STRIDE, PDO_STRIDE = 0x2100, 0x800, 64
POS_END, DRIVE_ENABLED, POSITIONING_MODE = 1 << 10, 1 << 8, 8
CONTROLWORD, MODE, PROFILE_VELOCITY, DEVICE_TYPE = 0x6040, 0x6060, 0x6081, 0x67FF
NEW_SET_POINT, ACKNOWLEDGE, TARGET_REACHED = 1 << 4, 1 << 12, 1 << 10
OPERATION_ENABLED = 0x27
WAYS = [3_000, -2_000, 1_500, -4_000]
TOLERANCE = 6
SYNC_PERIOD = 0.02


class Axis:
    """One axis of the card: its PDOs with what came in last, a status and a position."""

    def __init__(self, node, number):
        self.node, self.number = node, number
        self.instructions = node.sdo[RECORD + number]
        self.target, self.state = self.pdos(5, 0x210, 255)
        self.set_point, self.drive = self.pdos(3, 0x220, 1)

    def pdos(self, number, cob_id, transmission):
        """The RPDO and the TPDO of this number and this axis, on COB-IDs of their own."""
        rpdo = self.node.rpdo[PDO_STRIDE * self.number + number]
        tpdo = self.node.tpdo[PDO_STRIDE * self.number + number]
        for pdo, base in (rpdo, cob_id), (tpdo, cob_id - 0x80):
            pdo.read()
            pdo.cob_id, pdo.enabled = base + self.number, True
            pdo.trans_type = transmission
            pdo.save()
        tpdo.seen = []
        tpdo.add_callback(lambda pdo: pdo.seen.append((pdo[0].raw, pdo[1].raw)))
        return rpdo, tpdo

    def object(self, index):
        """An object of CiA 402."""
        return self.node.sdo[index + STRIDE * self.number]

    def send(self, pdo, *values):
        """Send an RPDO."""
        for variable, value in zip(pdo, values):
            variable.raw = value
        pdo.transmit()

    def wait(self, what, pdo, mask, bits):
        """Wait until the status in a TPDO has these bits."""
        wait_until(f"{what} of axis {self.number + 1}", lambda: pdo.seen and pdo.seen[-1][0] & mask == bits)
        return pdo.seen[-1][1]


def main():
    args = arguments(__doc__)
    with connected(args) as network:
        network.sync.start(SYNC_PERIOD)
        node = add_node(network, canopen.RemoteNode(1, args.eds))
        reset(node)
        assert node.sdo[0x1000].raw == 0xFFFF0192
        axes = [Axis(node, number) for number in AXES]
        types = {axis.object(DEVICE_TYPE).raw & 0xFFFF for axis in axes}
        assert types == {0x0192}, types
        node.nmt.state = "OPERATIONAL"
        by_instructions(axes)
        by_cia402(axes)


def by_instructions(axes):
    """WAP and E in one RPDO; the user status and the position come back in a TPDO."""
    for axis in axes:
        axis.instructions["INIT"].raw = 1
        axis.instructions["ME"].raw = 1
        axis.instructions["E"].raw = 1
        axis.wait("power", axis.state, DRIVE_ENABLED, DRIVE_ENABLED)
        axis.instructions["WPV"].raw = 20 if is_servo(axis) else 1_000
        axis.instructions["WTRT"].raw = 100
        axis.instructions["MP"].raw = 1
    starts = [axis.instructions["RCP"].raw for axis in axes]
    for axis, start, way in zip(axes, starts, WAYS):
        axis.send(axis.target, start + way, 1)
    moving = lambda axis: axis.state.seen[-1][0] & (0xFF | POS_END) == POSITIONING_MODE
    wait_until("motion of all axes at once", lambda: all(moving(axis) for axis in axes))
    say("four axes move by their instructions")
    for axis, start, way in zip(axes, starts, WAYS):
        position = axis.wait("end", axis.state, POS_END, POS_END)
        assert abs(position - start - way) <= TOLERANCE, position
        say(f"axis {axis.number + 1}: positioned by {way:+d}")
        axis.instructions["MD"].raw = 1
        axis.instructions["E"].raw = 1
        axis.wait("power off", axis.state, DRIVE_ENABLED, 0)


def by_cia402(axes):
    """Controlword and target in one RPDO; statusword and position come back with each SYNC."""
    starts = []
    for axis in axes:
        axis.object(MODE).raw = 1
        axis.object(PROFILE_VELOCITY).raw = 2_000
        for word in 0x06, 0x07, 0x0F:
            axis.object(CONTROLWORD).raw = word
        starts.append(axis.wait("operation", axis.drive, 0x6F, OPERATION_ENABLED))
    for axis, start, way in zip(axes, starts, WAYS):
        axis.send(axis.set_point, 0x0F | NEW_SET_POINT, start - way)
    for axis in axes:
        axis.wait("acknowledge", axis.drive, ACKNOWLEDGE, ACKNOWLEDGE)
        axis.send(axis.set_point, 0x0F)
    say("four axes move by CiA 402")
    for axis, start, way in zip(axes, starts, WAYS):
        done = TARGET_REACHED | ACKNOWLEDGE
        position = axis.wait("end", axis.drive, done, TARGET_REACHED)
        assert abs(position - start + way) <= 12, position
        say(f"axis {axis.number + 1}: moved by {-way:+d}")
    refused_while_cia402_has_the_axis(axes[0])


def refused_while_cia402_has_the_axis(axis):
    """The other vocabulary is refused."""
    try:
        axis.instructions["ME"].raw = 1
    except canopen.SdoAbortedError as error:
        say(f"ME meanwhile: 0x{error.code:08X}")


def is_servo(axis):
    """Whether the card has analogue outputs."""
    return axis.object(DEVICE_TYPE).raw >> 16 == 2


main()
