"""The command set, one line per opcode (data sheet, user command set).

What the commands do to the chip is in `chip.py`; this table also serves decoders of recorded traffic.
"""

from __future__ import annotations

import msgspec


class Lm629Command(msgspec.Struct, frozen=True):
    """One opcode. `words_in` / `words_out`: 16-bit data words the host writes / reads.

    LFIL and LTRJ take one control word, which announces further words: `words_in` counts the control word
    only. `effective`: "now", "UDF" or "STT" (buffered until then), "sample" (at the next sample boundary).
    """

    opcode: int
    name: str
    words_in: int
    words_out: int
    effective: str
    function: str


COMMANDS = (
    Lm629Command(0x00, "RESET", 0, 0, "now", "software reset"),
    Lm629Command(0x01, "STT", 0, 0, "sample", "start motion"),
    Lm629Command(0x02, "DFH", 0, 0, "now", "define home"),
    Lm629Command(0x03, "SIP", 0, 0, "now", "set index position: capture at the next index pulse"),
    Lm629Command(0x04, "UDF", 0, 0, "sample", "update filter"),
    Lm629Command(0x05, "PORT8", 0, 0, "now", "8-bit output (LM628)"),
    Lm629Command(0x06, "PORT12", 0, 0, "now", "12-bit output (LM628)"),
    Lm629Command(0x07, "RDDV", 0, 2, "now", "read desired velocity, signed 16.16"),
    Lm629Command(0x08, "RDDP", 0, 2, "now", "read desired position, signed"),
    Lm629Command(0x09, "RDIP", 0, 2, "now", "read index position, signed"),
    Lm629Command(0x0A, "RDRP", 0, 2, "now", "read real position, signed"),
    Lm629Command(0x0B, "RDRV", 0, 1, "now", "read real velocity, signed counts per sample"),
    Lm629Command(0x0C, "RDSIGS", 0, 1, "now", "read signals register"),
    Lm629Command(0x0D, "RDSUM", 0, 1, "now", "read integration-term value, signed"),
    Lm629Command(0x1A, "LPES", 1, 0, "now", "load position error for stopping"),
    Lm629Command(0x1B, "LPEI", 1, 0, "now", "load position error for interrupt"),
    Lm629Command(0x1C, "MSKI", 1, 0, "now", "mask interrupts"),
    Lm629Command(0x1D, "RSTI", 1, 0, "now", "reset interrupts"),
    Lm629Command(0x1E, "LFIL", 1, 0, "UDF", "load filter parameters"),
    Lm629Command(0x1F, "LTRJ", 1, 0, "STT", "load trajectory parameters"),
    Lm629Command(0x20, "SBPA", 2, 0, "now", "set breakpoint, absolute"),
    Lm629Command(0x21, "SBPR", 2, 0, "now", "set breakpoint, relative to the target"),
)

BY_OPCODE = {command.opcode: command for command in COMMANDS}
BY_NAME = {command.name: command for command in COMMANDS}
