"""`mirotwin fw vectors`: single-step vectors of the processor, for other emulators to be tested with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from miro_exact.rng import Stream
from miro_robot.mcs51.vector_draw import draw_vectors
from miro_robot.mcs51.vectors import encode
from mirotwin.firmware.held_signals import held_signals
from mirotwin.shell.command import Option, Options, command_of
from mirotwin.shell.options import FORCE, OUT, SEED, Engine, Whole, choose_engine
from mirotwin.shell.outputs import OutputFolder
from mirotwin.shell.progress import ProgressBar

OPCODES = 256
NAMES = tuple(f"{opcode:02x}.json" for opcode in range(OPCODES))
"""The files written, all that `--force` replaces."""


class VectorsOptions(Options, frozen=True, kw_only=True):
    COMMAND = "fw vectors"
    out: Annotated[Path, OUT.saying("Folder for the 256 files.")]
    per_opcode: Annotated[int, Option(type=Whole(1, 1_000_000), help="Vectors per opcode.")] = 8
    seed: Annotated[int, SEED.saying("Of the states.")] = 1
    force: Annotated[bool, FORCE.saying("Replace files of these names in the folder.")] = False
    engine: Engine = None


@command_of(VectorsOptions)
def vectors(options: VectorsOptions) -> None:
    """Writes one JSON file per opcode, in the form of the SingleStepTests: state before, state after, and the
    accesses of each machine cycle. The same seed writes the same bytes; more vectors per opcode only add to
    them. tests/vectors/README.md describes the format.
    """
    folder = OutputFolder(options.out, options.force, NAMES)
    choose_engine(options.engine)

    with held_signals() as hold, folder, ProgressBar("drawing", OPCODES) as bar:
        for opcode, name in enumerate(NAMES):
            draw = drawing(Stream(options.seed, f"vectors/mcs51/{opcode:02x}"))
            with hold.released():
                drawn = encode(draw_vectors(opcode, options.per_opcode, draw))
            folder.part(name).write_bytes(drawn)
            bar.to(opcode + 1)


def drawing(stream: Stream) -> Callable[[int], int]:
    """Successive draws from a stream: `draw(n)` is an integer from 0 to n - 1."""
    drawn = 0

    def draw(n: int) -> int:
        nonlocal drawn
        drawn += 1
        return stream.u32(drawn - 1) * n >> 32

    return draw
