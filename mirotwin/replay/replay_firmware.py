"""Firmwares of recordings: their debug files, and where two of them go apart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from miro_exact.bad_input import BadInput
from miro_robot.firmware import source_folder
from miro_robot.image import Image
from miro_sim.world.world import World
from mirotwin.firmware.coverage_files import with_debug_files
from mirotwin.recording.difference import Difference
from mirotwin.replay.annotated_image import AnnotatedImage
from mirotwin.replay.firmwares import FirmwareDifference, first_instruction
from mirotwin.replay.lockstep import LOOK_TICKS
from mirotwin.rerun.job import Job
from mirotwin.shell.command import Option
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.options import IMAGE, NAME, plain_parameters

LinesFrom = Annotated[
    tuple[str, ...],
    Option(
        metavar="IMAGE.ihx",
        type=NAME,
        help="A recorded image as a file, beside which its debug files lie: for its C lines; may be repeated. The"
        " robot's own image needs none.",
        heading=IMAGE,
    ),
]


def load_images(paths: Sequence[str], *recorded: Image | None) -> list[Image]:
    """The images of --lines-from. Raises BadInput for one that was not recorded."""
    codes = [image.code for image in recorded if image is not None]
    images = [load_firmware(path) for path in paths]
    for path, image in zip(paths, images, strict=True):
        if image.code not in codes:
            raise BadInput(
                path, "--lines-from", "is not a recorded image", "give one that is, or leave it out"
            )
    return images


def annotated_of(image: Image, images: Sequence[Image], sources: Sequence[str]) -> AnnotatedImage:
    """The image with its debug files: those beside one of `images`, or the robot's own; C files also in `sources`."""
    known = next((one for one in images if one.code == image.code), with_debug_files(image))
    folder = source_folder()
    own = [] if folder is None or load_firmware(named=False).sha256 != image.sha256 else [folder]
    return AnnotatedImage(known, [*own, *map(Path, sources)])


def firmwares_apart(
    file: str, job: Job, annotated: tuple[AnnotatedImage, AnnotatedImage], found: Sequence[Difference]
) -> FirmwareDifference | None:
    """Where the recorded image and the one that ran go apart, up to the first difference."""

    def make(which: Image) -> World:
        return job.world(which)

    with plain_parameters(file, "replayed"):
        return first_instruction(make, *annotated, found[0].tick + LOOK_TICKS)
