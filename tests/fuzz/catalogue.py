"""Which targets there are, and which reader is covered where. What does not belong here: the targets."""

from __future__ import annotations

from tests.fuzz.target import Target
from tests.fuzz.targets import (
    bridges,
    captures,
    firmware,
    machines,
    pictures,
    recordings,
    scenarios,
    states,
    wire,
)

TARGETS: dict[str, Target] = {
    name: target
    for room in (wire, captures, firmware, machines, scenarios, recordings, pictures, states, bridges)
    for name, target in room.TARGETS.items()
}
