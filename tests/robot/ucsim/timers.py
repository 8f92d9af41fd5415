"""Programs that read running timers, on ucsim and on our CPU.

A random walk seldom meets an overflow; here a timer is started shortly before one by SETB, instructions of known
length pass, and its registers are copied to internal RAM all the time.
"""

from typing import NamedTuple

from miro_robot.mcs51.cpu import Cpu
from tests.robot.ucsim import s51

SIZE = 0x100  # bytes of code for each program
RESULTS, READS = 0x30, 60  # internal RAM written
_FILLERS = (b"\x00", b"\xa3", b"\xa4", b"\x00\xa3", b"\x84")  # 1, 2, 4, 3, 4 cycles
_TMOD, _TCON, _T2CON = 0x89, 0x88, 0xC8
_PAIRS = ((0x8A, 0x8C), (0x8B, 0x8D), (0xCC, 0xCD))  # TL, TH
_RUN_BIT = (0x8C, 0x8E, 0xCA)  # TR0, TR1, TR2
_CONTROL = (_TCON, _TCON, _T2CON)


class Program(NamedTuple):
    timer: int
    code: bytes
    end: int  # address of its last instruction, relative to its start


def draw(random):
    """One timer in one mode, started near its overflow and read many times."""
    timer = random.randrange(3)
    low, high = _PAIRS[timer]
    code = bytearray.fromhex("c2af 758800 75c800")  # no interrupts, timers off
    code += bytes((0x75, 0xF0, random.randrange(1, 256)))  # B, for DIV
    if timer < 2:
        mode = random.randrange(3)
        code += bytes((0x75, _TMOD, mode << (4 * timer)))
        code += bytes((0x75, high, random.choice((0xFF, random.randrange(256)))))
        code += bytes((0x75, low, random.choice((random.randrange(256), 0x1C if mode == 0 else 0xF0))))
        if mode == 0:
            code += bytes((0x53, low, 0x1F))  # the upper bits of TL are undefined
    else:
        reload = 0xFFFF - random.randrange(40)
        code += bytes((0x75, 0xCA, reload & 0xFF, 0x75, 0xCB, reload >> 8))
        code += bytes((0x75, 0xCC, random.randrange(0xE0, 0x100), 0x75, 0xCD, 0xFF))
    code += bytes((0xD2, _RUN_BIT[timer]))
    target = RESULTS
    while len(code) < SIZE - 16 and target < RESULTS + READS:
        code += random.choice(_FILLERS) * random.randrange(4)
        for register in random.sample((low, high, _CONTROL[timer]), random.randrange(1, 4)):
            code += bytes((0x85, register, target))
            target += 1
    code += bytes((0xC2, _RUN_BIT[timer]))
    return Program(timer, bytes(code), len(code))


def ours(programs):
    """Internal RAM after each program, run one after the other."""
    cpu = Cpu()
    cpu.load(_image(programs))
    found = []
    for number, program in enumerate(programs):
        cpu.pc = number * SIZE
        cpu.run_until_any((number * SIZE + program.end,), 1 << 40)
        found.append(bytes([cpu.peek_iram(address) for address in range(0x20, 0x80)]))
    return found


def ucsims(programs):
    """The same from the simulator."""
    commands = ["fill iram 0 255 0"]
    for number, program in enumerate(programs):
        commands.append(f"run {number * SIZE:#x} {number * SIZE + program.end:#x}")
        commands.append("dump /b iram 32 127")
    reader = s51.Reader(s51.run(_image(programs), commands))
    return [reader.raw("dump /b iram 32 127", 96) for _ in programs]


def _image(programs):
    return b"".join(program.code.ljust(SIZE, b"\x00") for program in programs)
