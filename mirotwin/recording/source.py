"""What a recording says that a run was made from."""

from __future__ import annotations

import hashlib

from miro_exact.bad_input import BadInput
from miro_sim.scenario.file import ScenarioText
from miro_sim.world.world import World
from mirotwin.recording.recorder import RunSource


def source_of(text: ScenarioText, world: World, record: str = "default", resumed: bytes = b"") -> RunSource:
    """Of a run of `world`, which is made of `text`. Raises BadInput for an image whose file is another now."""
    image = world.image
    firmware = image.path.read_bytes()
    if hashlib.sha256(firmware).hexdigest() != image.sha256:
        raise BadInput(image.path, "", "changed while it was read", "start again once it is built")
    return RunSource(
        scenario_name=text.scenario.name,
        scenario_text=text.text,
        seed=world.seed,
        firmware=firmware,
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        record=record,
        state=world.state.tables(),
        resumed=resumed,
    )
