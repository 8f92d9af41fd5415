"""Lines of hexadecimal characters with a time each, as loggers of serial ports write them.

    0.004000 > 55 55 ff             1732800000.004 ttyUSB0 TX 55 55 FF        (1732800000.004000) can0 123#5555FF
    [12:00:00.004] RX: 0x55 0x55    2024-11-28 12:00:00.004 [TX] - 55 55 FF   12 ms: 5555FF

A line with a time and no characters begins a block: `> 2024/11/28 12:00:00.004000  length=3`, then lines of characters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from mirotwin.recording.capture.clock import TIME, Clock
from mirotwin.recording.capture.pieces import Facts, Piece, direction_in

_PAIR = r"(?:0x)?[0-9A-Fa-f]{2}"
CHARACTERS = rf"{_PAIR}(?:(?:[,:;\-] ?| )?{_PAIR})*+(?![0-9A-Za-z])[,;:]?"
_END = r"(?:$|(?<=\s\s|.\t)|(?=[|\#\"<>;]))"
_WORD = r"(?!(?:0x)?(?:[0-9A-Fa-f]{2})+\b)\w+"
_CAN = r"\s*\w+\s+(?:[0-9A-Fa-f]{3,8}\#{1,2}|[0-9A-Fa-f]{3,8}\s+\[[0-9]+\]\s+)"
_STAMPED = re.compile(
    rf"\s*(?P<before>(?:[<>]+|\[?[TR]XD?\]?:?)\s*)?[\[(\"]?(?:{TIME})[)\]\"]?(?P<words>{_CAN}|(?:[^\w\n]|{_WORD})*+)"
    rf"(?P<data>{CHARACTERS})\s*+{_END}",
    re.IGNORECASE,
)
_HEAD = re.compile(
    rf"\s*(?P<before>(?:[<>]+|\[?[TR]XD?\]?:?)\s*)?[\[(\"]?(?:{TIME})(?P<words>[^\n]*)", re.IGNORECASE
)
_BARE = re.compile(rf"\s*(?P<data>{CHARACTERS})\s*+{_END}", re.IGNORECASE)
_NOT_DIGITS = re.compile(r"0x|[^0-9A-Fa-f]", re.IGNORECASE)
_DIVIDER = re.compile(r"\s*(?:[-=*#/;].*)?")


def fits(lines: list[str]) -> int:
    """How many of these lines are of this form: all with a time, of which the first has one that is plainly a time."""
    stamped = [match for match in map(_STAMPED.match, lines) if match]
    if not stamped:
        heads = [line for line in lines if (match := _HEAD.match(line)) and match["hour"]]
        bare = [line for line in lines if _BARE.match(line)]
        return len(heads) + len(bare) if heads and bare else 0
    plain = [match for match in stamped if _is_plain(match)]
    return len(plain)


def _is_plain(match: re.Match[str]) -> bool:
    """Whether the time cannot be taken for characters or for an offset."""
    number = match["number"]
    return (
        number is None
        or "." in number
        or bool(match["unit"] or direction_in(match["words"]) or match["before"])
    )


def read(lines: Iterator[str], facts: Facts) -> Iterator[Piece]:
    """A piece a line."""
    clock = Clock()
    direction, tick = "", None
    in_block = False
    for number, line in enumerate(lines, 1):
        match = _STAMPED.match(line)
        if match is None and in_block and (bare := _BARE.match(line)):
            yield Piece(tick, direction, characters(bare["data"]))
            tick = None
            continue
        match = match or _HEAD.match(line)
        if match is None:
            if not _DIVIDER.fullmatch(line):
                facts.pass_over("line", f"line {number}")
            continue
        try:
            tick = clock.ticks(match)
        except ValueError:
            facts.pass_over("line", f"line {number}")
            continue
        facts.resolution_ticks = clock.resolution_ticks
        direction = direction_in(f"{match['before'] or ''} {match['words']}")
        data = match.groupdict().get("data")
        in_block = data is None
        if data is not None:
            yield Piece(tick, direction, characters(data))


def characters(text: str) -> bytes:
    """The bytes of pairs of digits with separators."""
    return bytes.fromhex(_NOT_DIGITS.sub("", text))
