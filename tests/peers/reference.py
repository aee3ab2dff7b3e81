"""One of several checks of devices of the profile canopen-reference, each named on the command line.

small       300 bytes go to the DOMAIN 0x2121 of node 1 and come back by block transfer, both with CRC
block       1 MB goes to the DOMAIN 0x2121 of node 1 and comes back by block transfer, both with CRC
many        127 nodes: a reset of all brings every boot-up message, then each answers an SDO request
"""

import time

import canopen

from common import add_node, arguments, connected, say, wait_until

DOMAIN = 0x2121
MEGABYTE = 1_000_000
NODES = range(1, 128)


def block(network, eds, size=MEGABYTE):
    node = add_node(network, canopen.RemoteNode(1, eds))
    data = bytes((number * 31 + number // 251) % 256 for number in range(size))
    start = time.monotonic()
    with node.sdo.open(DOMAIN, 0, "wb", size=len(data), block_transfer=True) as domain:
        domain.write(data)
    down = time.monotonic() - start
    start = time.monotonic()
    with node.sdo.open(DOMAIN, 0, "rb", block_transfer=True) as domain:
        read = domain.read()
    up = time.monotonic() - start
    assert read == data, f"{len(read)} bytes came back, or not the same"
    say(size, "bytes down and up")
    # Only for whoever runs this by hand: a test does not compare times.
    return f"down {down:.1f} s, up {up:.1f} s"


def small(network, eds):
    return block(network, eds, 300)


def many(network, eds):
    booted = set()
    for node_id in NODES:
        network.subscribe(0x700 + node_id, lambda cob_id, data, stamp: booted.add(cob_id - 0x700))
    network.nmt.state = "RESET"
    wait_until("all boot-up messages", lambda: booted == set(NODES))
    say(len(booted), "boot-up messages")
    dictionary = canopen.import_od(eds)
    answers = 0
    for node_id in NODES:
        node = add_node(network, canopen.RemoteNode(node_id, dictionary))
        cob_id = node.sdo.upload(0x1200, 2)
        answers += int.from_bytes(cob_id, "little") == 0x580 + node_id
    say(answers, "answers")


CHECKS = {check.__name__: check for check in (block, small, many)}


def main():
    args = arguments(__doc__, check=dict(choices=CHECKS), **{"--times": dict(action="store_true")})
    with connected(args) as network:
        times = CHECKS[args.check](network, args.eds)
    if args.times and times:
        say(times)


main()
