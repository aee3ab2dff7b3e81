"""What the peer scripts share: their arguments, the connection, and waiting with a deadline.

A script exits with an exception when the device does not do what it should, and prints only what is
the same in every run.
"""

import argparse
import logging
import socket
import time
from contextlib import contextmanager

import canopen

# A user-mode Linux on a busy machine is slow; nothing of the device is.
PATIENCE = 30.0
POLL_PERIOD = 0.005
# Bytes for frames that wait for a script that gets no processor time: what is lost never comes again.
RECEIVE_BUFFER = 16 << 20


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
    if args.interface == "socketcan":
        make_room(network.bus.socket)
    try:
        yield network
    finally:
        # Which also ends the SYNC, if one was started.
        network.disconnect()


def make_room(can):
    """Ask for a large receive buffer, beyond what is allowed to everybody if this process may."""
    so_rcvbufforce = 33
    try:
        can.setsockopt(socket.SOL_SOCKET, so_rcvbufforce, RECEIVE_BUFFER)
    except PermissionError:
        can.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)


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
