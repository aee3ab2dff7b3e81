"""One of several checks of the CiA 301 services of node 1, each named on the command line.

boot-up       a reset is answered by a boot-up message, and leaves the node PRE-OPERATIONAL
nmt           each NMT command leads to the state CiA 301 names, shown by the heartbeat
heartbeat     the heartbeat comes at the period of 0x1017, and stops when that is 0
emergency     an RPDO with too few bytes earns an EMCY with error code 0x8210
stopped       a stopped node answers no SDO request
mapping       TPDO1 mapped anew by SDO sends the new objects, and a reset brings the default back
"""

import time

import canopen
from canopen.nmt import NMT_STATES

from common import PATIENCE, add_node, arguments, connected, reset, say, wait_until

HEARTBEAT_TIME = 0x1017
POSITION, STATUSWORD, VELOCITY = 0x6064, 0x6041, 0x606C
PDO_LENGTH_ERROR = 0x8210


def boot_up(network, node):
    reset(node)
    node.sdo[HEARTBEAT_TIME].raw = 50
    wait_until("heartbeat", lambda: len(node.states) > 1)
    say("0x00, then", node.nmt.state)


def nmt(network, node):
    reset(node)
    node.sdo[HEARTBEAT_TIME].raw = 50
    for state in ["OPERATIONAL", "STOPPED", "OPERATIONAL", "PRE-OPERATIONAL"]:
        node.nmt.state = state
        # As the heartbeat says it: python-canopen's own state follows the command at once.
        wait_until(state, lambda: NMT_STATES[node.states[-1]] == state)
        say(state)


def heartbeat(network, node):
    reset(node)
    stamps = []
    network.subscribe(0x700 + node.id, lambda cob_id, data, stamp: stamps.append(stamp))
    node.sdo[HEARTBEAT_TIME].raw = 100
    wait_until("ten heartbeats", lambda: len(stamps) >= 10)
    node.sdo[HEARTBEAT_TIME].raw = 0
    mean = (stamps[9] - stamps[0]) / 9
    assert 0.095 < mean < 0.110, f"a mean period of {mean * 1000:.1f} ms"
    count = len(stamps)
    silent_until = time.monotonic() + 0.5
    wait_until("half a second", lambda: time.monotonic() > silent_until)
    assert len(stamps) == count, "heartbeats after they were switched off"
    say("every 100 ms, then none")


def emergency(network, node):
    reset(node)
    node.nmt.state = "OPERATIONAL"
    network.send_message(0x200 + node.id, b"\x06")
    wait_until("EMCY", lambda: node.emcy.log)
    say(f"0x{node.emcy.log[0].code:04X}")
    assert node.emcy.log[0].code == PDO_LENGTH_ERROR


def stopped(network, node):
    reset(node)
    node.nmt.state = "STOPPED"
    node.sdo.RESPONSE_TIMEOUT = 0.3
    try:
        node.sdo[0x1000].raw
    except canopen.SdoCommunicationError:
        say("no answer")
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    node.nmt.state = "PRE-OPERATIONAL"
    say(f"0x1000 = 0x{node.sdo[0x1000].raw:08X}")


def mapping(network, node):
    reset(node)
    tpdo = node.tpdo[1]
    tpdo.read()
    default = [(variable.index, variable.length) for variable in tpdo]
    tpdo.clear()
    tpdo.add_variable(VELOCITY)
    tpdo.add_variable(STATUSWORD)
    tpdo.trans_type = 1
    tpdo.save()
    frames = []
    tpdo.add_callback(lambda pdo: frames.append(bytes(pdo.data)))
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.05)
    wait_until("synchronous TPDO1", lambda: len(frames) > 3)
    assert len(frames[-1]) == 6, frames
    velocity, statusword = tpdo[VELOCITY].raw, tpdo[STATUSWORD].raw
    assert velocity == node.sdo[VELOCITY].raw and statusword == node.sdo[STATUSWORD].raw
    say("mapped anew:", len(frames[-1]), "bytes, velocity and statusword as by SDO")
    reset(node)
    tpdo.read()
    assert [(variable.index, variable.length) for variable in tpdo] == default
    say("after reset: the default mapping")


CHECKS = {check.__name__.replace("_", "-"): check for check in (boot_up, nmt, heartbeat, emergency, stopped, mapping)}


def main():
    args = arguments(__doc__, check=dict(choices=CHECKS))
    with connected(args) as network:
        CHECKS[args.check](network, add_node(network, canopen.RemoteNode(1, args.eds)))


main()
