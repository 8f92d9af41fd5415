"""Which targets there are, and which reader is covered where. What does not belong here: the targets."""

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

TARGETS = {
    name: target
    for room in (wire, captures, firmware, machines, scenarios, recordings, pictures, states, bridges)
    for name, target in room.TARGETS.items()
}
