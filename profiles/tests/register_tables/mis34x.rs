//! Motor registers of the MIS34x and MIS43x: Ethernet module manual, section 11.4; the page of 1-5 is lost.

pub(crate) const TABLE: &str = "
1 | PROG_VERSION | 32 | - | - | -
2 | MODE_REG | 32 | - | - | -
3 | P_SOLL | 32 | - | - | -
5 | V_SOLL | 32 | - | - | -
6 | A_SOLL | 32 | rw | 1000 | 1..500000
7 | RUN_CURRENT | 32 | rw | 511 | 0..1533
8 | STANDBY_TIME | 32 | rw | 500 | 1..65535
9 | STANDBY_CURRENT | 32 | rw | 128 | 0..1533
10 | P_IST | 32 | rw | - | -2147483648..2147483647
12 | V_IST | 32 | ro | - | -300000..300000
13 | V_START | 32 | rw | 100 | 1..300000
14 | GEAR1 | 32 | rw | 1600 | -32768..32767
15 | GEAR2 | 32 | rw | 2000 | -32768..32767
16 | ENCODER_POS | 32 | rw | - | -2147483648..2147483647
18 | INPUTS | 32 | ro | - | -
19 | OUTPUTS | 32 | rw | - | -
20 | FLWERR | 32 | ro | - | -2147483648..2147483647
22 | FLWERRMAX | 32 | rw | - | -2147483648..2147483647
24 | COMMAND | 32 | rw | - | -
25 | STATUSBITS | 32 | ro | - | -
26 | TEMP | 32 | ro | - | -
28 | MIN_P_IST | 32 | rw | - | -2147483648..2147483647
30 | MAX_P_IST | 32 | rw | - | -2147483648..2147483647
32 | ACC_EMERG | 32 | rw | 10000 | 1..500000
33 | IN_POSITION_WINDOW | 32 | rw | - | 0..32767
34 | IN_POSITION_COUNT | 32 | rw | - | 0..100
35 | ERR_BITS | 32 | rw | 0 | -
36 | WARN_BITS | 32 | rw | - | -
37 | STARTMODE | 32 | rw | 0 | 0..3
38 | P_HOME | 32 | rw | 0 | -2147483648..2147483647
40 | V_HOME | 32 | rw | -5000 | -300000..300000
41 | T_HOME | 32 | rw | - | -
42 | HOMEMODE | 32 | rw | 0 | 0..14
43 | P_REG_P | 32 | rw | 0 | 1..8
44 | V_REG_P | 32 | rw | 0 | 1..8
45 | A_REG_P | 32 | rw | 0 | 1..4
46 | AbsEncPos | 32 | ro | 0 | 0..409600
47 | EXTENCODER | 32 | ro | 0 | -32768..32767
49 | P1 | 32 | rw | 0 | -2147483648..2147483647
51 | P2 | 32 | rw | 0 | -2147483648..2147483647
53 | P3 | 32 | rw | 0 | -2147483648..2147483647
55 | P4 | 32 | rw | 0 | -2147483648..2147483647
57 | P5 | 32 | rw | 0 | -2147483648..2147483647
59 | P6 | 32 | rw | 0 | -2147483648..2147483647
61 | P7 | 32 | rw | 0 | -2147483648..2147483647
63 | P8 | 32 | rw | 0 | -2147483648..2147483647
65 | V1 | 32 | rw | - | 0..300000
66 | V2 | 32 | rw | - | 0..300000
67 | V3 | 32 | rw | - | 0..300000
68 | V4 | 32 | rw | - | 0..300000
69 | V5 | 32 | rw | - | 0..300000
70 | V6 | 32 | rw | - | 0..300000
71 | V7 | 32 | rw | - | 0..300000
72 | V8 | 32 | rw | - | 0..300000
73 | A1 | 32 | rw | - | 1..500000
74 | A2 | 32 | rw | - | 1..500000
75 | A3 | 32 | rw | - | 1..500000
76 | A4 | 32 | rw | - | 1..500000
77 | T1 | 32 | rw | 511 | 0..1533
78 | T2 | 32 | rw | 511 | 0..1533
79 | T3 | 32 | rw | 511 | 0..1533
80 | T4 | 32 | rw | 511 | 0..1533
81 | Analog filtered 1 | 32 | ro | 0 | 0..4095
82 | Analog filtered 2 | 32 | ro | 0 | 0..4095
83 | Analog filtered 3 | 32 | ro | 0 | 0..4095
84 | Analog filtered 4 | 32 | ro | 0 | 0..4095
85 | Analog filtered 5 | 32 | ro | 0 | 0..4095
86 | Analog filtered 6 | 32 | ro | 0 | 0..4095
87 | Analog filtered 7 | 32 | ro | 0 | 0..4095
88 | Analog filtered 8 | 32 | ro | 0 | 0..4095
89 | AnalogInput 1 | 32 | ro | - | 0..4095
90 | AnalogInput 2 | 32 | ro | - | 0..4095
91 | AnalogInput 3 | 32 | ro | - | 0..4095
92 | AnalogInput 4 | 32 | ro | - | 0..4095
93 | AnalogInput 5 | 32 | ro | - | 0..4095
94 | AnalogInput 6 | 32 | ro | - | 0..4095
95 | AnalogInput 7 | 32 | ro | - | 0..4095
96 | AnalogInput 8 | 32 | ro | - | 0..4095
97 | BUSVOL | 32 | ro | - | 0..4095
98 | MIN_BUSVOL | 32 | rw | 15 | 0..4095
99 | ENCODER_TYPE | 32 | ro | - | 0..10
100 | AFZUP_WriteBits | 32 | rw | 0 | -
101 | AFZUP_ReadIndex | 32 | rw | 0 | 0..32775
102 | AFZUP_ConfMin | 32 | rw | 0 | -
103 | AFZUP_ConfMax | 32 | rw | 4095 | -
104 | AFZUP_MaxSlope | 32 | rw | 4095 | -
105 | AFZUP_Filter | 32 | rw | 64 | -
106 | FilterStatus | 32 | ro | - | -
107 | SSI_Setup1 | 32 | rw | - | -
108 | PulseDirMask | 32 | rw | 0 | 0..65535
109 | PulseDirMode | 32 | rw | - | 0..2
110 | SettlingTime | 32 | rw | - | 0..32676
111 | SSI_Setup2 | 32 | rw | - | -
112 | SAMPLE1 | 32 | rw | - | -
113 | SAMPLE2 | 32 | rw | - | -
114 | SAMPLE3 | 32 | rw | - | -
115 | SAMPLE4 | 32 | rw | - | -
116 | REC_CNT | 32 | rw | 0 | -
117 | S_TIME | 32 | rw | 1 | -
118 | S_CONTROL | 32 | rw | 0 | -
119 | BUF_SIZE | 32 | ro | - | -
120 | INDEX_OFFSET | 32 | ro | - | 0..1599
122 | Zero_Search_BITS | 32 | rw | 0 | -
123 | ERR_ACTION | 32 | rw | - | -
124 | SETUP_BITS | 32 | rw | 0 | -
125 | IOSETUP | 32 | rw | 0 | -
126 | TURNTAB_MODE | 32 | rw | 0 | -
127 | TURNTAB_SIZE | 32 | rw | 0 | -
129 | NL_MASK | 32 | rw | 0 | -
130 | PL_MASK | 32 | rw | 0 | -
131 | SON_MASK | 32 | rw | 0 | -
132 | HOME_MASK | 32 | rw | 0 | -
135 | INPUT_FILTER_MASK | 32 | rw | 0 | -
136 | INPUT_FILTER_CNT | 32 | rw | 5 | -
137 | INPOS_MASK | 32 | rw | 0 | -
138 | ERROR_MASK | 32 | rw | 0 | -
139 | ResurOkVoltage | 32 | rw | - | -
140 | ResurOkCount | 32 | rw | - | -
141 | ResurSaveVoltage | 32 | rw | - | -
142 | ResurInput | 32 | rw | - | -
143 | CviVoltage | 32 | ro | - | -
144 | P_NEW | 32 | rw | 0 | -2147483648..2147483647
146 | BAUD_RATE | 32 | rw | 1 | 0..5
147 | TX_DELAY | 32 | rw | 15 | 1..255
148 | GROUP_ID | 32 | rw | - | 0..255
149 | GROUP_SEQ | 32 | ro | - | 0..255
150 | MY_ADDR | 32 | rw | - | 0..254
151 | MOTORTYPE | 32 | ro | - | 80..83
152 | SERIALNUMBER | 32 | ro | - | -
154 | CHECKSUM | 32 | ro | - | 0..65535
156 | HARDWARE_REV | 32 | ro | - | 0..65535
157 | MAX_VOLTAGE, MAX_CURRENT | 32 | ro | - | -
158 | AVAIBLE_IO | 32 | ro | - | -
159 | BOOTLOADER_VER | 32 | ro | - | 0..65535
160 | NOTSAVED | 32 | rw | 0 | 0..65535
165 | OPTIONS_BITS | 32 | ro | - | 0..65535
166 | FBUS_NODEID | 32 | rw | 5 | 0..255
167 | FBUS_BAUD | 32 | rw | 2 | 0..8
168 | ModuleType | 32 | ro | 0 | 0..0
170 | EXT_ENCODER | 32 | rw | - | -2147483648..2147483647
172 | EXT_ENCODER_VEL | 32 | ro | - | -32768..32767
180 | ControlWord | 32 | rw | 0 | 0..65535
181 | StatusWord | 32 | ro | 0 | 0..65535
182 | ModeOfOperation | 32 | rw | 0 | 0..255
183 | ModeOfOperationDisplay | 32 | ro | 0 | 0..255
184 | TargetPosition | 32 | rw | 0 | -2147483648..2147483647
186 | ActualPosition | 32 | ro | 0 | -2147483648..2147483647
188 | TargetVelocity | 32 | rw | 0 | -2147483648..2147483647
190 | ActualVelocity | 32 | ro | 0 | -2147483648..2147483647
192 | DigitalOutputs | 32 | rw | 0 | 0..65535
194 | DigitalInput | 32 | ro | 0 | 0..65535
202 | TICKS | 32 | ro | - | -
";
