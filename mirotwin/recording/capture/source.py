"""Opens a file of any form as transmissions: the one door of all commands that read captures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

import msgspec

from miro_exact.bad_input import one_line
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.inputs import InputError
from miro_protocol import stream
from miro_protocol.pcapng_reader import CaptureError
from miro_protocol.stream import StreamError
from miro_protocol.transmission import DOWN, UP, Transmission, character_ticks
from mirotwin.recording.capture import recorded
from mirotwin.recording.capture.detect import detect
from mirotwin.recording.capture.forms import FORMS, Form
from mirotwin.recording.capture.heads import frame_counts, head_of, is_telemetry, telemetry_count
from mirotwin.recording.capture.hextext import HexError, HexText
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.join import Joiner, moved_by
from mirotwin.recording.capture.options import AS_IT_SAYS, DIRECTIONS, CaptureOptions
from mirotwin.recording.capture.pieces import Facts, peeked
from mirotwin.recording.container import RecordingError

READ_ERRORS = (CaptureError, HexError, InputError, RecordingError, StreamError)
"""Errors of reading; everything that could be read comes before them."""
LINE_BYTES = 16 << 20
OWN = ("recording", "stream")
"""Forms of ours, which are taken without a word."""
_PACKETS = ("pcapng", "pcap")
_ESCAPED = re.compile(r"[\udc80-\udcff]")


class Source(msgspec.Struct):
    """`sent` in the order of the file; `robots`: network -> 3 or 5, from the file itself."""

    label: str
    form: Form
    sent: Iterator[Transmission]
    robots: dict[int, int]
    facts: Facts

    @property
    def timed(self) -> bool:
        """True if ticks are times; without them they only count characters."""
        return self.form.timed

    @property
    def notes(self) -> list[str]:
        """Comments for a stream file made of it; complete once its first transmission was read."""
        offset = self.facts.offset_s
        return [f"from {self.form.title}: {moved_by(offset)}"] if offset else []


def form_of(given: Input, options: CaptureOptions, tell: Callable[[str], None]) -> Form:
    """The form that the options name, else the one that is recognised. Raises InputError for a file in none."""
    if options.from_form is not None:
        return FORMS[options.from_form]
    form, why, remedy = detect(given.peek())
    if not form and given.path.endswith(".stream"):
        return FORMS["stream"]  # which says what is wrong with it
    if not form:
        raise InputError(given.label, why, remedy)
    if form not in OWN:
        tell(f"{given.label}: read as {FORMS[form].title}, {why}")
    return FORMS[form]


def open_capture(
    given: Input,
    tell: Callable[[str], None],
    options: CaptureOptions = AS_IT_SAYS,
    form: Form | None = None,
) -> Source:
    """`form` None: from the options, or detected. Reading may raise one of `READ_ERRORS`, and so may this. `tell` gets
    notes for the user: the detected form, skipped input, and the shift of times.
    """

    def say(line: str) -> None:
        tell(one_line(line))  # a line may quote a damaged file, which could move the terminal's cursor

    form = form or form_of(given, options, say)
    robots: dict[int, int] = {}
    facts = Facts(given.label, say, options.baud, options.wires)
    if form.name == "recording":
        return Source(given.label, form, recorded.transmissions(given, robots, say), robots, facts)
    if form.name == "stream":
        return Source(given.label, form, _stream(given, say), robots, facts)
    if form.read is not None:
        sent = Joiner(form.read(given, facts), facts).transmissions()
    else:
        sent = _contiguous(_raw(given) if form.name == "raw" else _hex(given))
    return Source(given.label, form, _directed(sent, form, options.direction, facts), robots, facts)


def timed_capture(
    given: Input,
    tell: Callable[[str], None],
    options: CaptureOptions = AS_IT_SAYS,
    form: Form | None = None,
) -> Source:
    """Like `open_capture`, for a replay. Raises InputError for a form without times, unless times are assumed."""
    source = open_capture(given, tell, options, form)
    if not source.timed and not options.assume_contiguous:
        remedy = "--assume-contiguous takes all characters to follow each other without a pause"
        raise InputError(given.label, f"{source.form.title} without times", remedy)
    return source


def _directed(
    sent: Iterator[Transmission], form: Form, requested: str | None, facts: Facts
) -> Iterator[Transmission]:
    """Assigns directions and networks to wires. The direction of an undirected wire is guessed from its beginning. A
    capture made at the robot has TX for the robot's characters: its directions are swapped. Two wires of opposite
    directions are one network.
    """
    head: list[Transmission]
    first, sent = peeked(sent, 1)
    if first and (requested or first[0].direction) and (form.name in _PACKETS or not form.timed):
        head, everything = [], sent  # a pipe need not wait for a beginning
    else:
        head, everything = head_of(sent)
    if _is_turned(head):
        facts.tell(f"{facts.label}: was captured at the robot: what it calls sent is from the robot")
        head = [_turned(piece) for piece in head]
        everything = map(_turned, everything)
    places: dict[int, tuple[str, int]] = {}
    taken = dict.fromkeys(DIRECTIONS.values(), 0)
    for wire in sorted({piece.network for piece in head}):
        own = [piece for piece in head if piece.network == wire]
        silent = [piece for piece in own if not piece.direction]
        looks_up = requested is None and bool(silent) and is_telemetry(silent)
        direction = UP if looks_up else DIRECTIONS[requested or "down"]
        directions = {piece.direction or direction for piece in own}
        places[wire] = direction, max(taken[each] for each in directions)
        taken.update(dict.fromkeys(directions, places[wire][1] + 1))
    usual = DIRECTIONS[requested or "down"]
    for piece in everything:
        direction, network = places.get(piece.network, (usual, piece.network))
        if piece.direction and network == piece.network:
            yield piece
            continue
        tick = piece.tick
        if not form.timed:  # it only counts characters
            tick = tick // character_ticks("") * character_ticks(direction)
        direction = piece.direction or direction
        yield msgspec.structs.replace(piece, tick=tick, direction=direction, network=network)


def _is_turned(head: Sequence[Transmission]) -> bool:
    """True if frames are in these only if directions are the other way round."""
    down, up = ([sent for sent in head if sent.direction == way] for way in (DOWN, UP))
    if any(frame_counts(down).values()) or telemetry_count(up):
        return False
    return any(frame_counts(up).values()) or bool(telemetry_count(down))


def _turned(sent: Transmission) -> Transmission:
    return msgspec.structs.replace(sent, direction={DOWN: UP, UP: DOWN}.get(sent.direction, sent.direction))


def _raw(given: Input) -> Iterator[bytes]:
    while data := given.read_some():
        yield data


def _hex(given: Input) -> Iterator[bytes]:
    text = HexText(given.label)
    while not text.failed and (piece := given.read_some()):
        yield text.feed(piece)
    text.finish()


def _contiguous(pieces: Iterator[bytes]) -> Iterator[Transmission]:
    step, count = character_ticks(""), 0
    for data in pieces:
        if data:
            yield Transmission(count * step, "", data)
            count += len(data)


def _stream(given: Input, tell: Callable[[str], None]) -> Iterator[Transmission]:
    reader = stream.Reader(_lines(given), given.label)
    crystal_hz = 0
    for entry in reader:
        sent = stream.characters(entry, given.label)
        if not crystal_hz:
            crystal_hz = reader.header.clock
            if crystal_hz != TICKS_PER_SECOND:
                tell(recorded.units_line(given.label, crystal_hz))
        yield recorded.in_usual_ticks(sent, crystal_hz)


def _lines(given: Input) -> Iterator[str]:
    number = 0
    while line := given.readline(LINE_BYTES):
        number += 1
        if len(line) == LINE_BYTES and not line.endswith(b"\n"):
            remedy = "is this a stream file?"
            raise StreamError(given.label, number, 1, f"a line of more than {LINE_BYTES >> 20} MiB", remedy)
        text = line.decode("utf-8-sig" if number == 1 else "utf-8", "surrogateescape")
        if wrong := _ESCAPED.search(text):
            reason = f"byte {ord(wrong[0]) - 0xDC00:02x}h is not UTF-8"
            raise StreamError(given.label, number, wrong.start() + 1, reason, "save the file as UTF-8 text")
        yield text
