"""Levels from sigrok sessions (`.sr`), value change dumps (VCD) and Saleae's binary files."""

from __future__ import annotations

import configparser
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from vcd.reader import TokenKind, VCDParseError, tokenize

from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.pieces import Facts
from mirotwin.recording.capture.serial_line import Change

PIECE_BYTES = 1 << 20
METADATA_BYTES = 1 << 16
MOST_S = 1e11
SALEAE = b"<SALEAE>"
DEFINITIONS = 1 << 14
"""Signals of a VCD file."""
_RATE = re.compile(r"([0-9]+(?:\.[0-9]+)?)\s*([kmg]?)(?:hz)?", re.IGNORECASE)
_DAMAGED = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, OSError, ValueError, EOFError)
"""Exceptions of `zipfile` for a damaged file."""
_PREFIXES = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9}
_SCALES = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9, "ps": 10**12, "fs": 10**15}


class Session:
    """A sigrok session: `names` of its logic channels, and their changes. Raises InputError for another zip file."""

    def __init__(self, file: BinaryIO, facts: Facts) -> None:
        self.facts = facts
        try:
            self.zip = zipfile.ZipFile(file)
            with self.zip.open("metadata") as metadata:
                text = metadata.read(METADATA_BYTES).decode("utf-8", "replace")
        except KeyError:
            raise self._error("is a zip file, but no sigrok session", "export the data as CSV") from None
        except _DAMAGED:
            raise self._error("is a damaged zip file", "copy it again") from None
        parser = configparser.ConfigParser(strict=False, interpolation=None)
        try:
            parser.read_string(text)
            device = next(parser[name] for name in parser.sections() if "capturefile" in parser[name])
            rate = _RATE.match(device.get("samplerate", ""))
            self.unit_bytes = int(device.get("unitsize", "1"))
        except (configparser.Error, StopIteration, ValueError):
            raise self._error("holds no logic channels", "save the session again, or export CSV") from None
        if (
            rate is None
            or not (hertz := float(rate[1]) * _PREFIXES[rate[2].lower()])
            or not 1 <= self.unit_bytes <= 8
        ):
            raise self._error("does not say its sample rate", "save the session again")
        self.rate_hz = hertz
        self.capture = device["capturefile"]
        probes = [(int(key[5:]) - 1, device[key]) for key in device if re.fullmatch("probe[1-9][0-9]?", key)]
        self.bits = [bit for bit, _ in sorted(probes) if bit < 8 * self.unit_bytes]
        self.names = [name for bit, name in sorted(probes) if bit < 8 * self.unit_bytes]
        facts.resolution_ticks = max(1, round(TICKS_PER_SECOND / hertz))

    def _error(self, reason: str, remedy: str) -> InputError:
        return InputError(self.facts.label, reason, remedy)

    def _pieces(self) -> Iterator[bytes]:
        names = set(self.zip.namelist())
        files = [self.capture] if self.capture in names else []
        number = 1
        while (name := f"{self.capture}-{number}") in names:
            files.append(name)
            number += 1
        rest = b""
        try:
            for name in files:
                with self.zip.open(name) as file:
                    while data := rest + file.read(PIECE_BYTES):
                        if len(data) < self.unit_bytes:
                            rest = data
                            break
                        whole = len(data) - len(data) % self.unit_bytes
                        rest = data[whole:]
                        yield data[:whole]
        except _DAMAGED:
            raise self._error("ends in a damaged part", "save the session again") from None

    def changes(self) -> Iterator[Change]:
        """The changes of all channels in the order of time."""
        mask = sum(1 << bit for bit in self.bits)
        last, sample = -1, 0
        for data in self._pieces():
            raw = np.frombuffer(data, np.uint8).reshape(-1, self.unit_bytes)
            words = np.zeros(len(raw), np.uint64)
            for place in range(self.unit_bytes):
                words |= raw[:, place].astype(np.uint64) << np.uint64(8 * place)
            words &= np.uint64(mask)
            places = np.flatnonzero(words[1:] != words[:-1]) + 1
            for place in (0, *places.tolist()):
                word = int(words[place])
                tick = round((sample + place) * TICKS_PER_SECOND / self.rate_hz)
                for line, bit in enumerate(self.bits):
                    if last < 0 or (word ^ last) >> bit & 1:
                        yield Change(tick, line, word >> bit & 1)
                last = word
            sample += len(words)


class Dump:
    """A value change dump: `names` of its signals of one bit, and their changes. Raises InputError."""

    def __init__(self, file: BinaryIO, facts: Facts) -> None:
        self.facts = facts
        self.names: list[str] = []
        self._lines: dict[str, int] = {}
        self._units = 0
        self._tokens = tokenize(file)  # type: ignore[arg-type]
        for kind, data in self._read():
            if kind is TokenKind.TIMESCALE:
                self._units = _SCALES[data.unit.value] // max(1, data.magnitude)
            elif kind is TokenKind.VAR and data.size == 1 and data.id_code not in self._lines:
                if len(self.names) == DEFINITIONS:
                    raise InputError(
                        facts.label, f"has more than {DEFINITIONS} signals", "dump the serial line alone"
                    )
                self._lines[data.id_code] = len(self.names)
                self.names.append(data.ref_str)
            elif kind is TokenKind.ENDDEFINITIONS:
                break
        if not self._units:
            raise InputError(facts.label, "does not say its timescale", "give a whole VCD file")
        facts.resolution_ticks = max(1, TICKS_PER_SECOND // self._units)

    def _read(self) -> Iterator[tuple[TokenKind, Any]]:
        try:
            for token in self._tokens:
                yield token.kind, token.data
        except (VCDParseError, ValueError, IndexError, UnicodeDecodeError) as error:
            raise InputError(self.facts.label, f"no more VCD: {error}", "dump it again") from None

    def changes(self) -> Iterator[Change]:
        """The changes of all signals in the order of time."""
        tick = 0
        for kind, data in self._read():
            if kind is TokenKind.CHANGE_TIME:
                tick = data * TICKS_PER_SECOND // self._units
            elif kind is TokenKind.CHANGE_SCALAR and data.id_code in self._lines and data.value in "01":
                yield Change(tick, self._lines[data.id_code], int(data.value))


class Transitions:
    """A binary file of Logic 2, version 0 or 1: one digital channel. Raises InputError."""

    def __init__(self, given: Input, facts: Facts) -> None:
        self.given = given
        self.names = ["the channel"]
        magic, version, kind = struct.unpack("<8sii", self._taken(16))
        if magic != SALEAE or version not in (0, 1):
            raise InputError(given.label, f"is no binary file of version 0 or 1 ({version})", "export CSV")
        if kind:
            raise InputError(given.label, "holds an analog channel", "export the digital one")
        self.parts = struct.unpack("<Q", self._taken(8))[0] if version else 1
        self.head = "<IdddQ" if version else "<IddQ"

    def changes(self) -> Iterator[Change]:
        """The changes of all parts of the file."""
        for _ in range(self.parts):
            level, *_, begin_s, _, count = struct.unpack(self.head, self._taken(struct.calcsize(self.head)))
            yield Change(self._tick(begin_s), 0, int(level != 0))
            level = int(level != 0)
            while count:
                some = min(count, PIECE_BYTES // 8)
                for (time_s,) in struct.iter_unpack("<d", self._taken(8 * some)):
                    level ^= 1
                    yield Change(self._tick(time_s), 0, level)
                count -= some

    def _tick(self, time_s: float) -> int:
        if not math.isfinite(time_s) or abs(time_s) > MOST_S:
            raise InputError(self.given.label, f"a time of {time_s} s", "export it again")
        return round(time_s * TICKS_PER_SECOND)

    def _taken(self, size: int) -> bytes:
        data = self.given.read(size)
        if len(data) < size:
            raise InputError(self.given.label, "the file ends in the middle of a channel", "export it again")
        return data
