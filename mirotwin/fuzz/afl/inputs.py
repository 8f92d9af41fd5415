"""What afl-fuzz is given to begin with: a folder of seeds, and a dictionary of byte strings for its inputs."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_protocol.frames import Message, ServiceFrame, TeamFrame, describe, encode
from miro_protocol.table import (
    SERVICE_DATA,
    VELOCITY,
    VELOCITY_SATURATION,
    FrameType,
    Opcode,
    downlink,
)
from mirotwin.fuzz.afl.settings import LONGEST_BYTES

LONGEST_TOKEN = 128
"""Longer strings end afl-fuzz (MAX_DICT_FILE of its config.h)."""


def write_dictionary(path: Path, tokens: Mapping[str, bytes]) -> None:
    """Writes `name="\\x55.."` lines, as `afl-fuzz -x` reads them; each string once.

    Raises BadInput for a string that afl-fuzz would refuse.
    """
    lines = []
    for name, token in _unique(tokens):
        if not 1 <= len(token) <= LONGEST_TOKEN:
            raise BadInput(path, name, f"{len(token)} bytes", f"give 1 to {LONGEST_TOKEN}")
        word = "".join(char if char.isascii() and char.isalnum() else "_" for char in name)
        escaped = "".join(f"\\x{byte:02x}" for byte in token)
        lines.append(f'{word}="{escaped}"\n')
    path.write_text("".join(lines), encoding="ascii")


def write_seeds(folder: Path, inputs: Mapping[str, bytes]) -> int:
    """Writes the inputs into `folder`, one a file, the name in its name; returns how many files these are.

    Equal inputs are written once, empty ones never, long ones up to the length that afl-fuzz makes itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    unique = _unique({name: data[:LONGEST_BYTES] for name, data in inputs.items() if data})
    for number, (name, data) in enumerate(unique):
        word = "".join(char if char.isascii() and char.isalnum() else "_" for char in name)
        (folder / f"{number:04d}-{word[:64]}").write_bytes(data)
    return len(unique)


def wire_tokens(robots: int) -> dict[str, bytes]:
    """For inputs that are characters: what a frame begins with, and one whole frame of each kind."""
    form = downlink(robots)
    found = {"preamble": form.lead, "sync": form.sync, "begin": form.lead + form.sync}
    still = ((0, 0),) * robots
    messages: list[Message] = [TeamFrame(kind, 1, still) for kind in (FrameType.TEAM, FrameType.TEAM_ASK)]
    messages += [
        ServiceFrame(1, 0, opcode, tuple(field.low for field in SERVICE_DATA[opcode])) for opcode in Opcode
    ]
    return found | {describe(message): encode(message, robots) for message in messages}


def message_tokens(robots: int) -> dict[str, bytes]:
    """For inputs whose frames are sealed by the target: heads of service payloads, and limits of numbers."""
    heads = {f"{op.name} slot {slot}": bytes([slot, op]) for op in Opcode for slot in range(robots)}
    speeds = [limit for field in VELOCITY for limit in (field.low, field.high, field.low - 1)]
    speeds += [VELOCITY_SATURATION, VELOCITY_SATURATION + 1, -VELOCITY_SATURATION, -VELOCITY_SATURATION - 1]
    limits = {f"speed {value}": struct.pack("<h", value) for value in speeds}
    for fields in SERVICE_DATA.values():
        for field in fields:
            for value in (field.low, field.high, min(field.high + 1, (1 << 8 * field.size) - 1)):
                limits[f"{field.name} {value}"] = value.to_bytes(field.size, "little")
    return heads | limits


def _unique(named: Mapping[str, bytes]) -> list[tuple[str, bytes]]:
    """Each string once, in the order given, by its first name."""
    names: dict[bytes, str] = {}
    for name, data in named.items():
        names.setdefault(data, name)
    return [(name, data) for data, name in names.items()]
