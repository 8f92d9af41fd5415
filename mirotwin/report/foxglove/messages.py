"""Messages of Foxglove's schemas: those that are written here, with the names and the order of the published fields.

A field that is never used is absent, as in protobuf. The JSON schemas in a file are made from these classes. Lengths in
m, angles as unit quaternions, colours from 0 to 1.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from mirotwin.recording.channels import TimeMessage
from mirotwin.recording.channels import time_of as time_of

# The published JSON schemas tell the two apart by these titles (foxglove-sdk, schemas/jsonschema).
Timestamp = Annotated[TimeMessage, msgspec.Meta(title="time")]
Duration = Annotated[TimeMessage, msgspec.Meta(title="duration")]
ALWAYS = TimeMessage(0, 0)
"""Lifetime of objects that stay until they are replaced."""


class Vector3(msgspec.Struct, frozen=True):
    x: float
    y: float
    z: float


class Quaternion(msgspec.Struct, frozen=True):
    x: float
    y: float
    z: float
    w: float


class Pose(msgspec.Struct, frozen=True):
    position: Vector3
    orientation: Quaternion


class Color(msgspec.Struct, frozen=True):
    r: float
    g: float
    b: float
    a: float


class FrameTransform(msgspec.Struct, frozen=True):
    """Pose of the child frame in the parent frame."""

    timestamp: Timestamp
    parent_frame_id: str
    child_frame_id: str
    translation: Vector3
    rotation: Quaternion


class FrameTransforms(msgspec.Struct, frozen=True):
    transforms: tuple[FrameTransform, ...]


class SolidPrimitive(msgspec.Struct, frozen=True):
    """A cube or a sphere."""

    pose: Pose
    size: Vector3
    color: Color


LINE_STRIP, LINE_LOOP, LINE_LIST = 0, 1, 2


class LinePrimitive(msgspec.Struct, frozen=True):
    """`type`: LINE_STRIP, LINE_LOOP or LINE_LIST."""

    type: int
    pose: Pose
    thickness: float
    scale_invariant: bool
    points: tuple[Vector3, ...]
    color: Color


class TriangleListPrimitive(msgspec.Struct, frozen=True):
    pose: Pose
    points: tuple[Vector3, ...]
    color: Color


class TextPrimitive(msgspec.Struct, frozen=True):
    pose: Pose
    billboard: bool
    font_size: float
    scale_invariant: bool
    color: Color
    text: str


class SceneEntity(msgspec.Struct, frozen=True, kw_only=True):
    """Primitives in one frame. It replaces the entity of the same `id` on the same topic."""

    timestamp: Timestamp
    frame_id: str
    id: str
    lifetime: Duration = ALWAYS
    frame_locked: bool = True
    cubes: tuple[SolidPrimitive, ...] = ()
    spheres: tuple[SolidPrimitive, ...] = ()
    lines: tuple[LinePrimitive, ...] = ()
    triangles: tuple[TriangleListPrimitive, ...] = ()
    texts: tuple[TextPrimitive, ...] = ()


class SceneUpdate(msgspec.Struct, frozen=True):
    entities: tuple[SceneEntity, ...]


class CompressedImage(msgspec.Struct, frozen=True):
    """`data` in base64 as JSON."""

    timestamp: Timestamp
    frame_id: str
    data: bytes
    format: str


class CameraCalibration(msgspec.Struct, frozen=True):
    """Matrices row by row."""

    timestamp: Timestamp
    frame_id: str
    width: int
    height: int
    distortion_model: str
    distortion: tuple[float, ...] = msgspec.field(name="D")
    intrinsic: tuple[float, ...] = msgspec.field(name="K")
    rectification: tuple[float, ...] = msgspec.field(name="R")
    projection: tuple[float, ...] = msgspec.field(name="P")


INFO, WARNING, ERROR = 2, 3, 4


class Log(msgspec.Struct, frozen=True):
    """`level`: INFO, WARNING or ERROR. `name`: the subject of the line."""

    timestamp: Timestamp
    level: int
    message: str
    name: str
    file: str = ""
    line: int = 0
