"""A program that puts a machine into a random state: all of internal RAM and every register.

Both machines run it, because setting memory by the simulator's own commands takes thirty milliseconds a state. A
state is an offset into the table of random bytes, passed in DPTR. Timers stand, the receiver is off and EA is 0 in
such a state: what time does is the walks' task.
"""

from tests.robot.ucsim import exclusions as sfr

AT = 0x0200
TABLE, TABLE_SIZE = 0x0400, 0x4000
OFFSETS = range(TABLE, TABLE + TABLE_SIZE - 0x200)
"""What DPTR may be; 256 bytes from there are for internal RAM, the next ones for registers."""

_QUIET = bytes.fromhex("C2AF C28C C28E C2CA 75D000")  # CLR EA, TR0, TR1, TR2; MOV PSW,#0
_FILL = bytes.fromhex("78FF E8 93 F6 D8FB 0583")  # R0 counts down from FFh: MOV @R0,table[R0]; then INC DPH
_REST = bytes.fromhex("857C82 857D83 857ED0 E57F")  # MOV DPL,7Ch; MOV DPH,7Dh; MOV PSW,7Eh; MOV A,7Fh
_SET_BY_REST = (sfr.DPL, sfr.DPH, sfr.PSW, sfr.ACC)
_REGISTERS = (*(address for address in sfr.COMPARED if address not in _SET_BY_REST), 0x00)
"""The last one is R0 of bank 0, which the filling used up."""
_AND_OR = {  # as after `exclusions.py`, with nothing running
    sfr.P1: (0xFF, 0x03),
    sfr.P3: (0xFF, 0x3D),
    sfr.PCON: (0x8C, 0x00),
    sfr.TCON: (0xAF, 0x05),
    sfr.TMOD: (0xFD, 0x00),
    sfr.SCON: (0xEF, 0x00),
    sfr.IE: (0x3F, 0x00),
    sfr.IP: (0x3F, 0x00),
    sfr.T2CON: (0xF3, 0x00),
}
RANDOM_BITS = {register: kept & ~high for register, (kept, high) in _AND_OR.items()}
"""Which bits a state draws; in registers not listed all of them."""


def _moves():
    """For each register MOV A,#place; MOVC A,@A+DPTR; ANL A,#kept; ORL A,#high; MOV register,A."""
    code = bytearray()
    for place, register in enumerate(_REGISTERS):
        kept, high = _AND_OR.get(register, (0xFF, 0x00))
        code += bytes((0x74, place, 0x93, 0x54, kept, 0x44, high, 0xF5, register))
    return bytes(code)


PROGRAM = _QUIET + _FILL + _moves() + _REST
END = AT + len(PROGRAM)
"""Where it ends: before the instruction at this address."""
