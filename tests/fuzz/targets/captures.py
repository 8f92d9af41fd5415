"""Files of characters: streams, pcapng, hex text, and what `decode` and `export` make of any file."""

from itertools import islice

from tests.fuzz.target import Target, folder, pieces, refused

_SOURCE = "fuzz.stream"
_MOST = 5_000
"""Transmissions that are looked at: a short capture can hold no more anyway."""


def _stream():
    from miro_exact.bad_input import BadInput
    from miro_protocol import stream

    def run(data):
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

    return run


def _pcapng():
    from collections import Counter
    from io import BytesIO

    from miro_protocol import pcapng
    from miro_protocol.pcapng_reader import CaptureError, events_line, iterate

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
        assert read(BytesIO(data), Counter()) == (found, outcome), "from a pipe, it reads otherwise"
        keep = [one for one in found if one.network <= pcapng.MAX_NETWORK]
        assert list(iterate(pcapng.render(keep), "again")) == keep, (
            "written and read again, the packets differ"
        )
        return f"{outcome}, {min(len(found), 3)} packets"

    return run


def _hex_text():
    from mirotwin.recording.capture.hextext import HexError, HexText

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


def _capture():
    from miro_exact.bad_input import BadInput
    from mirotwin.recording.capture import render
    from mirotwin.recording.capture.detect import FORMATS, detect
    from mirotwin.recording.capture.input import Input
    from mirotwin.recording.capture.layout import robots_in
    from mirotwin.recording.capture.rows import rows
    from mirotwin.recording.capture.source import READ_ERRORS, open_source

    def run(data):
        forced, data = (data[0], data[1:]) if data else (0, b"")
        path = folder() / "fuzz.capture"
        path.write_bytes(data)
        said = []
        with Input(str(path)) as given:
            format, about = detect(given.peek())
            assert about.isprintable()
            format = FORMATS[forced % len(FORMATS)] if forced < 2 * len(FORMATS) else format
            outcome, sent = "taken", []
            source = open_source(given, format, said.append)
            try:
                sent += islice(source.sent, _MOST)
            except READ_ERRORS as error:
                outcome = refused(error)
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
        return f"{format}: {outcome}"

    return run


def stream_seeds():
    frame = "55 55 55 55 55 ff 2d d4 fc e0 11 22 33"
    bad = frame.replace("fc", "fc!")
    return [
        f"# mirotwin stream 1\n96000 > {frame}  # team seq=3\n\n400000 < {frame}\n".encode(),
        f"\ufeff# mirotwin stream 2\r\n96000 > {bad}\r\n400000 <@1 {frame} # more\r\n900000 >@1 55 55!".encode(),
        b"# mirotwin stream 2\n5 *@0/1 reset 1\n6 *@0 radio noise\n7 *@65535/4 power 0\n7 * P1.0 0 # pin\n",
        b'# mirotwin stream 2\n#: version = "0.1.0"\n#: seed = 7\n#: end_tick = 6000000\n#: verdict = "no_fault: x"\n'
        b'#: scenario = "fig6"\n#: set = {duration_s = 0.5}\n#:\n#: [expect]\n#: no_fault = true\n1 > 55\n',
        b"# mirotwin stream 2\n#: firmware_sha256 = '"
        + b"0a" * 32
        + b"'\n#: [scenario]\n#: duration_s = 1.0\n",
    ]


def _pcapng_seeds():
    import struct

    from miro_protocol import pcapng
    from miro_protocol.transmission import Transmission

    sent = [Transmission(96000, ">", b"\x55\x55\xff"), Transmission(120000, "<", b"answer", 1)]
    ours = pcapng.render(sent)

    def block(kind, body):
        size = struct.pack(">I", len(body) + 12)
        return struct.pack(">I", kind) + size + body + size

    section = block(0x0A0D0D0A, struct.pack(">IHHq", 0x1A2B3C4D, 1, 0, -1))
    options = struct.pack(">HHBxxx", 9, 1, 0x8A) + struct.pack(">HHq", 14, 8, 2) + bytes(4)
    interface = block(1, struct.pack(">HHI", 250, 0, 0) + options)
    packets = b"".join(
        block(
            6,
            struct.pack(">IIIII", 0, 0, 9 + at, 16, 16) + struct.pack(">IIBBH", 1, 2, event, 0, 0) + b"data",
        )
        for at, event in enumerate((1, 4, 7))
    )
    return [ours, section + interface + packets, ours + section + interface + packets]


def _hex_seeds():
    return [
        b"\x03" + b"55 55 ff 2d d4 # end\n0x55,0xFF;2d:d4\n",
        b"\x00\xef\xbb\xbf5555ff2dd4\n#only\nff f",
        b"\x05zz",
    ]


def _capture_seeds():
    found = [
        b"\xff" + seed for seed in (*stream_seeds(), *_pcapng_seeds(), b"55 55 ff 2d d4\n", b"\x89MCAP0\r\n")
    ]
    return [*found, b"\x01" + bytes.fromhex("5555555555ff2dd4fc") * 5]


STREAM_WORDS = (
    b"# mirotwin stream 2",
    b"#: ",
    b" > ",
    b" <@1 ",
    b"*@0/1 ",
    b"reset 1",
    b"power 0",
    b"radio down",
)
STREAM_WORDS += (
    b"P1.0",
    b"[scenario]",
    b"[expect]",
    b"end_tick = ",
    b"seed = ",
    b"set = {",
    b"verdict = ",
    b"55!",
)

TARGETS = {
    "stream": Target(
        "stream files and their headers, written again", _stream, stream_seeds, words=STREAM_WORDS
    ),
    "pcapng": Target("captures, also from a pipe, written again", _pcapng, _pcapng_seeds, most_bytes=2048),
    "hextext": Target("hexadecimal text, cut anywhere", _hex_text, _hex_seeds, most_bytes=256),
    "capture": Target(
        "any file as `decode` and `export` read it", _capture, _capture_seeds, words=STREAM_WORDS
    ),
}
