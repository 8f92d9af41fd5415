"""Files of characters: streams, pcapng, hex text, and what `decode` and `export` make of any file."""

from collections import Counter
from io import BytesIO
from itertools import islice

from miro_exact.bad_input import BadInput
from miro_protocol import pcapng, stream
from miro_protocol.pcapng_reader import CaptureError, events_line, iterate
from mirotwin.recording.capture import render
from mirotwin.recording.capture.forms import FORMS
from mirotwin.recording.capture.hextext import HexError, HexText
from mirotwin.recording.capture.input import Input
from mirotwin.recording.capture.layout import robots_in
from mirotwin.recording.capture.rows import rows
from mirotwin.recording.capture.source import READ_ERRORS, open_capture
from tests.fuzz.target import Target, always, folder, pieces, refused

_SOURCE = "fuzz.stream"
_MOST = 5_000
"""Transmissions that are looked at: a short capture can hold no more anyway."""


def _stream(data):
    try:
        found = stream.decode(data, _SOURCE)
    except BadInput as error:
        return refused(error)
    outcome = "taken"
    try:
        found.script()
    except BadInput as error:
        outcome = refused(error)
    again = stream.decode(stream.format_stream(found.entries, found.header).encode(), _SOURCE)
    assert again.entries == found.entries, "written and read again, the lines differ"
    assert again.header == found.header, "written and read again, the header differs"
    return outcome


def _pcapng():
    def read(source, passed_over):
        found = []
        try:
            for packet in iterate(source, "fuzz.pcapng", passed_over):
                found.append(packet)
        except CaptureError as error:
            return found, refused(error)
        return found, "taken"

    def run(data):
        passed_over = Counter()
        found, outcome = read(data, passed_over)
        if passed_over:
            assert events_line(passed_over).isprintable()
        assert read(BytesIO(data).read, Counter()) == (found, outcome), "from a pipe, it reads otherwise"
        keep = [one for one in found if one.network <= pcapng.MAX_NETWORK]
        assert list(iterate(pcapng.render(keep), "again")) == keep, (
            "written and read again, the packets differ"
        )
        return f"{outcome}, {min(len(found), 3)} packets"

    return run


def _hex_text():
    def read(parts):
        text, found = HexText("fuzz.txt"), b""
        try:
            for part in parts:
                found += text.feed(part)
            text.finish()
        except HexError as error:
            return found, refused(error)
        return found, "taken"

    def run(data):
        cut, text = 1 + data[0] % 16 if data else 1, data[1:]
        whole = read([text])
        assert whole == read(list(pieces(text, cut))), "cut elsewhere, the bytes or the error differ"
        if whole[1] == "taken":
            assert bytes.fromhex(whole[0].hex(" ")) == whole[0]
        return whole[1]

    return run


def _capture(data):
    forced, data = (data[0], data[1:]) if data else (0, b"")
    path = folder() / "fuzz.capture"
    path.write_bytes(data)
    said = []
    with Input(str(path)) as given:
        form = [*FORMS.values()][forced % len(FORMS)] if forced < 2 * len(FORMS) else None
        outcome, sent = "taken", []
        try:
            source = open_capture(given, said.append, form=form)
            sent += islice(source.sent, _MOST)
        except READ_ERRORS as error:
            outcome = refused(error)
            if not sent:
                return outcome
    assert all(line.isprintable() for line in said), said
    layouts = {one.network: robots_in(sent, one.network)[0] for one in sent}
    for row in rows(sent, layouts.__getitem__):
        assert render.table_line(row, source.timed).isprintable()
        render.json_line(row, source.timed)
    try:
        for convert_to in (render.to_pcapng(sent), render.to_stream(sent, layouts.__getitem__)):
            for _ in convert_to:
                pass
    except BadInput as error:
        outcome += f", {refused(error)}"
    return f"{source.form.name}: {outcome}"


STREAM_WORDS = (
    b"# mirotwin stream 2|#: | > | <@1 |*@0/1 |reset 1|power 0|radio down|P1.0|[scenario]|[expect]|end_tick = |"
    b"seed = |set = {|verdict = |55!"
).split(b"|")

TARGETS = {
    "stream": Target("stream files and their headers, written again", always(_stream), words=STREAM_WORDS),
    "pcapng": Target("captures, also from a pipe, written again", _pcapng, most_bytes=2048),
    "hextext": Target("hexadecimal text, cut anywhere", _hex_text, most_bytes=256),
    "capture": Target("any file as `decode` and `export` read it", always(_capture), words=STREAM_WORDS),
}
