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
    rf"(?<!=)(?P<data>{CHARACTERS})\s*+{_END}",
    re.IGNORECASE,
)
_HEAD = re.compile(
    rf"\s*(?P<before>(?:[<>]+|\[?[TR]XD?\]?:?)\s*)?[\[(\"]?(?:{TIME})(?P<words>[^\n]*)", re.IGNORECASE
)
_BARE = re.compile(rf"\s*(?P<data>{CHARACTERS})\s*+{_END}", re.IGNORECASE)
_ROW = re.compile(r"(?P<data>(?:[0-9A-F]{2} ){16}).{16}")
"""A row of jpnevulator --ascii, whose text follows one blank."""
_NOT_DIGITS = re.compile(r"0x|[^0-9A-Fa-f]", re.IGNORECASE)
_DIVIDER = re.compile(r"\s*(?:[-=*#/;].*)?")


def fits(lines: list[str], loose: bool = False) -> int:
    """Number of lines of this form: with an unambiguous time, or in a block below such a line.

    `loose`: an integer before a colon or similar counts as a time, too.
    """
    plain = sum(bool((match := _STAMPED.match(line)) and _is_plain(match, loose)) for line in lines)
    if plain > loose:  # one such line may be anything
        return plain
    heads = sum(bool((match := _HEAD.match(line)) and match["hour"]) for line in lines)
    return heads and heads + sum(bool(_in_block(line)) for line in lines)


def _in_block(line: str) -> re.Match[str] | None:
    return _ROW.fullmatch(line) or _BARE.match(line)


def _is_plain(match: re.Match[str], loose: bool = False) -> bool:
    """True if the time cannot be taken for characters or for an offset."""
    number, words = match["number"], match["words"]
    if number is None or "." in number or match["unit"] or match["before"]:
        return True
    return bool(direction_in(words)) or (loose and words.lstrip()[:1] in (":", ";", ",", "|", "]", ")"))


def read(lines: Iterator[str], facts: Facts) -> Iterator[Piece]:
    """A piece a line."""
    clock = Clock()
    direction, tick = "", None
    in_block = told = False
    for number, line in enumerate(lines, 1):
        match = _STAMPED.match(line)
        if in_block and not (match and _is_plain(match)) and (bare := _in_block(line)):
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
        if clock.assumed and not told:
            told = True
            facts.tell(f"{facts.label}: times without a unit are taken as {clock.assumed}")
        direction = direction_in(f"{match['before'] or ''} {match['words']}")
        data = match.groupdict().get("data")
        in_block = data is None
        if data is not None:
            yield Piece(tick, direction, characters(data))


def characters(text: str) -> bytes:
    """The bytes of pairs of digits with separators."""
    return bytes.fromhex(_NOT_DIGITS.sub("", text))
