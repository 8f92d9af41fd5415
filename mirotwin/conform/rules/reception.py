"""Rules about valid frames: sync, stop bits, spacing, CRC, and the emptying of the receive window."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from miro_exact.rng import Stream
from miro_protocol.crc import POLYNOMIAL_REFLECTED
from miro_protocol.frames import seal
from miro_protocol.table import LAYOUT_TEAM, SEQ_MODULUS, SYNC, TELEMETRY, FrameType
from miro_protocol.whitening import whiten
from mirotwin.conform.hints import payload_of
from mirotwin.conform.rule import BOTH, FRAME, RECEPTION, VERSIONS, WHY, Chapter, Topology
from mirotwin.conform.trial_script import GAP_MS, Frame, How, TrialScript

CHAPTER = Chapter("Reception")
_CHANCE = Stream(0, "conform/reception")
LONGEST_US, SHORTEST_US = 80.0, 20.0
"""Two receivers may differ about a pause in between (protocol/README.md)."""


def refused(script: TrialScript, ways: Iterable[tuple[str, How]], in_a_row: int = 0) -> None:
    """Sends frames damaged in these ways, with good frames between. Robots must act on the good ones only.

    `in_a_row`: number of damaged frames without a pause, small enough that the failsafe does not act.
    """
    in_a_row = in_a_row or (3 if script.n == 3 else 2)
    before = ""
    for count, (mistake, how) in enumerate(ways):
        if count % in_a_row == 0:
            if count:
                script.wait(GAP_MS)
            script.obeyed(script.team(lead=b"\xff", label=f"team frame{before}"))
        before = f" after a {mistake}"
        damaged: How = {"lead": b"", "fresh": False, "gap_ms": 0.0, **how}
        script.ignored(script.team(label=mistake, **damaged))
    script.wait(GAP_MS)
    script.obeyed(script.team(lead=b"\xff", label=f"team frame{before}"))


@CHAPTER.rule("P04", RECEPTION, presupposes="P28", broken="a frame is not found by its sync alone")
def preamble(script: TrialScript) -> None:
    """A frame MUST be found by its sync: without preamble, and whatever characters, bad stop bits or pauses come before
    the sync.
    """
    ways: tuple[tuple[str, How], ...] = (
        ("without preamble", How(lead=b"")),
        ("after FFh alone", How(lead=b"\xff")),
        ("after AAh", How(lead=b"\xaa" * 5)),
        ("after 00h", How(lead=b"\x00" * 3)),
        ("after half a sync", How(lead=SYNC[:1])),
        ("with a bad stop bit before its sync", How(bad_stop=-1)),
        ("with a pause before its sync", How(pauses={0: 300.0})),
        ("with a pause in its preamble", How(pauses={-2: 5000.0})),
    )
    for condition, how in ways:
        script.obeyed(script.team(label=f"team frame {condition}", **how))


@CHAPTER.rule("P05", RECEPTION, presupposes="P04")
def sync(script: TrialScript) -> None:
    """A frame with any wrong bit in its sync MUST be refused."""
    ways = (
        (f"frame with bit {bit} of sync byte {at} wrong", How(wrong={at: 1 << bit}))
        for at in (0, 1)
        for bit in range(8)
    )
    refused(script, ways)


@CHAPTER.rule("P06", VERSIONS, presupposes="P07", broken="a frame of another layout is taken")
def layout(script: TrialScript) -> None:
    """The CRC MUST begin with the layout byte 10h | N: a frame of another layout is refused."""
    others = (LAYOUT_TEAM | (8 - script.n), TELEMETRY.layout, 0x20 | script.n, LAYOUT_TEAM, 0x00, 0xFF)
    refused(script, ((f"frame of layout {byte:02X}h", How(layout=byte)) for byte in others))


@CHAPTER.rule("P07", RECEPTION, presupposes="P04", broken="a wrong CRC is not handled as it has to be")
def crc(script: TrialScript) -> None:
    """All 16 bits of the CRC MUST count: a frame with a wrong CRC is refused."""
    low = script.form.size - 2
    ways = (
        (f"frame whose CRC leaves bit {bit} wrong", How(wrong={low: d & 0xFF, low + 1: d >> 8}))
        for bit, d in enumerate(map(leaving, (1 << bit for bit in range(16))))
    )
    refused(script, ways)


def leaving(register: int) -> int:
    """The error of a CRC field after which a receiver's register is wrong by `register`."""
    for _ in range(16):
        top = register & 0x8000
        register = (register ^ POLYNOMIAL_REFLECTED if top else register) << 1 | (1 if top else 0)
    return register


@CHAPTER.rule("P08", WHY, presupposes="P07")
def wrong_bits(script: TrialScript) -> None:
    """Frames with 1 to 4 wrong bits in HDR..CRC MUST be refused."""
    refused(script, _wrong_bits(script))


def _wrong_bits(script: TrialScript) -> Iterator[tuple[str, How]]:
    """One wrong bit in each character, then samples of two to four wrong bits."""
    characters = range(2, script.form.size)
    for character in characters:
        yield (
            f"frame with a wrong bit in character {character}",
            How(wrong={character: 1 << character * 3 % 8}),
        )
    draw = 0
    for count in (2, 3, 4):
        for _ in range(8):
            wrong: dict[int, int] = {}
            bits = 0
            while bits < count:
                place = int(_CHANCE.uniform(draw) * 8 * len(characters))
                draw += 1
                character, bit = 2 + place // 8, 1 << place % 8
                if not wrong.get(character, 0) & bit:
                    wrong[character] = wrong.get(character, 0) | bit
                    bits += 1
            where = ", ".join(map(str, sorted(wrong)))
            yield f"frame with {count} wrong bits in characters {where}", How(wrong=wrong)


@CHAPTER.rule("P09", RECEPTION, presupposes="P04", broken="a bad stop bit is not handled as it has to be")
def stop_bits(script: TrialScript) -> None:
    """A frame with a bad stop bit in any of its F characters MUST be refused."""
    places = range(script.form.size)
    refused(script, ((f"frame with a bad stop bit in character {at}", How(bad_stop=at)) for at in places))


@CHAPTER.rule(
    "P10", RECEPTION, presupposes="P04", broken="a pause within a frame is not handled as it has to be"
)
def long_pauses(script: TrialScript) -> None:
    """A frame with a pause of 80 us or more between any two of its F characters MUST be refused."""
    short = [(at, LONGEST_US) for at in range(1, script.form.size)]
    # counters of 8 and 16 bits that count machine cycles come round after the first two and the last
    long = [(script.form.size // 2, pause_us) for pause_us in (128.0, 256.0, 1040.0, 10_000.0, 32_766.3)]
    for ways, in_a_row in ((short, 0), (long, 1)):
        damaged = ((f"frame with {us:g} us before character {at}", How(pauses={at: us})) for at, us in ways)
        refused(script, damaged, in_a_row)


@CHAPTER.rule(
    "P11",
    RECEPTION,
    presupposes="P04",
    topologies=(*BOTH, Topology(3, (0,), baud_offset_ppm=25_000), Topology(5, (4,), baud_offset_ppm=-15_000)),
)
def short_pauses(script: TrialScript) -> None:
    """A frame with pauses of up to 20 us between its characters MUST be taken, and one of a host whose serial port is
    2.5 % too fast or 1.5 % too slow: the spacings are within 1040 +- 50 us.
    """
    offset = script.topology.baud_offset_ppm
    for _ in range(3):
        script.obeyed(script.team(label=f"team frame of a host {offset / 10_000:+g} %" if offset else ""))
    if not offset:
        places = range(1, script.form.size)
        name = f"team frame with {SHORTEST_US:g} us before"
        everywhere = dict.fromkeys(places, SHORTEST_US)
        script.obeyed(script.team(label=f"{name} each character", pauses=everywhere))
        for place in places:
            pauses = {place: SHORTEST_US}
            script.obeyed(script.team(label=f"{name} character {place}", lead=b"", pauses=pauses))


@CHAPTER.rule("P12", RECEPTION, presupposes="P14 P16")
def emptied(script: TrialScript) -> None:
    """A valid frame MUST empty the window: none of its characters is part of another frame."""
    for spoilt in (False, True):
        script.obeyed(script.team())
        outer, inner = _nested(script, spoilt)
        if spoilt:  # then the window was not emptied
            script.obeyed(inner)
        else:
            script.obeyed(outer)
            script.unchanged(outer.acted_tick, inner.acted_tick, f"{inner.what} not acted on")
        script.obeyed(script.team())


def _nested(script: TrialScript, spoilt: bool) -> tuple[Frame, Frame]:
    """A frame whose last six characters begin another one; with a wrong bit in the outer one, if `spoilt`.

    The first three characters of the inner payload are the outer frame's last; they are velocities of robot 0.
    """
    form = replace(script.form, lead=b"")
    outer_words, inner_words = script.words(), script.words()
    outer_seq, inner_seq = ((script.seq + step) % SEQ_MODULUS for step in (1, 2))
    outer_hdr, inner_hdr = (bytes([FrameType.TEAM * SEQ_MODULUS + seq]) for seq in (outer_seq, inner_seq))
    inner_payload = payload_of(inner_words)
    inner_start = SYNC + whiten(inner_hdr + inner_payload[:1])
    # what the outer payload must be in clear so that its last four characters are these on the air
    clear = whiten(bytes(form.body_size - len(inner_start)) + inner_start)[-len(inner_start) :]
    outer_wire = seal(form, outer_hdr + payload_of(outer_words)[: -len(clear)] + clear)
    forced = whiten(bytes(2) + outer_wire[-2:])[2:]  # the outer CRC, as the inner payload says it in clear
    inner_wire = seal(form, inner_hdr + inner_payload[:1] + forced + inner_payload[3:])
    wire = bytearray(outer_wire + inner_wire[len(inner_start) + 2 :])
    if spoilt:
        wire[2] ^= 0x02
    begun, step = script.now, script.character_ticks
    script.characters(bytes(wire))
    outer_end, end = begun + form.size * step, script.now
    outer = Frame(begun, outer_end - step, outer_end, outer_seq, outer_words, "outer frame")
    inner = Frame(begun, end - step, end, inner_seq, inner_words, "frame within a frame")
    script.seq = inner_seq if spoilt else outer_seq
    script.wait(12.0)
    return outer, inner


@CHAPTER.rule("P13", RECEPTION, presupposes="P09 P10 P14", broken="a frame right after garbage is lost")
def garbage(script: TrialScript) -> None:
    """The first undamaged frame MUST be taken, whatever garbage came right before it."""
    noise = bytes(int(_CHANCE.uniform(9000 + at) * 256) for at in range(300))
    frame = seal(script.form, bytes(script.form.body_size))
    kinds = (
        ("one character", b"\x2d"),
        ("random characters", noise[:40]),
        ("nothing but syncs", SYNC * 20),
        ("half a frame", frame[: -script.form.size // 2]),
        ("all of a frame but its last character", frame[:-1]),
        ("a frame with a wrong CRC", frame[:-1] + bytes([frame[-1] ^ 1])),
        ("00h", bytes(30)),
        ("FFh", b"\xff" * 30),
        ("246 random characters", noise[:246]),
        ("300 random characters", noise),
    )
    for disturbance, characters in kinds:
        script.characters(characters)
        script.obeyed(script.team(label=f"team frame right after {disturbance}", lead=b""))
    frames = (
        ("a bad stop bit", How(bad_stop=5)),
        ("a pause", How(pauses={7: 400.0})),
        ("a wrong bit", How(wrong={4: 4})),
    )
    for disturbance, how in frames:
        damaged: How = {"fresh": False, "gap_ms": 0.0, **how}
        script.team(**damaged)
        script.obeyed(script.team(label=f"team frame right after one with {disturbance}", lead=b""))
    for _ in range(3):  # none of three is lost, without a pause between them
        script.obeyed(script.team(label="team frame right after another", lead=b"", gap_ms=0.0))
    script.wait(12.0)


@CHAPTER.rule("P14", RECEPTION, presupposes="P07", broken="a frame after a false sync is lost")
def false_syncs(script: TrialScript) -> None:
    """A window with a wrong CRC MUST cost no frame: a sync in front of a frame is no reason to lose it."""
    for length in range(2, script.form.size, 3):
        lead = SYNC + bytes(range(0x60, 0x60 + length - 2))
        script.obeyed(script.team(label=f"team frame {length} characters after a sync", lead=lead))


@CHAPTER.rule(
    "P15", FRAME, presupposes="P13", topologies=(Topology(3, (1,), keyed=True), Topology(5, (3,), keyed=True))
)
def slicer_noise(script: TrialScript) -> None:
    """Between keyed frames, RXD shows slicer noise: the first frame with its preamble MUST be taken all the same."""
    for count in range(8):
        script.obeyed(script.team(label="team frame after noise", gap_ms=14.0 + 3.7 * count))
