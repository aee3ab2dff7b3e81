//! Registers of the Ethernet modules: their manual, section 8.1.

pub(crate) const TABLE: &str = "
0 | Sub-index count | 8 | const | 63 | -
1 | MAC address, high | 32 | ro | - | -
2 | MAC address, low | 32 | ro | - | -
3 | IP address | 32 | rw | - | -
4 | Net mask | 32 | rw | - | -
5 | Gateway | 32 | rw | - | -
6 | Setup bits | 32 | rw | 0 | -
7 | Digital outputs | 32 | rw | 0 | -
8 | Poll division factor | 32 | rw | 0 | -
9 | Station alias | 32 | rw | 0 | -
10 | Modbus time-out | 32 | rw | - | -
11 | Input mask | 32 | rw | - | -
15 | Command register | 32 | wo | - | -
16 | Cyclic read 1 | 32 | rw | 2 | -
17 | Cyclic read 2 | 32 | rw | 10 | -
18 | Cyclic read 3 | 32 | rw | 12 | -
19 | Cyclic read 4 | 32 | rw | 169 | -
20 | Cyclic read 5 | 32 | rw | 35 | -
21 | Cyclic read 6 | 32 | rw | - | -
22 | Cyclic read 7 | 32 | rw | - | -
23 | Cyclic read 8 | 32 | rw | - | -
24 | Cyclic write 1 | 32 | rw | 2 | -
25 | Cyclic write 2 | 32 | rw | 3 | -
26 | Cyclic write 3 | 32 | rw | 5 | -
27 | Cyclic write 4 | 32 | rw | 7 | -
28 | Cyclic write 5 | 32 | rw | 0 | -
29 | Cyclic write 6 | 32 | rw | - | -
30 | Cyclic write 7 | 32 | rw | - | -
31 | Cyclic write 8 | 32 | rw | - | -
32 | Serial number | 32 | ro | - | -
33 | Hardware version | 32 | ro | - | -
34 | Software version | 32 | ro | - | -
35 | Motor time-outs | 32 | ro | - | -
36 | Retries | 32 | ro | - | -
37 | Discarded frames | 32 | ro | - | -
38 | Frames | 32 | ro | - | -
39 | SPI CRC errors | 32 | ro | - | -
47 | Digital inputs | 32 | ro | - | -
48 | Status bits | 32 | ro | - | -
49 | Protocol | 32 | ro | - | -
";
