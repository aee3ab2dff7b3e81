"""Clients of the ASCII gateway: plain sockets and lines of text, no CAN and no CANopen.

Arguments: a TCP port that leads to net 1 and 2, and the path of a Unix socket that leads to net 3. On each net is a
servo, node 5; on net 1 is also a node without a Node-ID.
"""

import base64
import socket
import sys
import threading

from common import PATIENCE, say


class Client:
    """A client, with what it has been told beside answers."""

    def __init__(self, place):
        family = socket.AF_INET if isinstance(place, tuple) else socket.AF_UNIX
        self.socket = socket.socket(family)
        self.socket.settimeout(PATIENCE)
        self.socket.connect(place)
        self.lines = self.socket.makefile("r", encoding="ascii", newline="\r\n")
        self.sequence = 0
        self.events = []

    def give(self, *commands):
        """Give commands without waiting for their answers."""
        text = ""
        for command in commands:
            self.sequence += 1
            text += f"[{self.sequence}] {command}\r\n"
        self.socket.sendall(text.encode())

    def next(self):
        """The next line."""
        line = self.lines.readline()
        assert line.endswith("\r\n"), f"the connection has ended: {line!r}"
        return line.removesuffix("\r\n")

    def answer(self):
        """The next answer, with its sequence number."""
        while not (line := self.next()).startswith("["):
            self.events.append(line)
        return line

    def ask(self, command):
        """Give a command; its answer."""
        self.give(command)
        sequence, _, answer = self.answer().partition("] ")
        assert sequence == f"[{self.sequence}", sequence
        return answer

    def wait_for(self, beginning):
        """Wait until it is told something that begins so, which is returned."""
        while not (found := [event for event in self.events if event.startswith(beginning)]):
            self.events.append(self.next())
        self.events.remove(found[0])
        return found[0]


def objects(first, second):
    """Objects are read and written; two clients ask the same node at once."""
    assert first.ask("5 r 0x1018 2 u32") == "1026"
    assert first.ask("1 5 read 0x1018 2 x32") == "0x00000402"
    assert first.ask("5 w 0x6081 0 u32 1234") == "OK"
    assert second.ask("5 r 0x6081 0 u32") == "1234"
    assert first.ask("5 r 0x1008 0 vs") == '"CiA 402 servo drive"'
    assert first.ask("5 r 0x5000 0 u8").startswith("ERROR:0x06020000 ")
    assert first.ask("5 w 0x1018 1 u32 1").startswith("ERROR:0x06010002 ")
    assert first.ask("set sdo_block 1") == "OK"
    assert base64.b64decode(first.ask("5 r 0x1021 0 d")).startswith(b"[FileInfo]\nFileName=cia402-servo.eds\n")
    commands = [f"5 r 0x6083 0 u32 # {number}" for number in range(50)]
    threads = [threading.Thread(target=client.give, args=commands) for client in (first, second)]
    for thread in threads:
        thread.start()
    answers = [[client.answer() for _ in commands] for client in (first, second)]
    for thread in threads:
        thread.join()
    for client, told in zip((first, second), answers):
        start = client.sequence - len(commands) + 1
        assert told == [f"[{start + number}] 409600" for number in range(len(commands))], told


def events(first, second):
    """Both clients are told that a node boots, and what is wrong with it."""
    assert first.ask("5 reset node") == "OK"
    for client in (first, second):
        client.wait_for("1 5 BOOT_UP")
    assert first.ask("5 start") == "OK"
    assert first.ask("set tpdo 1 0x205 event 1 u8") == "OK"
    assert first.ask("w p 1 1 0") == "OK"
    for client in (first, second):
        say(client.wait_for("1 5 EMCY"))


def process_data(first):
    """A PDO of the node is received: the first of a servo has the statusword."""
    assert first.ask("set rpdo 1 0x185 event 1 0x6041 0 u16") == "OK"
    assert first.ask("5 preop") == "OK"
    assert first.ask("5 w 0x1800 2 u8 255") == "OK"
    assert first.ask("5 start") == "OK"
    statusword = int(first.ask("5 r 0x6041 0 u16"))
    if not any(event.startswith("1 pdo 1 1") for event in first.events):
        assert first.ask("5 w 0x6040 0 u16 6") == "OK"
    first.wait_for("1 pdo 1 1 0x")
    assert statusword & 0x6F in (0x40, 0x50), statusword


def slaves(first, second):
    """The node without a Node-ID is found and gets one. Only the one of its address takes as long as a machine may be slow."""
    say("found", first.ask("_lss_fastscan 3000"))
    assert first.ask("lss_set_node 9") == "OK"
    assert first.ask("lss_switch_glob 0") == "OK"
    second.wait_for("1 9 BOOT_UP")
    say("node 9 has the serial number", second.ask("9 r 0x1018 4 u32"))


def networks(first, third):
    """Networks have numbers, and a place leads to its own ones only."""
    assert first.ask("set network 3") == "ERROR:106 #unsupported net"
    assert first.ask("2 5 r 0x1000 0 x32") == "0x00020192"
    assert third.ask("5 r 0x1000 0 x32") == "0x00020192"
    assert third.ask("1 5 start") == "ERROR:106 #unsupported net"
    # Nobody has this Node-ID.
    assert third.ask("99 start") == "OK"


def main():
    port, path = int(sys.argv[1]), sys.argv[2]
    first, second, third = (Client(place) for place in (("127.0.0.1", port), ("127.0.0.1", port), path))
    assert first.ask("5 start") == "ERROR:104 #no default net set"
    for client in (first, second):
        assert client.ask("set network 1") == "OK"
        # Machines may be slow; no node is.
        assert client.ask("set sdo_timeout 30000") == "OK"
    networks(first, third)
    objects(first, second)
    events(first, second)
    process_data(first)
    slaves(first, second)
    assert not second.events or all("ERROR" not in event for event in second.events), second.events


main()
