"""The forms of captures: name, reader and properties of each."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial

import msgspec

from miro_exact.inputs import InputError
from miro_protocol import pcapng_reader
from miro_protocol.table import TICKS_PER_US
from miro_protocol.transmission import Transmission
from mirotwin.recording.capture import dumps, hexlines, tables
from mirotwin.recording.capture.input import HEAD_BYTES, Input
from mirotwin.recording.capture.pieces import Facts, Piece
from mirotwin.recording.capture.serial_line import characters_of
from mirotwin.recording.capture.text import head_lines, lines_of

Reader = Callable[[Input, Facts], Iterator[Piece]]
Packets = Callable[[Callable[[int], bytes], str, Counter[str]], Iterator[Transmission]]


class Form(msgspec.Struct, frozen=True):
    """`name`: for `--from-form`. `title`: in messages. `timed`: its characters have times. `directed`: it may contain
    the direction. `read`: None for forms whose reader gives transmissions.
    """

    name: str
    title: str
    timed: bool
    directed: bool
    read: Reader | None = None


def _head_lines(given: Input) -> list[str]:
    """The first lines, without one that is cut."""
    head = given.peek()
    return head_lines(head, len(head) < HEAD_BYTES)


def _packets(given: Input, facts: Facts, iterate: Packets) -> Iterator[Piece]:
    passed_over: Counter[str] = Counter()
    facts.resolution_ticks = TICKS_PER_US
    try:
        for sent in iterate(given.read, given.label, passed_over):
            yield Piece(sent.tick, sent.direction, sent.data, sent.network)
    finally:
        if passed_over:
            facts.tell(f"{given.label}: {pcapng_reader.events_line(passed_over)}")


def _hex_lines(given: Input, facts: Facts) -> Iterator[Piece]:
    return hexlines.read(lines_of(given), facts)


def _dump(given: Input, facts: Facts) -> Iterator[Piece]:
    return dumps.read(lines_of(given), facts, dumps.base_of(_head_lines(given)) or 16)


def _annotations(given: Input, facts: Facts) -> Iterator[Piece]:
    return dumps.read_annotations(lines_of(given), facts)


def _table(given: Input, facts: Facts) -> Iterator[Piece]:
    table = tables.table_of(_head_lines(given))
    if table is None:
        raise InputError(
            given.label,
            "has no columns of times and characters or levels",
            "name another form with --from-form",
        )
    if table.kind == "characters":
        return tables.read_characters(lines_of(given), facts, table)
    return characters_of(tables.read_levels(lines_of(given), facts, table), table.names, facts)


def _session(given: Input, facts: Facts) -> Iterator[Piece]:
    from mirotwin.recording.capture import logic  # loads numpy

    session = logic.Session(given.whole(), facts)
    return characters_of(session.changes(), session.names, facts)


def _value_changes(given: Input, facts: Facts) -> Iterator[Piece]:
    from mirotwin.recording.capture import logic

    dump = logic.Dump(given.whole(), facts)
    return characters_of(dump.changes(), dump.names, facts)


def _transitions(given: Input, facts: Facts) -> Iterator[Piece]:
    from mirotwin.recording.capture import logic

    channel = logic.Transitions(given, facts)
    return characters_of(channel.changes(), channel.names, facts)


def _terminal(given: Input, facts: Facts) -> Iterator[Piece]:
    del facts
    if match := TERMINAL.match(given.peek()):
        given.read(match.end())
    while data := given.read_some():
        yield Piece(None, "", data)


TERMINAL = re.compile(rb"[\r\n]*=~=~[=~]+ PuTTY log [0-9:. ]+ [=~]+\r?\n")
FORMS = {
    form.name: form
    for form in (
        Form("pcapng", "pcapng capture", True, True, partial(_packets, iterate=pcapng_reader.iterate)),
        Form("pcap", "pcap capture", True, True, partial(_packets, iterate=pcapng_reader.iterate_pcap)),
        Form("recording", "recording", True, True),
        Form("stream", "stream file", True, True),
        Form("saleae", "Saleae analyser table", True, True, _table),
        Form("table", "table of characters, CSV", True, True, _table),
        Form("edges", "digital edges, CSV", True, False, _table),
        Form("samples", "sigrok samples, CSV", True, False, _table),
        Form("sigrok", "sigrok session", True, False, _session),
        Form("logic2", "Logic 2 binary file", True, False, _transitions),
        Form("vcd", "value change dump", True, False, _value_changes),
        Form("stamped", "time-stamped hex lines", True, True, _hex_lines),
        Form("annotations", "sigrok annotations", False, True, _annotations),
        Form("hexdump", "hexdump", False, False, _dump),
        Form("xxd", "xxd dump", False, False, _dump),
        Form("od", "od dump", False, False, _dump),
        Form("putty", "PuTTY log of raw characters", False, False, _terminal),
        Form("hex", "hex text", False, False),
        Form("raw", "raw bytes", False, False),
    )
}
