"""Pictures in the order of time: from a folder of files, or from a recording.

Files are in the order of their names, one camera frame apart. Where names begin with `netN-frame-`, as `run --frames`
writes them for several networks, one network's are taken.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from miro_exact.bad_input import BadInput
from miro_exact.clock import CAMERA_FRAME_TICKS
from miro_exact.inputs import check_regular
from mirotwin.camera import picture
from mirotwin.camera.picture import SUFFIXES, Picture
from mirotwin.recording.channels import IMAGE, ImageMessage, topic_name
from mirotwin.recording.container import BrokenOff
from mirotwin.recording.messages import Messages

_OF_NETWORK = re.compile(r"net([0-9]{1,9})-frame-.*")


class Still(NamedTuple):
    """A picture, its name, and the tick of its exposure."""

    name: str
    tick: int
    picture: Picture


def stills(path: Path, network: int, tell: Callable[[str], None]) -> Iterator[Still]:
    """The pictures in a folder or a recording; `tell` gets a message if the recording is incomplete.

    Raises BadInput for a folder or file without pictures, and for a picture that cannot be used.
    """
    return _of_folder(path, network) if path.is_dir() else _of_recording(path, network, tell)


def _of_folder(path: Path, network: int) -> Iterator[Still]:
    names = sorted(name for name in os.listdir(path) if name.lower().endswith(SUFFIXES))
    if not names:
        raise BadInput(path, "", "holds no .png and no .ppm", "give a folder of pictures, or a run.mcap")
    networks = {name: _OF_NETWORK.fullmatch(name) for name in names}
    if all(networks.values()):
        names = [name for name, match in networks.items() if match is not None and int(match[1]) == network]
        if not names:
            raise BadInput(path, f"--network {network}", "no picture of it", "name one of the files'")
    for number, name in enumerate(names):
        yield Still(name, number * CAMERA_FRAME_TICKS, picture.read(path / name))


def _of_recording(path: Path, network: int, tell: Callable[[str], None]) -> Iterator[Still]:
    check_regular(path)
    any_frame = False
    with path.open("rb") as file:
        messages = Messages(file.read, f"{path}", (ImageMessage,))
        try:
            for place, message in messages:
                if place.network == network:
                    any_frame = True
                    data = picture.parse(
                        message.data, f"{path}", f"{topic_name(IMAGE, network)} at tick {message.tick}"
                    )
                    yield Still(f"tick {message.tick}", message.tick, data)
        except BrokenOff as error:
            if not any_frame:
                raise
            tell(str(error))
        messages.check_ours()
    if not any_frame:
        reason = f"no frames of the camera of network {network}"
        raise messages.error(reason, "record them: mirotwin run .. --record-frames")
    if messages.broken_off:
        tell(messages.broken_off)
