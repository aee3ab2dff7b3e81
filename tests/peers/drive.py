"""A CiA 402 drive as python-canopen's BaseNode402 sees it, with the default PDOs.

RPDO1..4 carry the controlword alone and with 0x6060, 0x607A, 0x60FF; TPDO1, TPDO2 are event-driven
(statusword; with 0x6061), TPDO3, TPDO4 synchronous (statusword with 0x6064; with 0x606C).
"""

from canopen.profiles.p402 import BaseNode402, State402

from common import PATIENCE, add_node, reset, wait_until

CONTROLWORD, STATUSWORD = 0x6040, 0x6041
MODE, MODE_DISPLAY = 0x6060, 0x6061
POSITION, VELOCITY = 0x6064, 0x606C
PROFILE_VELOCITY, PROFILE_ACCELERATION, QUICK_STOP_DECELERATION = 0x6081, 0x6083, 0x6085

ENABLED = State402.CW_OPERATION_ENABLED
NEW_SET_POINT = 1 << 4
TARGET_REACHED = 1 << 10
SET_POINT_ACKNOWLEDGE = 1 << 12

SYNC_PERIOD = 0.02


class Drive(BaseNode402):
    """One drive, its PDOs recorded as they come in."""

    TIMEOUT_RESET_FAULT = TIMEOUT_SWITCH_OP_MODE = PATIENCE
    TIMEOUT_SWITCH_STATE_FINAL = TIMEOUT_SWITCH_STATE_SINGLE = TIMEOUT_CHECK_TPDO = PATIENCE

    def __init__(self, node_id, eds):
        super().__init__(node_id, eds)
        self.statuswords = []
        self.positions = []
        self.velocities = []

    def start(self, network, velocity, acceleration):
        """From reset to OPERATIONAL, with SYNC running already; the drive itself stays disabled."""
        add_node(network, self)
        reset(self)
        self.setup_402_state_machine()
        # A TPDO that came twice passes for a periodic one, whose next is then waited for; of an
        # event-driven one none may come. So the state is polled in a synchronous one.
        self.tpdo_pointers[STATUSWORD] = self.tpdo[3][STATUSWORD]
        del self.tpdo_pointers[MODE_DISPLAY]
        self.tpdo[1].add_callback(lambda pdo: self.statuswords.append(pdo[STATUSWORD].raw))
        self.tpdo[3].add_callback(lambda pdo: self.positions.append(pdo[POSITION].raw))
        self.tpdo[4].add_callback(lambda pdo: self.velocities.append(pdo[VELOCITY].raw))
        self.sdo[PROFILE_VELOCITY].raw = velocity
        self.sdo[PROFILE_ACCELERATION].raw = acceleration
        self.sdo[QUICK_STOP_DECELERATION].raw = acceleration
        self.nmt.state = "OPERATIONAL"
        wait_until("statusword in TPDO1", lambda: self.statuswords)
        wait_until("samples in TPDO3 and TPDO4", lambda: self.positions and self.velocities)

    def enable(self, mode):
        """Change the mode, which the drive takes only while it is not enabled, and enable it at rest."""
        if self.state == "OPERATION ENABLED":
            self.state = "SWITCHED ON"
        self.rpdo[2][CONTROLWORD].raw = State402.CW_SWITCH_ON
        self.op_mode = mode
        wait_until("mode in TPDO2", lambda: self.tpdo[2][MODE_DISPLAY].raw == self.rpdo[2][MODE].raw)
        self.state = "OPERATION ENABLED"
        self.wait_for_target()

    def send(self, rpdo, controlword, target):
        """Send RPDO3 or RPDO4: the controlword with the target position or velocity."""
        self.rpdo[rpdo][0].raw = controlword
        self.rpdo[rpdo][1].raw = target
        self.rpdo[rpdo].transmit()

    def set_point(self, target):
        """Hand over a target position by the set-point handshake; the move begins."""
        self.send(3, ENABLED, target)
        self.send(3, ENABLED | NEW_SET_POINT, target)
        self.wait_for_bit("set-point acknowledge", SET_POINT_ACKNOWLEDGE, True)
        self.send(3, ENABLED, target)
        self.wait_for_bit("end of set-point acknowledge", SET_POINT_ACKNOWLEDGE, False)

    def wait_for_target(self):
        """Wait until the statusword reports the target reached."""
        self.wait_for_bit("target reached", TARGET_REACHED, True)

    def wait_for_bit(self, what, bit, value):
        """Wait until a bit of the statusword in TPDO1 has this value."""
        wait_until(what, lambda: bool(self.statuswords[-1] & bit) == value)

    def samples_from_now(self):
        """Forget the recorded samples and wait for the first new ones."""
        self.positions.clear()
        self.velocities.clear()
        wait_until("new samples", lambda: self.positions and self.velocities)


def state_of(statusword):
    """The name of the drive state in a statusword."""
    for name, (mask, bits) in State402.SW_MASK.items():
        if statusword & mask == bits:
            return name
    raise ValueError(f"statusword 0x{statusword:04X} is in no state")
