"""What a random walk must not do, because ucsim is known to do it wrong.

The names in the comments are those of `disagreements.csv`.
"""

from functools import cache

from miro_robot.mcs51.opcodes import CYCLES, LENGTH, ROW, SFRS, TABLE

(
    P0, SP, DPL, DPH, PCON, TCON, TMOD, TL0, TL1, TH0, TH1, P1, SCON, SBUF, P2, IE, P3, IP,
    T2CON, T2MOD, RCAP2L, RCAP2H, TL2, TH2, PSW, ACC, B,
) = SFRS.values()  # fmt: skip
COMPARED = tuple(address for address in SFRS.values() if address not in (SBUF, T2MOD))
"""Registers of an AT89C52 that both machines have and that hold what is written."""
ALIKE_AFTER_MOVX = tuple(address for address in COMPARED if address != P0)  # p0-after-movx

_FORBIDDEN = {
    T2CON: 0x08,  # t2ex-memory
    PCON: 0x73,  # absent-bits; and idle or powered down there is no next step
    IE: 0x40,  # absent-bits
    IP: 0xC0,  # absent-bits
}
_TIMER = (TCON, TMOD, TL0, TL1, TH0, TH1, T2CON, RCAP2L, RCAP2H, TL2, TH2)
_TIMERS = tuple((register,) for register in _TIMER)
_OPERANDS = {row[0]: row[4] for row in TABLE}
OPERANDS = tuple(_OPERANDS[ROW[opcode]] for opcode in range(256))
_PUSH, _POP = 0xC0, 0xD0
MOVX = (0xE0, 0xE2, 0xE3, 0xF0, 0xF2, 0xF3)
_LATE = (0x20, 0x30, 0xB5)  # JB, JNB, CJNE A,dir
_CALLS = (0x12, *range(0x11, 0x100, 0x20))
_RETURNS = (0x22, 0x32)


@cache
def has_direct(opcode):
    """Whether the byte after the opcode is a direct address."""
    return not {"dir", "dst"}.isdisjoint(OPERANDS[opcode].split(","))


@cache
def has_bit(opcode):
    """Whether the byte after the opcode is a bit address."""
    return not {"bit", "/bit"}.isdisjoint(OPERANDS[opcode].split(","))


def peek(cpu, address):
    """A direct address: internal RAM or a register, ports at their latch."""
    return cpu.peek_iram(address) if address < 0x80 else cpu.sfr(address)


def written(cpu, opcode, first, second):
    """The direct address an instruction is about to write: (address, value, ACC afterwards), or None."""
    a = cpu.a
    row = ROW[opcode]
    if has_bit(opcode) and row in (0x10, 0x92, 0xB2, 0xC2, 0xD2):
        address = first & 0xF8 if first >= 0x80 else 0x20 + (first >> 3)
        mask = 1 << (first & 7)
        old = peek(cpu, address)
        level = {0x10: 0, 0x92: cpu.cy, 0xB2: old & mask == 0, 0xC2: 0, 0xD2: 1}[row]
        value = old | mask if level else old & ~mask
        return address, value, value if address == ACC else a
    if not has_direct(opcode):
        return None
    old = peek(cpu, first)
    if row == 0x85:
        return second, old, old if second == ACC else a
    if row == 0xC5:
        return first, a, old
    values = {
        0x05: old + 1,
        0x15: old - 1,
        0x42: old | a,
        0x43: old | second,
        0x52: old & a,
        0x53: old & second,
        0x62: old ^ a,
        0x63: old ^ second,
        0x75: second,
        0x86: cpu.peek_iram(cpu.peek_iram(cpu.bank + (opcode & 1))),
        0x88: cpu.peek_iram(cpu.bank + (opcode & 7)),
        0xD0: cpu.peek_iram(cpu.sp),
        0xD5: old - 1,
        0xF5: a,
    }
    if row not in values:
        return None
    value = values[row] & 0xFF
    return first, value, value if first == ACC else a


def allowed(cpu, opcode, first, second):
    """Whether both machines must do the same with this instruction in this state."""
    for address in direct_addresses(opcode, first, second):
        if address >= 0x80 and address not in COMPARED:  # absent-bits; count-down (T2MOD); serial-port (SBUF)
            return False
    if 0x10000 in _targets(cpu, opcode, first if LENGTH[opcode] == 2 else second):  # pc-wrap
        return False
    if opcode in MOVX and not cpu.sfr(P3) & (0x80 if opcode < 0xF0 else 0x40):  # movx-strobe
        return False
    if opcode in _LATE and _running(cpu) and direct_addresses(opcode, first, second) in _TIMERS:  # late-read
        return False
    # stack-wrap
    if (opcode == _PUSH and cpu.sp == 0xFF) or (opcode in _CALLS and cpu.sp >= 0xFE):
        return False
    if (opcode == _POP and cpu.sp == 0x00) or (opcode in _RETURNS and cpu.sp <= 0x01):
        return False
    # movc-wrap
    if (opcode == 0x83 and cpu.pc + 1 + cpu.a > 0xFFFF) or (opcode == 0x93 and cpu.dptr + cpu.a > 0xFFFF):
        return False
    target = written(cpu, opcode, first, second)
    return target is None or _may_write(cpu, opcode, *target)


def _targets(cpu, opcode, last):
    """Where a relative branch or JMP @A+DPTR may go, before the sum is cut to 16 bits."""
    if opcode == 0x73:
        return (cpu.dptr + cpu.a,)
    if OPERANDS[opcode].endswith("rel"):
        return (((cpu.pc + LENGTH[opcode]) & 0xFFFF) + (last ^ 0x80) - 0x80,)
    return ()


def direct_addresses(opcode, first, second):
    """The direct addresses that an instruction names, by byte or by bit."""
    if opcode == 0x85:
        return first, second
    if has_direct(opcode):
        return (first,)
    if has_bit(opcode) and first >= 0x80:
        return (first & 0xF8,)
    return ()


def _may_write(cpu, opcode, address, value, a):
    """Whether a register may be written, given ACC after the instruction."""
    if address == PSW:
        by_bit = has_bit(opcode) and (value ^ cpu.psw()) & 0x18  # bank-by-bit
        return not by_bit and value & 1 == a.bit_count() & 1  # parity-write
    if address == P3:
        listening = cpu.sfr(SCON) & 0x10  # serial-port
        return value & 0x0C == 0x0C and bool(value & 1 or not listening)  # level-interrupt
    if value & _FORBIDDEN.get(address, 0):
        return False
    if address == TCON and (value >> 1) & ~value & 0x05:  # level-interrupt: IEx without ITx
        return False
    if address == TMOD and value & 0x03 == 0x03:  # timer-1-beside-mode-3
        return False
    if address == SCON and value & 0x10 and not (value & 0xC0 and cpu.sfr(P3) & 1):  # serial-port
        return False
    return _timers_agree(cpu, opcode, address, value) and not _interrupts(cpu, address, value)


def _running(cpu):
    return bool(cpu.sfr(TCON) & 0x50 or cpu.sfr(T2CON) & 0x04)


def _timers_agree(cpu, opcode, address, value):
    """Whether timers that run after a write, or ran before, do the same on both machines."""
    tcon, tmod, t2con, tl0, tl1 = (
        value if address == register else cpu.sfr(register) for register in (TCON, TMOD, T2CON, TL0, TL1)
    )
    if (_running(cpu) or tcon & 0x50 or t2con & 0x04) and address in _TIMER and CYCLES[opcode] == 2:
        return False  # early-write
    for started, mode, low in ((tcon & 0x10, tmod, tl0), (tcon & 0x40, tmod >> 4, tl1)):
        if started and (mode & 0x04 or (mode & 0x03 == 0 and low > 0x1F)):  # counted-edges, mode-0-low
            return False
    return t2con & 0x06 != 0x06  # counted-edges


def _interrupts(cpu, address, value):
    """interrupt-latency, -priority, -delay: whether an enabled interrupt would be pending after a write."""
    ie, tcon, scon, t2con = (
        value if address == register else cpu.sfr(register) for register in (IE, TCON, SCON, T2CON)
    )
    pending = (tcon >> 1) & 0x01 | (tcon >> 4) & 0x02 | (tcon >> 1) & 0x04 | (tcon >> 4) & 0x08
    if scon & 0x03:
        pending |= 0x10
    if t2con & 0xC0:
        pending |= 0x20
    if tcon & 0x50 or t2con & 0x04:
        pending |= 0x2A  # sooner or later
    return bool(ie & 0x80 and ie & pending)  # interrupt-latency, interrupt-priority, interrupt-delay
