"""A 74HC595: eight outputs behind a shift register, from three port pins; several in a row from the same three.

ser   ──>[ shift register ]──> q7s ──> ser of the next one
srclk ──>    │ .. │ srclr low: all 0
rclk  ──>[ storage ]
oe    ──>  q0 .. q7           oe high: let go

srclk     __|~|_|~|_|~|__            takes `ser` when it rises; what was taken first is at q7 after eight
rclk      _______________|~|__       what was shifted is at the outputs when it rises

Of a `ser` that moves on the tick on which srclk rises it takes what was before, as its set-up time asks for, and counts
it in `late_bits`. Where both clocks are one wire, the storage has what the shift register had before that edge. After
power-on both registers are 0, where the real ones hold anything: chosen. Delays (some 20 ns) are below a tick.
"""

from __future__ import annotations

from miro_exact.state import TICK
from miro_robot.parts.keys import IN, RELEASED, STRONG, PartKeys, Pin, Place
from miro_robot.parts.part import Part

_SER, _SRCLK, _RCLK, _OE, _SRCLR = 0b1, 0b10, 0b100, 0b1000, 0b10000
_Q0, _Q7S = 5, 13


class Hc595(PartKeys, frozen=True, kw_only=True, tag="hc595"):
    """A shift register with stored outputs. Pins that are not connected: oe low, srclr high.

    Nexperia calls them ds, shcp, stcp, oe, mr; TI qa to qh, and q7s qh'.
    """

    PINS = (
        Pin("ser"),
        Pin("srclk"),
        Pin("rclk"),
        Pin("oe", IN, optional=True, level=0),
        Pin("srclr", IN, optional=True, level=1),
        *(Pin(f"q{bit}", STRONG, optional=True) for bit in range(8)),
        Pin("q7s", STRONG, optional=True),
    )
    READS = {
        "outputs": "the stored byte, q7 highest",
        "shifted": "what is in the shift register",
        "enabled": "whether oe lets it drive its outputs",
        "stores": "how often rclk has risen",
        "late_bits": "bits of which ser changed on the tick on which srclk rose",
    }
    SHEET = (
        "TI SN74HC595 SCLS041, 8.4 function table, 6.6 timing requirements; Nexperia 74HC595, 6 pinning, 7 functional "
        "description"
    )

    def make(self, place: Place) -> Part:
        return Hc595Part(self, place)


class Hc595Part(Part):
    """`outputs`, `shifted`: the two registers."""

    STATE = {"outputs": ("i", 0, 0xFF), "shifted": ("i", 0, 0xFF), "stores": TICK, "late_bits": TICK}

    def __init__(self, keys: Hc595, place: Place) -> None:
        Part.__init__(self, keys, place)
        self.outputs = self.shifted = 0
        self.stores = self.late_bits = 0

    def start(self, tick: int) -> None:
        self.outputs = self.shifted = 0
        self._show()
        self.drive(_Q7S, 0)

    def changed(self, pins: int, tick: int) -> None:
        rises = pins & self.levels
        if rises & _RCLK:
            self.stores += 1
            self.outputs = self.shifted
        if not self.levels & _SRCLR:
            self.shifted = 0
        elif rises & _SRCLK:
            self.late_bits += pins & _SER
            self.shifted = (self.shifted << 1 | (self.levels ^ pins) & _SER) & 0xFF
        if rises & _RCLK or pins & _OE:
            self._show()
        self.drive(_Q7S, self.shifted >> 7)

    def _show(self) -> None:
        is_off = self.levels & _OE
        for bit in range(8):
            self.drive(_Q0 + bit, RELEASED if is_off else self.outputs >> bit & 1)

    def read(self, name: str, tick: int) -> float | int | bool | str:
        return not self.levels & _OE if name == "enabled" else Part.read(self, name, tick)
