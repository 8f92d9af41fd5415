"""Camera frames out of a recording, small enough for a page.

A frame is recorded as PNG, 0.2 MB of mostly noise; here it becomes a JPEG of a tenth of that.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_sim.periods import RobotId
from mirotwin.recording.channels import ImageMessage, SampleMessage
from mirotwin.recording.container import Cut
from mirotwin.recording.messages import Messages

QUALITY = 72
"""Quality of a JPEG; below 60 the picture's noise is hardly left."""


class CameraFrame(msgspec.Struct, frozen=True):
    """A picture that was exposed at `tick`; `jpeg` in base64."""

    network: int
    tick: int
    jpeg: str


class Extras(msgspec.Struct, frozen=True):
    """The content of a recording besides control periods. `broken_off`: its run was interrupted."""

    frames: Sequence[CameraFrame] = ()
    samples: Sequence[tuple[RobotId, SampleMessage]] = ()
    broken_off: bool = False


def extras_of(path: str | Path, from_tick: int, to_tick: int, frames: bool) -> Extras:
    """Frames, if they are wanted, and samples from `from_tick` to before `to_tick`. Raises RecordingError."""
    kinds: list[type[msgspec.Struct]] = [SampleMessage, *([ImageMessage] if frames else [])]
    pictures: list[CameraFrame] = []
    samples: list[tuple[RobotId, SampleMessage]] = []
    with open(path, "rb") as stream:
        messages = Messages(stream.read, str(path), kinds)
        cut = False
        try:
            for place, message in messages:
                if not from_tick <= message.tick < to_tick:
                    continue
                if isinstance(message, ImageMessage):
                    pictures.append(_frame(str(path), place.network, message))
                else:
                    samples.append(((place.network, place.slot), message))
        except Cut:  # what came before is whole
            cut = True
    return Extras(pictures, samples, cut or bool(messages.broken_off))


def _frame(path: str, network: int, message: ImageMessage) -> CameraFrame:
    from PIL import Image as Picture  # loads the pictures' library
    from PIL import UnidentifiedImageError

    small = BytesIO()
    try:
        with Picture.open(BytesIO(message.data)) as picture:
            picture.convert("RGB").save(small, "JPEG", quality=QUALITY, optimize=True)
    except (UnidentifiedImageError, OSError, ValueError, Picture.DecompressionBombError):
        reason = f"the camera frame at tick {message.tick} is no picture"
        raise BadInput(path, "camera/image", reason, "leave the frames out with --no-frames") from None
    return CameraFrame(network, message.tick, base64.b64encode(small.getvalue()).decode())
