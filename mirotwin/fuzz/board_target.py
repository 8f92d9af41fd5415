"""A target that is any 8051 firmware with a serial port, on a processor with 64 KB of RAM and nothing else.

Where the firmware sleeps when it has nothing to do, a run ends when it sleeps and has sent all it had; where it polls
for ever, 10 ms (at 24 MHz) after the last character, unless a time is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from miro_exact.bad_input import BadInput
from miro_exact.clock import CHARACTER_BITS, CYCLE_TICKS
from miro_exact.raised import raised
from miro_protocol.actions import ScriptItem
from miro_protocol.protocol import Protocol
from miro_protocol.transmission import Transmission
from miro_robot.board_spec import CRYSTAL_HZ, BoardSpec
from miro_robot.harness.harness import AWAKE, SETTLE_TICKS, Harness
from miro_robot.harness.program import INPUTS, Program
from miro_robot.harness.recording_bus import LONGEST_ANSWER_TICKS, BareOracle
from miro_robot.image import SPACE_BYTES, Image
from miro_sim.scenario.board import BoardScenario
from miro_sim.world.events import Event
from mirotwin.fuzz.processor import BOOT_MS, Processor, bit_ticks_of
from mirotwin.fuzz.protocols import called, protocol_named, shown
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import NEVER_SLEEPS, Target, TargetFailure, described
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.checks.interface import Check, Failure, Subject, checked_monitor
from mirotwin.verify.checks.serial import Character, SerialMonitor
from mirotwin.verify.expectations import checks_alone

NO_FAULT = "no_fault"
NO_FAULT_CODE, NEVER_SLEEPS_CODE, CHECK_CODE = 1, 2, 3
MOST_OF_A_BODY = 32
"""Bytes of a body in a seed; the harness's program has a form for longer ones, which a fuzzer triage."""
_SEEN = ("received", "transmitted")
_BY_TICK = attrgetter("tick")


class BoardTarget(Target):
    """`image` on a processor alone, up and in silence. `scenario`: the board on its wire.

    `protocol` makes frames of bodies; without it they are sent as they are. `checks` judge each run, `baud` 0 takes the
    rate of the receiver, `after_ticks` is how long a run goes on after its last character. `run(data)` returns 0 or
    what `failure` is: a fault, no sleep, what a check says. Raises BadInput where the firmware does not come up.
    """

    def __init__(
        self,
        image: Image,
        input: str = "session",
        protocol: Protocol | None = None,
        checks: Sequence[Check] = (),
        crystal_hz: int = CRYSTAL_HZ,
        baud: int = 0,
        boot_ms: int = BOOT_MS,
        after_ticks: int | None = None,
    ) -> None:
        if input not in INPUTS:
            raise BadInput("", "--input", f"{input!r} is no class of inputs", f"use {', '.join(INPUTS)}")
        self.protocol = protocol
        self.processor = Processor(image)
        try:
            board = BoardSpec(crystal_hz=crystal_hz, bound_stack=False)
        except ValueError as error:
            raise BadInput("", "--crystal", str(error)) from None
        self.processor.start_up(crystal_hz, boot_ms)
        bit_ticks = bit_ticks_of(self.processor, crystal_hz, baud, boot_ms)
        begin_tick = CYCLE_TICKS * self.processor.cpu.cycles
        self.scenario = BoardScenario(board=board, bit_ticks=bit_ticks, begin_tick=begin_tick)
        self.subject = Subject(self.processor, image, begin_tick, clock=crystal_hz, begin_tick=begin_tick)
        self.checks = checks
        for check in checks:
            _refuse_unseen(check, self.subject)
        self.oracle = BareOracle(self.processor.bus, self.processor.cpu)
        after = -1 if after_ticks is None else after_ticks
        harness = Harness(self.processor, self.processor.cpu, self.oracle, bit_ticks, after_ticks=after)
        program = Program(
            INPUTS.index(input),
            repair=lambda body: self._repaired(body, self.program.frames),
            character_ticks=CHARACTER_BITS * bit_ticks,
        )
        super().__init__(image, harness, program)
        self.code = 0
        self._wrong: Failure | None = None

    def _repaired(self, body: bytes, number: int | None = None) -> bytes:
        """The characters of a frame. Raises BadInput where the wire format fails itself."""
        protocol = self.protocol
        if protocol is None:
            return body
        return called(protocol.repair, lambda: bytes(memoryview(protocol.repair(body, number))))

    def run(self, data: Any) -> int:
        ended = self.play(data)
        self.code = NO_FAULT_CODE if self.oracle.code else 0
        if ended == AWAKE and not self.code:
            self.code = self._awake()
        if self.checks and not self.code:
            self._wrong = self._judged()
            self.code = CHECK_CODE if self._wrong else 0
        return self.code

    def _judged(self) -> Failure | None:
        """The failure of a check. A check that raises has failed, too: its error comes when the crash is confirmed."""
        tick = self.end_tick()
        for check in self.checks:
            try:
                monitor: Any = check.monitor(self.subject)
                self._feed(monitor)
                monitor.end(tick)
            except (Exception, SystemExit) as error:
                return Failure(check.name, 0, 0, tick, "", raised(error), alone_hz=self.subject.clock)
            if monitor.failures:
                return monitor.failures[0]  # type: ignore[no-any-return]
        return None

    def _feed(self, monitor: Any) -> None:
        """Tells a monitor what the serial port took and gave in the last run, and of the last reset."""
        bus = self.processor.bus
        # Without events where it can be: they take longer to make than a short run.
        if type(monitor).event is SerialMonitor.event:
            monitor.received = [Character(value, tick, bool(stop)) for value, stop, tick in bus.heard]
            monitor.sent = [Character(value, tick) for value, tick in bus.said]
        elif monitor.EVENTS:
            events = [
                Event(tick=tick, what="received", slot=0, value=value, good_stop=bool(stop))
                for value, stop, tick in bus.heard
            ]
            events += [Event(tick=tick, what="transmitted", slot=0, value=value) for value, tick in bus.said]
            for event in sorted(events, key=_BY_TICK):
                if event.what in monitor.EVENTS:
                    monitor.event(event)
        if bus.reset_tick >= 0:
            monitor.restarted(bus.reset_tick)

    def _awake(self) -> int:
        """Firmware that waits for its transmitter is awake, and no worse for it: as long as it sends, it may go on."""
        cpu, bus = self.cpu, self.processor.bus
        end = 12 * cpu.cycles + LONGEST_ANSWER_TICKS
        sent = -1
        while sent != len(bus.said) and 12 * cpu.cycles < end:
            sent = len(bus.said)
            idle = cpu.idle_cycles
            cpu.run(cpu.cycles + SETTLE_TICKS // 12)
            if bus.fault_kind:
                return NO_FAULT_CODE
            if cpu.idle_cycles > idle:
                return 0
        return NEVER_SLEEPS_CODE

    def end_tick(self) -> int:
        return 12 * self.cpu.cycles

    @property
    def failure(self) -> TargetFailure | None:
        fault = self.processor.fault()
        if self.code == NO_FAULT_CODE and fault is not None:
            return TargetFailure(NO_FAULT, fault.tick, fault.pc, str(fault))
        if self.code == NEVER_SLEEPS_CODE:
            where = self.image.symbols.name_at(self.cpu.pc)
            reason = f"awake long after the last character{f', in {where}' if where else ''}"
            return TargetFailure(NEVER_SLEEPS, self.end_tick(), 0, reason)
        if self.code == CHECK_CODE and self._wrong is not None:
            return TargetFailure(self._wrong.check, self.end_tick(), 0, self._wrong.what)
        return None

    def describe(self, data: bytes) -> str:
        return "\n".join(self._line(one) for one in self.script(data))

    def _line(self, item: ScriptItem) -> str:
        protocol = self.protocol
        if protocol is None or not isinstance(item, Transmission):
            return described(item)
        parts = called(protocol.decode, lambda: [shown(part) for part in protocol.decode(item.data)])
        return f"{described(item)}  # {'; '.join(parts)}"

    def seeds(self) -> list[bytes]:
        """Inputs to begin with: the protocol's samples, one by one and all together."""
        protocol = self.protocol
        samples: tuple[bytes, ...] = (b"\0", b"A", bytes(range(8)))
        if protocol is not None:
            samples = called(
                protocol.samples, lambda: tuple(bytes(memoryview(body)) for body in protocol.samples())
            )
        if self.input == "bytes":
            each = [self._repaired(body) for body in samples]
        else:
            each = [frame_input(body, self.input) for body in samples]
        return list(dict.fromkeys([*each, b"".join(each)]))

    def __repr__(self) -> str:
        return f"BoardTarget({self.image.path}, input={self.input!r}, {self.scenario})"


def _refuse_unseen(check: Check, subject: Subject) -> None:
    """Raises BadInput for a check that wants to see more than characters and memories."""
    unseen = [reason for reason in checked_monitor(check, subject).EVENTS if reason not in _SEEN]
    if unseen:
        reason = f"{check.name} judges by {', '.join(unseen)}, which only a whole run shows"
        raise BadInput("", "--expect-all", reason, "leave it out: each input that is new is judged so")


def frame_input(body: bytes, input: str) -> bytes:
    """The input that sends one body; of a class other than `bytes`, which has none."""
    content = body[:MOST_OF_A_BODY] or b"\0"
    return (b"\x07" if input == "session" else b"") + bytes([len(content) - 1]) + content


def board_target(spec: TargetSpec) -> BoardTarget:
    """The target of a specification; `parameters` may hold `crystal_hz` and `boot_ms`. Raises BadInput."""
    return BoardTarget(
        load_firmware(spec.image, SPACE_BYTES, named=False),
        spec.input,
        protocol_named(spec.protocol) if spec.protocol else None,
        checks_alone(spec.expected),
        baud=spec.baud,
        after_ticks=spec.after_ticks,
        **spec.parameters,
    )
