"""Whether the radio of a network works: as it does, switched off, or drowned in noise.

up      as the parameters say
down    the transmitters are off: receivers hear no carrier, which is mark if squelched, else noise
noise   a stronger transmitter sends noise: receivers hear a fair random bit in each bit time, squelched or not
"""

from typing import Literal

LinkState = Literal["up", "down", "noise"]
UP, DOWN, NOISE = 0, 1, 2
LINK_STATES: tuple[LinkState, ...] = ("up", "down", "noise")
"""Names, in the order of the numbers."""
