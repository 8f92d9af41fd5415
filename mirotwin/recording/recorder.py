"""Writes a run to MCAP: everything that is needed to look at it, and to run it again, in one file.

Two runs of one scenario, seed and firmware give the same bytes: no wall clock, no version, no compression;
log time is the tick in nanoseconds, rounded down.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import TICKS_PER_SECOND
from miro_exact.installed import described_once
from miro_sim.periods import Period
from miro_sim.scenario.board_scenario import AnyText, BoardText
from miro_sim.scenario.plugins import plugins_used
from mirotwin.recording import channels
from mirotwin.recording.channels import FaultMessage, ImageMessage, TheoryMessage
from mirotwin.recording.rows import Message, MessageWriter
from mirotwin.recording.writer import McapWriter

if TYPE_CHECKING:
    from miro_sim.world.device import Device
    from miro_sim.world.world import World

METADATA = "mirotwin"
FORMAT = "4"
"""Raised whenever a recording of before would be read as something else: 3 has stop bits on the wire channels."""
SCENARIO_ATTACHMENT = "scenario.toml"
FIRMWARE_ATTACHMENT = "firmware.ihx"
SYMBOLS_ATTACHMENT = "symbols.json"
RESUMED_ATTACHMENT = "resumed.world"
"""Only in a recording of a run that went on from a saved world."""
FLUSH_S = 0.2
"""Wall time between two flushes, which comes to half a second on a busy machine too."""
TOGETHER = 40
"""Control periods that are written one after the other: after a simulated one the caches hold nothing of this."""
SERIAL = "mirotwin.serial"
"""Name of the metadata about the serial line of a board. `bit_ticks`: length of the bits that its host sent."""
BROKEN_OFF = "mirotwin.broken_off"
"""Name of the metadata in a recording whose run did not come to its end. `reason`: which part of which robot failed,
and when, if that is why."""


class RunSource(msgspec.Struct, frozen=True):
    """The sources of a run: scenario text, seed, firmware file, and its symbols (name -> address,
    space). `state`: the form of the states that its digests are of (`Flat.tables`), "" where it is not known.
    `resumed`: the saved world that the run went on from, empty for a run from its start. `origin`: "port" where robots
    were real and what is in it is their twin's, else empty. `plugins`: those of other distributions that the scenario
    names, with version and hash of their sources (`miro_exact.installed.described`). `board`: its name, ""
    for robots. `crystal_hz`: ticks per second. `bit_ticks`: length of the bits that the host of a board sent, 0 where
    it sent none.
    """

    scenario_name: str
    scenario_text: str
    seed: int
    firmware: bytes
    firmware_sha256: str
    symbols: dict[str, tuple[int, str]] = {}
    record: str = "default"
    state: str = ""
    resumed: bytes = b""
    origin: str = ""
    plugins: tuple[str, ...] = ()
    board: str = ""
    crystal_hz: int = TICKS_PER_SECOND
    bit_ticks: int = 0


def source_of(text: AnyText, world: World, record: str = "default", resumed: bytes = b"") -> RunSource:
    """The sources of a run of `world`, which is made of `text`."""
    image = world.image
    return RunSource(
        scenario_name=text.scenario.name,
        scenario_text=text.text,
        seed=world.seed,
        firmware=image.content,
        firmware_sha256=image.sha256,
        symbols={name: (at.address, at.space) for name, at in image.symbols.names.items()},
        record=record,
        state=world.state.tables(),
        resumed=resumed,
        plugins=plugins_used(text.scenario, described_once),
        board=text.scenario.board.name if isinstance(text, BoardText) else "",
        crystal_hz=world.clock,
    )


class Recorder:
    """An open recording. Use as a context manager: an error ends the file too, and marks it as broken off.

    `undisturbed` is entered wherever the file would be damaged by an exception out of the blue, such as Ctrl-C raises
    between any two instructions: it has to put that off.
    """

    def __init__(
        self, stream: BinaryIO, source: RunSource, undisturbed: AbstractContextManager[object] | None = None
    ) -> None:
        self._undisturbed = undisturbed or nullcontext()
        self._schemas: dict[bytes, int] = {}
        self._named: dict[str, int] = {}
        self._waiting: list[Period | Message] = []
        self._flushed_s = -FLUSH_S  # never
        self._writer = McapWriter(stream, profile=METADATA, library=METADATA)
        self._rows = MessageWriter(self._writer.chunk, self._add_channel, source.crystal_hz)
        self._writer.add_metadata(
            METADATA,
            {
                "format": FORMAT,
                "scenario": source.scenario_name,
                "seed": str(source.seed),
                "firmware_sha256": source.firmware_sha256,
                "record": source.record,
                **({"state": source.state} if source.state else {}),
                **({"source": source.origin} if source.origin else {}),
                **({"plugins": "\n".join(source.plugins)} if source.plugins else {}),
                **({"board": source.board} if source.board else {}),
                # Only where it is another one: recordings of robots keep the bytes that they always had.
                **({"crystal_hz": f"{source.crystal_hz}"} if source.crystal_hz != TICKS_PER_SECOND else {}),
            },
        )
        # Before the first message: a recording that is broken off anywhere can still be run again.
        self._writer.add_attachment(SCENARIO_ATTACHMENT, "application/toml", source.scenario_text.encode())
        self._writer.add_attachment(FIRMWARE_ATTACHMENT, "text/plain", source.firmware)
        # In a fixed order: else the bytes of two equal runs differ with the order in which symbols were read.
        symbols = msgspec.json.encode(source.symbols, order="deterministic")
        self._writer.add_attachment(SYMBOLS_ATTACHMENT, "application/json", symbols)
        if source.resumed:
            self._writer.add_attachment(RESUMED_ATTACHMENT, "application/octet-stream", source.resumed)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._undisturbed:
            try:
                self._write_waiting()
            # What waits may be what is wrong: the file still gets its end, and says that it was broken off.
            except Exception as unwritten:
                self._end(unwritten)
                raise
            self._end(error)

    def _end(self, error: BaseException | None) -> None:
        """Writes the end of the file; `error` broke the run off."""
        if error is not None:
            # Only errors that we wrote: the text of another may hold an address in memory.
            reason = {"reason": str(error)} if isinstance(error, BadInput) else {}
            self._writer.add_metadata(BROKEN_OFF, {"by": type(error).__name__, **reason})
        self._writer.finish()

    def flush(self) -> None:
        """Saves what was added up to now, even if this process is killed."""
        with self._undisturbed:
            # First: the writer does not know what waits here, and a kill would lose it.
            self._write_waiting()
            self._writer.flush()

    def flush_if_due(self) -> None:
        """Flushes at the first call, and then each 0.2 s."""
        now_s = time.monotonic()
        if now_s - self._flushed_s >= FLUSH_S:
            self.flush()
            # Not before the flush: one that failed would count as done.
            self._flushed_s = now_s

    def write(self, item: Period | Message) -> None:
        """Adds everything in a control period, or a message."""
        self._waiting.append(item)
        if len(self._waiting) >= TOGETHER:
            with self._undisturbed:
                self._write_waiting()

    def add(self, channel: str, network: int, slot: int, message: Any) -> None:
        """Adds a message of a robot; `slot` -1: of a whole network."""
        self.write((channels.topic_name(channel, network, slot), message.tick, message))

    def _write_waiting(self) -> None:
        # Taken out before it is written: an error in it would write it a second time at the end.
        waiting, self._waiting = self._waiting, []
        self._rows.write_all(waiting)

    def write_theories(self, theories: Iterable[tuple[int, int, TheoryMessage]]) -> None:
        """Adds what the theory says of robots (network, slot) in the control period that was written last."""
        for network, slot, message in theories:
            self.add("theory", network, slot, message)

    def write_faults(self, devices: Iterable[Device], alone: bool = False) -> None:
        """Adds what the firmware of these devices did that it must not do; `alone`: of a board on a wire."""
        for device in devices:
            for fault in device.board.faults:
                values = fault.tick, int(fault.kind), fault.pc, fault.symbol, str(fault)
                slot = -1 if alone else device.slot
                self.add(channels.FAULT, device.network, slot, FaultMessage(*values))

    def write_bit_ticks(self, bit_ticks: int) -> None:
        """Notes the length of the bits that the host of a board sends, as soon as it is known."""
        with self._undisturbed:
            self._write_waiting()
            # After what waits: metadata ends the chunk, and where chunks end must not depend on flushes.
            self._writer.add_metadata(SERIAL, {"bit_ticks": f"{bit_ticks}"})

    def write_image(self, network: int, tick: int, png: bytes) -> None:
        """Adds the frame of a network's camera that was exposed at `tick`, after all that was added before."""
        message = ImageMessage(channels.time_of(tick), f"net{network}/camera", png, "png", tick)
        self.add(channels.IMAGE, network, -1, message)

    def _add_channel(self, topic: str, message: msgspec.Struct) -> int:
        """A channel for messages like this one. A second law's inner values make the schema `mirotwin.Control2`."""
        kind = type(message)
        text = channels.schema_text(kind, channels.inner_of(message))
        # By text: two laws give one message type with other inner values, which needs a schema each.
        if text not in self._schemas:
            name = channels.schema_name(kind)
            number = self._named[name] = self._named.get(name, 0) + 1
            name += str(number) if number > 1 else ""
            self._schemas[text] = self._writer.add_schema(name, "jsonschema", text)
        return self._writer.add_channel(topic, "json", self._schemas[text])
