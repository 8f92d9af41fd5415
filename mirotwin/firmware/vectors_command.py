"""`mirotwin fw vectors`: single-step vectors of the processor, for other emulators to be tested with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from miro_exact.rng import Stream
from miro_exact.seed import MAX_SEED
from miro_robot.mcs51.vector_draw import draw_vectors
from miro_robot.mcs51.vectors import encode
from mirotwin.firmware.held_signals import held_signals
from mirotwin.shell.options import Place, Whole, choose_engine, engine_option
from mirotwin.shell.outputs import OutputFolder
from mirotwin.shell.progress import ProgressBar

OPCODES = 256
NAMES = tuple(f"{opcode:02x}.json" for opcode in range(OPCODES))
"""The files written, all that `--force` replaces."""


@click.command(short_help="Writes single-step test vectors of the processor.")
@click.option("--out", type=Place(path_type=Path), required=True, help="Folder for the 256 files.")
@click.option(
    "--per-opcode",
    type=Whole(1, 1_000_000),
    default=8,
    show_default=True,
    help="Vectors per opcode.",
)
@click.option("--seed", type=Whole(0, MAX_SEED), default=1, show_default=True, help="Of the states.")
@click.option("--force", is_flag=True, help="Replace files of these names in the folder.")
@engine_option
def vectors(out: Path, per_opcode: int, seed: int, force: bool, engine: str | None) -> None:
    """Writes one JSON file per opcode, in the form of the SingleStepTests: state before, state after, and the
    accesses of each machine cycle. The same seed writes the same bytes; more vectors per opcode only add to
    them. tests/vectors/README.md describes the format.
    """
    folder = OutputFolder(out, force, NAMES)
    choose_engine(engine)

    with held_signals() as hold, folder, ProgressBar("drawing", OPCODES) as bar:
        for opcode, name in enumerate(NAMES):
            draw = drawing(Stream(seed, f"vectors/mcs51/{opcode:02x}"))
            with hold.released():
                drawn = encode(draw_vectors(opcode, per_opcode, draw))
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
