"""Parses and writes one line of a stream file: an event at a tick.

    792000 > 55 55 ff 2d d4        characters from the host of network 0
    792000 <@1 55 55! ff           ... from a robot of network 1; the second one has a bad stop bit
    800000 *@1/2 reset 1           actions, see `actions.py`
    800000 *@1/2 power 0
    800000 *@1 radio down
    800000 *@1 reseed 10042
    800000 * P1.0 0
    800000 * eyes.distance_cm = 60
    800000 *@1/2 encoder left lost
    40ms > 55 55 ff 2d d4          a time with its unit is read, too: ticks are what is written

Version 1 has characters of network 0 with good stop bits, and nothing else; version 2 neither puts values of parts nor
gives a line the noise of another seed, and has no hardware faults.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from reprlib import repr as brief
from typing import TypeVar

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.domain import MAX_SEED
from miro_exact.times import tick_of
from miro_protocol.actions import (
    FAULTS,
    PUT_PATH,
    Action,
    Fault,
    PinLevel,
    Power,
    Put,
    RadioState,
    Reseed,
    Reset,
    ScriptItem,
    fault_text,
    put_of,
)
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import DIRECTIONS, DOWN, UP, Transmission, check_bad_stop


class StreamError(BadInput):
    """A line that cannot be read: file, line and column (from 1), the reason, and what to do about it."""

    def __init__(self, source: str, line: int, column: int, reason: str, remedy: str) -> None:
        super().__init__(source, (line, column), reason, remedy)


MAX_TICK = (1 << 61) - 1  # decoders count ticks in 64 bits
MAX_NETWORK = 0xFFFF
MAX_SLOT = max(ROBOT_COUNTS) - 1
HAND = "*"
FIRST_LINE = "# mirotwin stream {}"
VERSIONS = (1, 2, 3)
RADIO_STATES = ("up", "down", "noise")

_VERSION = re.compile(r"#\s*mirotwin stream\b\s*+(.*)")
_TOKEN = re.compile(r"\S+")
_CHARACTER = re.compile(r"([0-9a-fA-F]{2})(!?)")
_PLACE = re.compile(r"([<>*])(?:@([0-9]{1,5})(?:/([0-9]{1,5}))?)?")
_SEED = re.compile(r"[0-9]{1,19}")
_PIN = re.compile(r"P[0-3]\.[0-7]")
_ACTIONS = (
    "write `*@N/SLOT reset 0|1`, `*@N/SLOT power 0|1`, `*@N radio up|down|noise`,"
    " `*@N reseed SEED`, `* P1.0 0|1`, `* PART.KEY = VALUE`"
    " or a hardware fault such as `*@N/SLOT encoder left lost`"
)

StreamItem = ScriptItem | PinLevel
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Entry:
    """The content of a line, its comment, and the number of the line (0: not from a file)."""

    what: StreamItem
    comment: str = ""
    line: int = field(default=0, compare=False)


def version_of(item: StreamItem) -> int:
    """The first version that has words for it."""
    if isinstance(item, Put | Reseed | Fault):
        return 3
    return 2 if not isinstance(item, Transmission) or item.network or item.bad_stop else 1


def format_line(item: StreamItem, comment: str = "") -> str:
    """The line without its newline. ValueError when it could not be read back as the same."""
    if not 0 <= item.tick <= MAX_TICK:
        raise ValueError(f"tick = {item.tick}: must be 0..{MAX_TICK}")
    if comment != comment.strip() or "\n" in comment:
        raise ValueError(f"comment = {comment!r}: must be one line without blanks around it")
    said = _characters(item) if isinstance(item, Transmission) else _action(item)
    line = f"{item.tick} {said}"
    return f"{line}  # {comment}" if comment else line


def _characters(sent: Transmission) -> str:
    if sent.direction not in DIRECTIONS:
        raise ValueError(f"direction = {sent.direction!r}: must be {DOWN!r} or {UP!r}")
    if not sent.data:
        raise ValueError("data is empty: a transmission has at least one character")
    check_bad_stop(sent.bad_stop, len(sent.data))
    _check("network", sent.network, MAX_NETWORK)
    place = f"{sent.direction}@{sent.network}" if sent.network else sent.direction
    if not sent.bad_stop:
        return f"{place} {sent.data.hex(' ')}"
    bad = set(sent.bad_stop)
    return f"{place} " + " ".join(f"{byte:02x}{'!' * (at in bad)}" for at, byte in enumerate(sent.data))


def _action(action: Action | PinLevel) -> str:
    if isinstance(action, PinLevel):
        if not _PIN.fullmatch(action.pin):
            raise ValueError(f"pin = {action.pin!r}: must be P0.0..P3.7")
        _check("level", action.level, 1)
        return f"{HAND} {action.pin} {action.level}"
    _check("network", action.network, MAX_NETWORK)
    if isinstance(action, Put):
        _check("slot", action.slot, MAX_SLOT)
        if not PUT_PATH.fullmatch(action.path):
            raise ValueError(f"path = {action.path!r}: must be PART.KEY")
        place = f"@{action.network}/{action.slot}" if action.network or action.slot else ""
        return f"{HAND}{place} {action.text}"
    if isinstance(action, Reset | Power):
        word, value = ("reset", action.level) if isinstance(action, Reset) else ("power", action.on)
        _check("slot", action.slot, MAX_SLOT)
        _check("level", value, 1)
        return f"{HAND}@{action.network}/{action.slot} {word} {value}"
    if isinstance(action, Reseed):
        _check("seed", action.seed, MAX_SEED)
        return f"{HAND}@{action.network} reseed {action.seed}"
    if isinstance(action, Fault):
        _check("slot", action.slot, MAX_SLOT)
        return f"{HAND}@{action.network}/{action.slot} {fault_text(action.what)}"
    if action.state not in RADIO_STATES:
        raise ValueError(f"state = {action.state!r}: must be {', '.join(RADIO_STATES)}")
    return f"{HAND}@{action.network} radio {action.state}"


def _check(name: str, value: int, high: int) -> None:
    if not 0 <= value <= high:
        raise ValueError(f"{name} = {value}: must be 0..{high}")


class StreamLine:
    """Line `number` of the file `source`, to be read."""

    def __init__(self, source: str, number: int, text: str) -> None:
        self.source = source
        self.number = number
        self.text = text
        body, _, comment = text.partition("#")
        self.tokens = list(_TOKEN.finditer(body))
        self.end = len(body.rstrip()) + 1
        self.comment = comment.strip()

    def error(self, at: int | re.Match[str], reason: str, remedy: str) -> StreamError:
        """`at`: a column, or a token."""
        column = at if isinstance(at, int) else at.start() + 1
        return StreamError(self.source, self.number, column, reason, remedy)

    def version(self) -> int:
        """The version in the first line of a file; 1 if there is none."""
        match = _VERSION.match(self.text)
        if match is None:
            return 1
        version = match[1].rstrip()
        if version not in map(str, VERSIONS):
            reason = f"stream version {brief(version or 'missing')}"
            remedy = "this program reads versions 1 to 3; use the one that wrote it"
            raise self.error(match.start(1) + 1, reason, remedy)
        return int(version)

    def parse(self, version: int, crystal_hz: int = TICKS_PER_SECOND) -> Entry | None:
        """The entry of a line; None for an empty line or a comment. `crystal_hz`: ticks per second."""
        if not self.tokens:
            return None
        tick = self._tick(self.tokens[0], crystal_hz)
        kind, network, slot = self._place(version)
        if kind == HAND:
            item: StreamItem = self._read_action(tick, network, slot, version)
        else:
            item = self._read_characters(tick, kind, network or 0, version)
        return Entry(item, self.comment, self.number)

    def _tick(self, token: re.Match[str], crystal_hz: int) -> int:
        tick = tick_of(token[0], crystal_hz)
        if tick is None or tick > MAX_TICK:
            remedy = f"a line starts with a whole number 0..{MAX_TICK}, or with a time such as 4ms or 1.5s"
            raise self.error(token, f"{brief(token[0])} is not a tick", remedy)
        return tick

    def _place(self, version: int) -> tuple[str, int | None, int | None]:
        """Direction or `*`, network, slot."""
        remedy = f"write {DOWN} for host to robot or {UP} for robot to host after the tick"
        if len(self.tokens) == 1:
            raise self.error(self.end, "no direction", remedy)
        token = self.tokens[1]
        match = _PLACE.fullmatch(token[0])
        if match is None or (match[3] is not None and match[1] != HAND):
            raise self.error(token, f"{brief(token[0])} is not a direction", remedy)
        if version == 1 and token[0] not in DIRECTIONS:
            raise self._too_new(token, version, 2)
        network = self._number(token, match[2], "network", MAX_NETWORK)
        return match[1], network, self._number(token, match[3], "slot", MAX_SLOT)

    def _number(self, token: re.Match[str], digits: str | None, name: str, high: int) -> int | None:
        if digits is not None and int(digits) > high:
            raise self.error(token, f"{name} {digits}", f"there are {name}s 0..{high}")
        return None if digits is None else int(digits)

    def _too_new(self, token: re.Match[str], version: int, needed: int) -> StreamError:
        reason = f"{brief(token[0])} is not known in stream version {version}"
        return self.error(token, reason, f"begin the file with `{FIRST_LINE.format(needed)}`")

    def _read_characters(self, tick: int, direction: str, network: int, version: int) -> Transmission:
        if len(self.tokens) == 2:
            raise self.error(self.end, "no characters", "write at least one as two hex digits")
        data, bad_stop = bytearray(), []
        for token in self.tokens[2:]:
            match = _CHARACTER.fullmatch(token[0])
            if match is None:
                reason = f"{brief(token[0])} is not a character"
                raise self.error(token, reason, "write two hex digits each, with blanks between")
            if match[2]:
                if version == 1:
                    raise self._too_new(token, version, 2)
                bad_stop.append(len(data))
            data.append(int(match[1], 16))
        return Transmission(tick, direction, bytes(data), network, tuple(bad_stop))

    def _read_action(
        self, tick: int, network: int | None, slot: int | None, version: int
    ) -> Action | PinLevel:
        if "=" in self.text[: self.end - 1]:
            return self._read_put(tick, network, slot, version)
        words = [token[0] for token in self.tokens[2:]]
        if words and words[0] in FAULTS and (words[0] != "power" or "dip" in words):
            return self._read_fault(tick, network, slot, version)
        if len(self.tokens) != 4:
            raise self.error(self.end, "not an action", _ACTIONS)
        place, word, value = self.tokens[1], self.tokens[2][0], self.tokens[3][0]
        if word in ("reset", "power") and slot is not None and network is not None and value in ("0", "1"):
            return (Reset if word == "reset" else Power)(tick, network, slot, int(value))
        if word == "radio" and slot is None and network is not None and value in RADIO_STATES:
            return RadioState(tick, network, value)  # type: ignore[arg-type]
        if word == "reseed" and slot is None and network is not None and _SEED.fullmatch(value):
            if version < 3:
                raise self._too_new(self.tokens[2], version, 3)
            if int(value) > MAX_SEED:
                raise self.error(self.tokens[3], f"seed {value}", f"there are seeds 0..{MAX_SEED}")
            return Reseed(tick, network, int(value))
        if _PIN.fullmatch(word) and network is None and value in ("0", "1"):
            return PinLevel(tick, word, int(value))
        said = brief(self.text[place.start() : self.end - 1])
        raise self.error(place, f"{said} is not an action", _ACTIONS)

    def _read_fault(self, tick: int, network: int | None, slot: int | None, version: int) -> Fault:
        if network is None or slot is None:
            raise self.error(self.tokens[1], "a fault of no robot", "write *@N/SLOT before it")
        return self._of_text(version, lambda text: Fault(tick, network, slot, fault_text(text)))

    def _read_put(self, tick: int, network: int | None, slot: int | None, version: int) -> Put:
        if len(self.tokens) == 2:
            raise self.error(self.end, "not an action", _ACTIONS)
        return self._of_text(version, lambda text: put_of(tick, network or 0, slot or 0, text))

    def _of_text(self, version: int, read: Callable[[str], _T]) -> _T:
        """An action of version 3, read from the text of the line after its place."""
        token = self.tokens[2]
        if version < 3:
            raise self._too_new(token, version, 3)
        try:
            return read(self.text[token.start() : self.end - 1])
        except ValueError as error:
            reason, _, remedy = f"{error}".partition("; ")
            raise self.error(token, reason, remedy) from None
