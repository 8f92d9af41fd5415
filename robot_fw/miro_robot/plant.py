"""The interface between the robot's board and the physical world.

Time is in ticks of the 24 MHz crystal.
"""

from __future__ import annotations

from miro_exact.clock import NEVER_TICK
from miro_exact.state import TICK
from miro_robot.lm629.buffers import signed_31
from miro_robot.lm629.chip import SAMPLE_TICKS, Lm629


class Plant:
    """Two motors with encoders, driven by two halves of an L298 and read by two LM629.

    The board calls `advance` at every tick at which one of its own outputs may change (PWM edges, samples)
    and at `next_tick`, then `set_bridge` for what has changed: the grid of steps is fixed by the robot
    alone, so the bits do not depend on who looks when. A plant calls `left.set_encoder(tick, a, b)` and
    `right.set_encoder(tick, a, b)` for every encoder edge, of each side in tick order.
    """

    STATE: dict[str, object] = {"next_tick": TICK}
    NOT_STATE: tuple[str, ...] = ("left", "right")

    def __init__(self) -> None:
        self.left: Lm629 | None = None
        self.right: Lm629 | None = None
        self.next_tick = NEVER_TICK

    def attach(self, left: Lm629, right: Lm629) -> None:
        """Wires the encoder outputs to the two LM629 and shows these the levels of now."""
        self.left = left
        self.right = right

    def advance(self, tick: int) -> None:
        """Integrates to `tick` and reports every encoder edge up to and including it."""

    def run_pulses(self, tick: int) -> int:
        """May do what the board would do up to and including `tick`: advance, edges of PWM at both chips, bridge.

        Where a chip has more to do it ends, with an advance to that tick or before. Returns 1 if it has done something.
        """
        left, right = self.left, self.right
        if left is not None and right is not None and tick - left.next_tick > SAMPLE_TICKS:
            left.rest(tick)
            right.rest(tick)
        return 0

    def set_bridge(self, tick: int, side: int, enable: int, forward: int) -> None:
        """L298 inputs of one side (0 left, 1 right) from `tick` on: enable pin; 1 forward, 0 backward."""

    def __repr__(self) -> str:
        return "Plant(motors unplugged)"


class IdealWheels(Plant):
    """Wheels without mass: at each sample they are where the sample before wanted them.

    For firmware on its own (fuzzing, tests): with motors unplugged no wheel follows, and firmware that watches the
    position error never drives. `stopped`, a fault: bit 0 the left one has no current, bit 2 it is blocked; 1 and 3 the
    right one.
    """

    STATE = {"stopped": ("i", 0, 15)}
    NOT_HASHED = ("stopped",)

    def __init__(self) -> None:
        Plant.__init__(self)
        self.stopped = 0

    def advance(self, tick: int) -> None:
        for side, chip in enumerate((self.left, self.right)):
            if chip is not None and chip.sample_tick == tick and not self.stopped & 5 << side:
                chip.encoder.counts = signed_31((chip.trajectory.position >> 16) - chip.real_position)

    def __repr__(self) -> str:
        return "IdealWheels()"
