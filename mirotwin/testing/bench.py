"""One host and one robot on a bench: real firmware behind a radio, and the Python decoder listening beside it.

The Python side hears the same wire through a plain UART (`miro_protocol.line`) and applies decoder and freshness.
Firmware takes some milliseconds to look at a character, so for the last of them both counts are possible. Frames,
noise and trouble all change the level on one grid of bits: about a level that changes in the middle of a bit, and about
a pause between 20 us and 80 us, two right receivers may differ.
"""

from __future__ import annotations

import hashlib
from typing import NoReturn

import msgspec

from miro_exact.clock import HOST_BIT_TICKS, HOST_CHARACTER_TICKS, TICKS_PER_SECOND
from miro_exact.state import TICK, Rows, restore, snapshot
from miro_protocol.decoder import Decoder, Received, Symbol, TelemetryDecoder
from miro_protocol.frames import Message, TelemetryFrame, describe, encode
from miro_protocol.freshness import Freshness
from miro_protocol.line import Edge, LineReceiver
from miro_protocol.stream import Entry, format_stream
from miro_protocol.table import FRESH_AGAIN_TICKS, downlink
from miro_protocol.transmission import DOWN, Transmission, of_symbols
from miro_robot.board import Board
from miro_robot.image import Image
from miro_robot.mcs51.execute import WIRE_FULL
from miro_robot.mcs51.line import Line
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Radio
from miro_sim.radio.uplink import Uplink
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.testing.noisy_wire import NoisyWire, Trouble

MS = TICKS_PER_SECOND // 1000
BOOT_TICKS = 4 * MS
STEP_TICKS = 20 * MS
AHEAD_TICKS = 120  # an instruction may overrun a stop by so much
LOOKING_TICKS = 5 * MS  # after its last character, firmware may still be at a frame
EDGE_TICKS = MS // 5  # firmware tells "150 ms or more" to within 0.1 ms
COUNTERS = ("_frames_accepted", "_frames_rejected", "_frames_stale")

ANSWER_FRAMES = 4  # that may be counted while an answer is on its way

Counters = tuple[int, int, int]


class LinkFailure(AssertionError):
    """Both ends disagree, or the firmware faulted. `stream` is what the robot heard, as a stream file."""

    def __init__(self, what: str, stream: str) -> None:
        super().__init__(
            f"{what}\nwhat the robot received, as a stream file for `mirotwin replay`:\n{stream}"
        )
        self.what = what
        self.stream = stream


class Bench:
    """Robot `slot` of `n` (3 or 5) behind a radio. Time is `now`, in ticks of 24 MHz.

    `image` must export the counters (robot_fw/README.md), the slot must be there, and `radio` must neither delay by
    chance nor be off the host's baud rate: frames, noise and trouble change on one grid of bits. ValueError otherwise.
    """

    STATE = {
        "now": TICK,
        "booted_tick": TICK,
        "possible": Rows(
            *(1 << 20, TICK, TICK, TICK, TICK),
            split=lambda entry: (entry[0], *entry[1]),
            make=lambda cells: (cells[0], cells[1:]),
        ),
        "board": Board,
        "downlink": Downlink,
        "wire": NoisyWire,
        "uplink": Uplink,
        "receiver": LineReceiver,
        "decoder": Decoder,
        "freshness": Freshness,
        "telemetry": TelemetryDecoder,
    }
    NOT_STATE = ("n", "slot", "radio", "seed", "image", "addresses", "sent", "heard", "resets", "answers")

    def __init__(
        self,
        n: int = 3,
        slot: int = 0,
        radio: Radio | None = None,
        seed: int = 0,
        image: Image | None = None,
    ) -> None:
        self.n = n
        self.slot = slot
        self.radio = radio or Radio.ideal()
        if not 0 <= slot < n:
            raise ValueError(f"slot {slot} does not exist in a network of {n}; use 0 to {n - 1}")
        if self.radio.jitter_ticks or self.radio.baud_offset_ppm or self.radio.crystal_offset_ppm:
            raise ValueError(
                "radio: jitter and offsets leave the grid of bits that a bench works on; leave them 0"
            )
        self.seed = seed
        self.image = image or load_firmware()
        self.addresses = [_address(self.image, name) for name in COUNTERS]
        self.board = Board(load_wiring(), Plant(), slot, n)
        self.board.cpu.load(self.image.code, self.image.used)
        self.downlink = Downlink(self.radio, seed, "down")
        heard = Line()
        self.downlink.listen(slot, heard)
        self.wire = NoisyWire(heard, self.board.cpu.rxd, seed, "air")
        self.uplink = Uplink(self.radio, seed, "up")
        self.uplink.listen(self.board.cpu.txd)
        self.now = 0
        self.sent: list[Entry] = []
        self.heard: list[Symbol] = []
        self.resets: list[int] = []
        self.answers: list[tuple[int, TelemetryFrame]] = []
        self.receiver = LineReceiver()
        self.decoder = Decoder(n)
        self.freshness = Freshness()
        self.telemetry = TelemetryDecoder()
        self.possible: list[tuple[int, Counters]] = [(0, (0, 0, 0))]  # what to count, from which tick on
        self.booted_tick = BOOT_TICKS
        self.run_to(BOOT_TICKS)

    # ---- doing -------------------------------------------------------------------------------------------

    def send(self, message: Message) -> None:
        """Sends a frame and waits until it has been dealt with."""
        self.send_bytes(encode(message, self.n), describe(message))

    def send_bytes(self, data: bytes, comment: str = "") -> None:
        """Sends any characters (at least one), and waits until they have been dealt with."""
        self.run_to(self.begin(data, comment))

    def begin(self, data: bytes, comment: str = "") -> int:
        """Begins to send as soon as the channel is free; returns the tick at which it will have been dealt with."""
        start = self._start_tick()
        self.sent.append(Entry(Transmission(start, DOWN, data), comment))
        self.downlink.send(start, data)
        return start + len(data) * HOST_CHARACTER_TICKS + self.radio.latency_ticks + LOOKING_TICKS

    def _start_tick(self) -> int:
        """When the next transmission begins; put off where a frame would come right at the edge of 150 ms."""
        latency = self.radio.latency_ticks
        start = max(self.now + AHEAD_TICKS + self.radio.keyup_ticks, self.downlink.free_tick)
        start = _on_grid(start + latency) - latency
        if self.freshness.last_seq is not None:
            last = start + (downlink(self.n).wire_size - 1) * HOST_CHARACTER_TICKS + latency
            if abs(last - self.freshness.last_tick - FRESH_AGAIN_TICKS) <= EDGE_TICKS:
                start += _on_grid(2 * EDGE_TICKS)
        return start

    def trouble(self, kind: str, after_ticks: int, length_ticks: int) -> None:
        """Announces a "burst" of noise or a dropped link ("mark"), to happen after so many ticks from now.

        Both are rounded up to whole bits.
        """
        free = max([self.wire.settled_tick, *(one.end_tick for one in self.wire.troubles)])
        start = _on_grid(max(free, self.now + after_ticks))
        length_ticks = _on_grid(length_ticks)
        self.wire.trouble(msgspec.convert((start, start + length_ticks, kind), Trouble))

    def wait(self, ticks: int) -> None:
        if ticks < 0:
            raise ValueError(f"ticks = {ticks}: must not be negative")
        self.run_to(self.now + ticks)

    def reset(self) -> None:
        """The reset pin of the robot's processor, with nothing on the air. Its program begins again."""
        self.run_to(max(self.now, self.downlink.free_tick + self.radio.latency_ticks + LOOKING_TICKS))
        self.board.cpu.reset()
        self.resets.append(self.now)
        self.decoder = Decoder(self.n)
        self.freshness = Freshness()
        self.possible = [(0, (0, 0, 0))]
        self.booted_tick = self.now + BOOT_TICKS
        self.run_to(self.booted_tick)

    def run_to(self, tick: int) -> None:
        """Lets time pass. LinkFailure when the firmware faults or counts otherwise than Python."""
        while self.now < tick:
            self.now = min(tick, self.now + STEP_TICKS)
            self.downlink.settle(self.now + AHEAD_TICKS)
            self._hear(self.wire.settle())
            while self.board.run(self.now) == WIRE_FULL:
                self._take_answers(self.uplink.full_tick())
            if self.board.faults:
                fault = self.board.faults[0]
                where = self.image.symbols.name_at(fault.pc)
                self.fail(f"{fault}, in {where}" if where else str(fault))
            self._take_answers(self.now)
            self.check()

    def check(self) -> None:
        """LinkFailure unless the firmware's counters are those of the Python decoder and of freshness."""
        if self.now < self.booted_tick:
            return
        old = [place for place, (tick, _) in enumerate(self.possible) if tick <= self.now - LOOKING_TICKS]
        self.possible = self.possible[old[-1] if old else 0 :]
        expected = [counters for _, counters in self.possible]
        if self.counters not in expected:
            names = "(accepted, rejected, stale)"
            self.fail(f"tick {self.now}: firmware counts {self.counters} {names}, Python {expected[-1]}")

    def fail(self, what: str) -> NoReturn:
        raise LinkFailure(what, format_stream(self.heard_stream()))

    # ---- what came of it -----------------------------------------------------------------------------------

    @property
    def counters(self) -> Counters:
        """The firmware's: accepted, rejected, stale."""
        peek = self.board.cpu.peek_iram
        accepted, rejected, stale = (peek(at) | peek(at + 1) << 8 for at in self.addresses)
        return accepted, rejected, stale

    def _hear(self, edges: list[Edge]) -> None:
        for symbol in self.receiver.feed(edges, self.now):
            self.heard.append(symbol)
            for event in self.decoder.feed_symbols([symbol]):
                if isinstance(event, Received):
                    self.freshness.judge(event.seq, event.last_tick)
            counters = (self.freshness.accepted, self.decoder.rejected, self.freshness.stale)
            if counters != self.possible[-1][1]:
                self.possible.append((symbol[2] + HOST_CHARACTER_TICKS, counters))

    def _take_answers(self, tick: int) -> None:
        """What the host has received before `tick`."""
        for event in self.telemetry.feed_symbols(self.uplink.receive(tick)):
            if not isinstance(event, Received):
                continue
            answer = event.message(self.n)
            assert isinstance(answer, TelemetryFrame)
            accepted, rejected, _ = self.counters
            late = ((accepted - answer.accepted) & 0xFF, (rejected - answer.rejected) & 0xFF)
            if answer.slot != self.slot or max(late) > ANSWER_FRAMES:
                self.fail(f"tick {self.now}: robot {self.slot} answers {answer} and counts {self.counters}")
            self.answers.append((event.start_tick, answer))

    def heard_stream(self) -> list[Entry]:
        """What the robot heard since power-on, as a host could have sent it over an ideal link."""
        entries: list[Entry] = []
        free_tick = 0
        for heard in of_symbols(self.heard, DOWN):
            sent = msgspec.structs.replace(heard, tick=max(heard.tick, free_tick))
            entries.append(Entry(sent, self._comment(heard)))
            free_tick = sent.end_tick
        return entries

    def _comment(self, heard: Transmission) -> str:
        found = [event for event in Decoder(self.n).hear(heard) if isinstance(event, Received)]
        return "; ".join(f"type={event.type} seq={event.seq}" for event in found)

    # ---- state ---------------------------------------------------------------------------------------------

    def reloaded(self) -> Bench:
        """A new bench that goes on where this one is. LinkFailure unless its state is the same to the last bit."""
        other = Bench(self.n, self.slot, self.radio, self.seed, self.image)
        saved = snapshot(self)
        restore(other, saved)
        if snapshot(other) != saved:
            self.fail(f"tick {self.now}: the state changes when it is saved and loaded")
        other.sent, other.heard, other.answers = list(self.sent), list(self.heard), list(self.answers)
        other.resets = list(self.resets)
        return other

    def digest(self) -> str:
        """SHA-256 of the state."""
        return hashlib.sha256(snapshot(self)).hexdigest()

    def __repr__(self) -> str:
        return f"Bench(n={self.n}, slot={self.slot}, now={self.now}, counters={self.counters}, {self.radio})"


def _on_grid(tick: int) -> int:
    """The next tick at which a bit of slicer noise begins."""
    return -(-tick // HOST_BIT_TICKS) * HOST_BIT_TICKS


def _address(image: Image, name: str) -> int:
    symbol = image.symbols.find(name)
    if symbol is None or symbol.space != "iram":
        raise ValueError(
            f"{image.path}: no symbol {name} in internal RAM; put the .map or .cdb beside the image"
        )
    return symbol.address
