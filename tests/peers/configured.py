"""After our NMT master has booted its network: node 1, a drive, is configured and OPERATIONAL, node 2, which is not the
device that was expected, is PRE-OPERATIONAL and as it was.
"""

import canopen

from common import add_node, arguments, connected, say, wait_until

ACCELERATION = 12345


def main():
    with connected(args := arguments(__doc__)) as network:
        configured, refused = [add_node(network, canopen.RemoteNode(node_id, args.eds)) for node_id in (1, 2)]
        wait_until("OPERATIONAL", lambda: configured.nmt.state == "OPERATIONAL")
        wait_until("PRE-OPERATIONAL", lambda: refused.nmt.state == "PRE-OPERATIONAL")
        assert configured.sdo[0x6083].raw == ACCELERATION
        assert refused.sdo[0x6083].raw != ACCELERATION

        configured.tpdo.read()
        assert [variable.index for variable in configured.tpdo[1].map] == [0x6041, 0x6064]
        samples = []
        configured.tpdo[1].add_callback(lambda pdo: samples.append(pdo[0x6064].raw))
        network.sync.transmit()
        wait_until("TPDO1", lambda: samples)
        say("configured and started, and the other one left alone")


main()
