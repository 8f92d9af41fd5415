"""Characters of a radio network from whatever file holds them, and what decoders make of them.

What belongs here: telling formats apart (`detect`), reading them as runs of characters (`hextext`, `recorded`,
`source`), finding out how many robots a network has (`layout`), and decoding runs to rows (`rows`) for people and
machines (`render`). What does not: the formats' own grammar where `miro_protocol` has it, and the commands (`cli`).

Everything is read once, in pieces: what is kept does not grow with the file.
"""

import msgspec

from miro_protocol.stream import DOWN


class Run(msgspec.Struct, frozen=True):
    """Characters that followed each other without a pause: start bit of the first, direction, network.

    `bad_stop`: the last one has a bad stop bit. In formats without time (raw, hex) ticks count on as if the whole
    input were one run.
    """

    tick: int
    data: bytes
    direction: str = DOWN
    network: int = 0
    bad_stop: bool = False
