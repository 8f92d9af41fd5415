"""The wire: the window decoder by each way of feeding it, frames, the PC's receiver of telemetry."""

from miro_host.telemetry_receiver import TelemetryReceiver
from miro_protocol import decoder
from miro_protocol.decoder import Scanner
from miro_protocol.frames import ContentError, describe, encode, format_of, seal
from miro_protocol.table import TELEMETRY, downlink
from tests.exact.uncompiled import uncompiled
from tests.fuzz.target import Draws, Target, always, pieces, refused
from tests.states import snapshot

_LIMITS = (1, 7, 64, 4096)
_SEEN = "python"  # the decoder is a hot module: coverage sees the source
_SPACINGS = (0, 0, 0, 480, 1200, 1920, -480, -1200, -1920, 100_000, -100_000, 1 << 40)
"""Ticks that a character comes late."""


def _feed():
    forms = (downlink(3), downlink(5), TELEMETRY)

    def same(scanners, events):
        assert events[0] == events[1] == events[2], "cut elsewhere, the events differ"
        first, second, third = map(snapshot, scanners)
        assert first == second == third, "cut elsewhere, the states differ"

    def run(data):
        draw = Draws(data)
        form, limit, cut = forms[draw.below(3)], _LIMITS[draw.below(4)], 1 + draw.below(40)
        scanners = [Scanner(form, limit) for _ in range(3)]
        fed, given, next_tick, paused, frames = b"", b"", 0, True, 0
        while draw.left:
            action = draw.below(8)
            if action == 0:
                for scanner in scanners:
                    scanner.gap()
                next_tick, paused = next_tick + (0 if paused else form.character_ticks), True
                continue
            if action == 1:
                ends = [scanner.flush() for scanner in scanners]
                same(scanners, ends)
                given += b"".join(event.data for event in ends[0])
                assert given == fed, "the events are not the characters fed"
                next_tick, paused = next_tick + (0 if paused else form.character_ticks), True
                continue
            start = None
            if action in (2, 3):
                start = draw.signed(8) if action == 2 else next_tick + draw.signed(2)
            body = draw.take(form.size - 4).ljust(form.size - 4, b"\0") if action >= 6 else b""
            chunk = seal(form, body) if body else draw.take(1 + draw.below(80))
            if not chunk:
                continue
            before = snapshot(scanners[0])
            try:
                whole = scanners[0].feed(chunk, start)
            except ValueError as error:
                refused(error)
                assert snapshot(scanners[0]) == before, "refused with a change"
                continue
            tick = next_tick if start is None else start
            parts = []
            for number, part in enumerate(pieces(chunk, cut)):
                parts += scanners[1].feed(part, None if number else start)
            symbols = [(byte, True, tick + at * form.character_ticks) for at, byte in enumerate(chunk)]
            same(scanners, (whole, parts, scanners[2].feed_symbols(symbols)))
            fed += chunk
            given += b"".join(event.data for event in whole)
            next_tick, paused = tick + len(chunk) * form.character_ticks, False
            frames += sum(hasattr(event, "body") for event in whole)
            assert len(given) + scanners[0].pending == len(fed), "characters were lost"
        return f"{form.name}: {min(frames, 3)} frames, {min(scanners[0].rejected, 3)} rejected"

    return run


def _columns():
    forms = (downlink(3), downlink(5), TELEMETRY)
    Twin = uncompiled(decoder).Scanner

    def rows(draw, form):
        found, tick = [], 0
        while draw.left:
            flaw = draw.below(256)
            if flaw == 0xFF:
                tick = draw.signed(8)
                continue
            body = draw.take(form.size - 4).ljust(form.size - 4, b"\0") if flaw == 0xFE else b""
            bad = flaw >> 4 == 0xD
            for byte in seal(form, body) if body else draw.take(1):
                found.append((byte, not bad, tick))
                tick += form.character_ticks
            tick += _SPACINGS[flaw % len(_SPACINGS)] if flaw < 0xD0 else 0
        return found

    def run(data):
        draw = Draws(data)
        form, limit, cut = forms[draw.below(3)], _LIMITS[draw.below(4)], 1 + draw.below(40)
        symbols = rows(draw, form)
        whole, parts, twin = (kind(form, limit) for kind in (Scanner, Scanner, Twin))
        good = 0
        for _byte, _stop_good, tick in symbols:  # up to the first that cannot be taken
            if not -(1 << 62) <= tick <= (1 << 62) - form.character_ticks:
                break
            good += 1
        events = whole.feed_symbols(symbols[:good])
        found = [
            *parts.feed_symbols(symbols[: min(cut, good)]),
            *parts.feed_symbols(symbols[min(cut, good) : good]),
        ]
        assert events == found, "cut elsewhere, the events differ"
        assert events == twin.feed_symbols(symbols[:good]), "the twins differ"
        states = [snapshot(one) for one in (whole, parts, twin)]
        assert states == states[:1] * 3, "the states differ"
        frames = sum(hasattr(event, "body") for event in events)
        if good < len(symbols):
            for one in (whole, parts, twin):
                try:
                    one.feed_symbols(symbols[good : good + 1])
                except ValueError as error:
                    outcome = refused(error)
                else:
                    raise AssertionError(f"takes tick {symbols[good][2]}")
            return outcome
        events += whole.flush()
        assert b"".join(event.data for event in events) == bytes(byte for byte, _, _ in symbols[:good]), (
            "the events are not the characters fed"
        )
        return f"{form.name}: {min(frames, 3)} frames, {min(whole.rejected, 3)} rejected"

    return run


def _frames(data):
    draw = Draws(data)
    n = (3, 5)[draw.below(2)]
    form = (downlink(n), TELEMETRY)[draw.below(2)]
    body = draw.take(form.size - 4).ljust(form.size - 4, b"\0")
    wire = seal(form, body)
    (event,) = Scanner(form).feed(wire)
    assert event.body == body
    assert event.data == wire
    try:
        message = event.message(n)
    except ContentError as error:
        return refused(error)
    assert describe(message).isprintable()
    assert format_of(message, n) is form
    assert encode(message, n) == wire, "encoded again, the frame differs"
    return type(message).__name__


def _telemetry(data):
    draw = Draws(data)
    robots, cut = (3, 5)[draw.below(2)], 1 + draw.below(64)
    symbols, tick = [], 0
    while draw.left:
        kind = draw.below(4)
        body = draw.take(TELEMETRY.size - 4).ljust(TELEMETRY.size - 4, b"\0")
        chunk = seal(TELEMETRY, body) if kind < 3 else body
        tick += draw.below(1 << 16) * 24
        symbols += [(byte, True, tick + at * TELEMETRY.character_ticks) for at, byte in enumerate(chunk)]
        tick += len(chunk) * TELEMETRY.character_ticks
    whole, parts = TelemetryReceiver(robots), TelemetryReceiver(robots)
    events = whole.receive(symbols)
    found = [event for at in range(0, len(symbols), cut) for event in parts.receive(symbols[at : at + cut])]
    assert events == found, "cut elsewhere, the events differ"
    assert snapshot(whole) == snapshot(parts), "cut elsewhere, the states differ"
    return f"{sum(one is not None for one in whole.last)} of {robots} heard, {min(len(events), 4)} events"


TARGETS = {
    "feed": Target("the decoder: bytes cut anywhere, with ticks, gaps and flushes", _feed, _SEEN, 160),
    "columns": Target("the decoder: symbols, by row and by column, both twins", _columns, _SEEN, 160),
    "frames": Target("bodies of frames, sealed: what they say, and back", always(_frames), _SEEN, 32),
    "telemetry": Target("the PC's receiver, cut anywhere", always(_telemetry), _SEEN, 256),
}
