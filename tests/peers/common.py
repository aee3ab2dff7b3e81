"""What the peer scripts share: their arguments, the connection, and waiting with a deadline.

A script exits with an exception when the device does not do what it should, and prints only what is
the same in every run.
"""

import argparse
import logging
import time
from contextlib import contextmanager

import canopen

# A user-mode Linux on a busy machine is slow; nothing of the device is.
PATIENCE = 30.0
POLL_PERIOD = 0.005


def arguments(doc, **more):
    """Parse the arguments all scripts know, and `more`: name=dict for add_argument."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interface", choices=["socketcan", "socketcand"], required=True)
    parser.add_argument("--channel", required=True, help="vcan0, or the bus name of a socketcand server")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=29536)
    parser.add_argument("--eds", required=True)
    for name, options in more.items():
        parser.add_argument(name, **options)
    return parser.parse_args()


@contextmanager
def connected(args):
    """A canopen.Network on the bus that the arguments name."""
    logging.basicConfig(level=logging.ERROR)
    network = canopen.Network()
    where = {"host": args.host, "port": args.port} if args.interface == "socketcand" else {}
    network.connect(interface=args.interface, channel=args.channel, **where)
    try:
        yield network
    finally:
        # Which also ends the SYNC, if one was started.
        network.disconnect()


def add_node(network, node):
    """Add a node, patient with its SDO answers, and keep each NMT state it reports in `node.states`."""
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    node.states = []
    node.nmt.add_heartbeat_callback(node.states.append)
    return node


def reset(node):
    """Reset the node and wait for its boot-up message, after which it is PRE-OPERATIONAL."""
    node.states.clear()
    node.nmt.state = "RESET"
    wait_until("boot-up", lambda: 0 in node.states)


def wait_until(what, condition, seconds=PATIENCE):
    """Return once `condition()` is true, whose value is returned."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"no {what} within {seconds:.0f} s")
        time.sleep(POLL_PERIOD)
    return value


def say(*words):
    """Print a line that a test may wait for."""
    print(*words, flush=True)
