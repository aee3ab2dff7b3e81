"""Finds eight nodes without a Node-ID by fastscan, gives each one, has it stored, and talks to them.

A ninth node, whose Node-ID is known, tells when nobody answers: what it is asked after a scan it answers after the
others have answered the scan. So the scan depends on no time-out, and each of its zero bits costs none.
"""

import queue
from types import SimpleNamespace

from common import PATIENCE, add_node, arguments, connected, say, wait_until

import canopen

COUNT = 8
NINTH = 100


class Answers(queue.Queue):
    """LSS answers; while the ninth node is asked, one that is not there when it has answered will not come."""

    ask_ninth = None

    def get(self, block=True, timeout=None):
        if Answers.ask_ninth is None:
            return super().get(block, timeout)
        Answers.ask_ninth()
        return super().get(block=False)


canopen.lss.queue = SimpleNamespace(Queue=Answers, Empty=queue.Empty)
canopen.lss.LssMaster.RESPONSE_TIMEOUT = PATIENCE


def main():
    args = arguments(__doc__)
    with connected(args) as network:
        lss = network.lss
        ninth = add_node(network, canopen.RemoteNode(NINTH, args.eds))

        def fast_scan():
            Answers.ask_ninth = lambda: ninth.sdo.upload(0x1000, 0)
            try:
                return lss.fast_scan()
            finally:
                Answers.ask_ninth = None

        booted = []
        for node_id in range(1, COUNT + 1):
            network.subscribe(0x700 + node_id, lambda can_id, data, _: booted.append((can_id - 0x700, bytes(data))))
        found = {}
        for node_id in range(1, COUNT + 1):
            is_found, address = fast_scan()
            assert is_found, f"no node without a Node-ID is left for {node_id}"
            assert lss.inquire_node_id() == 0xFF
            lss.configure_node_id(node_id)
            lss.store_configuration()
            found[node_id] = address
            lss.send_switch_state_global(lss.WAITING_STATE)
            wait_until(f"boot-up of {node_id}", lambda: (node_id, b"\0") in booted)
        assert len({tuple(address) for address in found.values()}) == COUNT, found
        assert not fast_scan()[0], "a node is left over"
        say(f"{COUNT} nodes found and stored")
        for node_id, address in found.items():
            node = add_node(network, canopen.RemoteNode(node_id, args.eds))
            identity = [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
            assert identity == address, (identity, address)
        say("each has the identity that the scan has found")
        assert lss.send_switch_state_selective(*found[3])
        assert lss.inquire_node_id() == 3
        lss.send_switch_state_global(lss.WAITING_STATE)
        say("node 3 is selected by its identity")


main()
