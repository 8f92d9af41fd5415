"""Camera frames in a recording: PNG files as messages that viewers show."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from miro_exact.clock import nanoseconds
from miro_protocol.stream import MAX_TICK

SCHEMA_NAME = "foxglove.CompressedImage"
SECOND_NS = 1_000_000_000

_WHOLE = {"type": "integer", "minimum": 0}
SCHEMA: dict[str, Any] = {
    "title": SCHEMA_NAME,
    "description": "A compressed image",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "properties": {"sec": _WHOLE, "nsec": {**_WHOLE, "maximum": SECOND_NS - 1}},
            "description": "Timestamp of image",
        },
        "frame_id": {"type": "string", "description": "Frame of reference for the image"},
        "data": {
            "type": "string",
            "contentEncoding": "base64",
            "description": "Compressed image data",
        },
        "format": {"type": "string", "description": "Image format"},
        "tick": {**_WHOLE, "description": "Of the middle of the exposure"},
    },
}


class TimeMessage(msgspec.Struct, frozen=True):
    """Simulated time, rounded down to nanoseconds."""

    sec: int
    nsec: int


class ImageMessage(msgspec.Struct, frozen=True):
    """`camera/image`: a plain frame as the PC gets it; `data` is a file of this `format`, in base64 as JSON."""

    timestamp: TimeMessage
    frame_id: str
    data: bytes
    format: str
    tick: Annotated[int, Meta(ge=0, le=MAX_TICK)]


def image_message(network: int, tick: int, png: bytes) -> ImageMessage:
    """The frame of a network's camera that was exposed at `tick`."""
    at = TimeMessage(*divmod(nanoseconds(tick), SECOND_NS))
    return ImageMessage(at, f"net{network}/camera", png, "png", tick)
