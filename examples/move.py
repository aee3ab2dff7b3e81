"""Moves the demo's first motor by 10000 counts. Start `cargo run --release -- run --demo` first; needs `pip install canopen python-can`."""

import sys
import time

import canopen

port = int(sys.argv[1]) if len(sys.argv) > 1 else 29536
network = canopen.Network()
network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
motor = network.add_node(1).sdo


def write(index, value, size):
    motor.download(index, 0, value.to_bytes(size, "little", signed=value < 0))


def read(index):
    return int.from_bytes(motor.upload(index, 0), "little", signed=True)


def wait_for(bits, value):
    while read(0x6041) & bits != value:
        time.sleep(0.01)


write(0x6060, 1, 1)            # mode of operation: profile position
write(0x6081, 20_000, 4)       # profile velocity, counts/s
write(0x6083, 100_000, 4)      # profile acceleration, counts/s^2
for command in 0x06, 0x07, 0x0F:
    write(0x6040, command, 2)  # controlword: shutdown, switch on, enable operation
wait_for(0x6F, 0x27)           # statusword: operation enabled

start = read(0x6064)
write(0x607A, start + 10_000, 4)
write(0x6040, 0x1F, 2)         # new set-point ...
wait_for(0x1000, 0x1000)       # ... acknowledged ...
write(0x6040, 0x0F, 2)
wait_for(0x0400, 0x0400)       # ... and reached
print(f"moved from {start} to {read(0x6064)}")

write(0x6040, 0x00, 2)         # power off
network.disconnect()
