"""The paints of the scene: how much of red, green and blue light each surface throws back.

Chosen to look like photographs of MiroSot pitches: nothing was measured on a real one.

Shares of the light, linear, in 1/1000. A camera with gain 1 shows 1000 as white.
"""

from __future__ import annotations

PAINTS: dict[str, tuple[int, int, int]] = {
    "floor": (16, 75, 32),  # dark green; `black floor` replaces it
    "line": (700, 700, 680),
    "wall top": (15, 15, 15),
    "wall face": (600, 600, 590),
    "outside": (60, 55, 50),
    "side": (420, 420, 400),  # light, as the rules ask: the opponent's infrared sensors see it
    "top": (20, 20, 20),
    "yellow": (850, 780, 10),
    "blue": (10, 70, 700),
    "magenta": (800, 15, 300),
    "cyan": (5, 500, 620),
    "green": (5, 560, 60),
    "violet": (280, 20, 700),
    "lime": (220, 800, 5),
    "ball rim": (340, 105, 5),  # an orange golf ball, lit from above: four rings of equal area
    "ball outer": (560, 175, 8),
    "ball inner": (720, 225, 10),
    "ball middle": (850, 265, 12),
}
BLACK_FLOOR = (15, 15, 16)

NUMBERS = {name: number for number, name in enumerate(PAINTS)}
"""A paint's number: pixels are made of numbers."""

BITS = 21
"""Bits of one colour in a packed paint: red in the lowest bits, then green, then blue.

Up to 512 paints can be added.
"""
FULL = 4095


def packed(black_floor: bool) -> list[int]:
    """All paints by number, each as one integer whose sums are sums of colours; 0 to `FULL` a colour."""
    words = []
    for name, paint in PAINTS.items():
        red, green, blue = BLACK_FLOOR if black_floor and name == "floor" else paint
        red, green, blue = (FULL * part // 1000 for part in (red, green, blue))
        words.append(red | green << BITS | blue << 2 * BITS)
    return words
