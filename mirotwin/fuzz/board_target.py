"""A target for any 8051 firmware with a serial port, on a processor with 64 KB of RAM, or on a board with parts.

For firmware that sleeps when idle, a run ends when it sleeps and has sent everything. For firmware that polls for ever,
a run ends 10 ms (at 24 MHz) after the last character, unless another time is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from operator import itemgetter
from typing import Any

from msgspec.structs import replace

from miro_exact.bad_input import BadInput, amount
from miro_exact.clock import CHARACTER_BITS, CYCLE_TICKS
from miro_exact.raised import raised
from miro_protocol.actions import Put, Reset, ScriptItem
from miro_protocol.protocol import Frame, Protocol
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.board_spec import CRYSTAL_HZ
from miro_robot.harness.harness import AWAKE, SETTLE_TICKS, Harness
from miro_robot.harness.program import INPUTS, RESET_TICKS, Program
from miro_robot.harness.recording_bus import LONGEST_ANSWER_TICKS
from miro_robot.image import SPACE_BYTES, Image
from miro_robot.mcs51.chips import CHIPS
from miro_sim.scenario.board_scenario import board_of_tables
from miro_sim.world.events import PC, Event
from mirotwin.fuzz.inputs import PIN, PUT, RESET, SILENCE, raw, waited
from mirotwin.fuzz.processor import BOOT_MS, bit_ticks_of, powered
from mirotwin.fuzz.protocols import called, protocol_named, shown
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import NEVER_SLEEPS, Target, TargetFailure, described
from mirotwin.fuzz.wired import WiredMachine
from mirotwin.shell.firmware_image import is_up, load_firmware
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.verify.checks.expect import checks_of_table
from mirotwin.verify.checks.interface import Check, Failure, Monitor, Subject, at, checked_monitor
from mirotwin.verify.checks.serial import Character, SerialMonitor
from mirotwin.verify.expectations import as_settings, checks_alone
from mirotwin.verify.steps.reading import steps_of

NO_FAULT = "no_fault"
NO_FAULT_CODE, NEVER_SLEEPS_CODE, CHECK_CODE = 1, 2, 3
MOST_OF_A_BODY = 32
"""Bytes of a body in a seed; the harness's program has a form for longer ones, which a fuzzer triage."""
MOST_PUT_SEEDS = 64
WAIT = bytes([SILENCE, 19])
_BITS = (b"\0\0", b"\x01\0", b"\xff\x7f", b"\xfe\xff", b"\xff\xff")
"""Values of a put in a seed: ends and middle of a number, and four words."""
UNHEARD_BAUD = 9600
"""Baud rate of characters sent to firmware whose receiver is off: such firmware reacts to parts only."""
_SEEN = ("received", "transmitted")
_BY_TICK = itemgetter(0)


class BoardTarget(Target):
    """`image` on a bare processor, started and idle. `scenario`: the board on its wire.

    `protocol` makes frames of bodies; without it bodies are sent unchanged. `checks` judge each run; `baud` 0: the rate
    of the receiver; `after_ticks`: length of a run after its last character. `run(data)` returns 0 or the code of
    `failure`: a fault, no sleep, or a failed check. `machine`: a started board with parts, instead of the bare
    processor. Raises BadInput if the firmware does not start.
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
        machine: WiredMachine | None = None,
    ) -> None:
        if input not in INPUTS:
            raise BadInput("", "--input", f"{input!r} is no class of inputs", f"use {', '.join(INPUTS)}")
        self.protocol = protocol
        self.wired = machine
        self.machine = machine or powered(image, crystal_hz, boot_ms)
        self.scenario = self.machine.scenario
        clock, bit_ticks = self.scenario.clock, 0 if baud else self.scenario.host_bit_ticks
        if not bit_ticks and machine is not None and machine.choices and not is_up(machine.cpu):
            baud = baud or UNHEARD_BAUD
        if not bit_ticks:
            waited_ms = boot_ms if machine is None else 1000 * machine.begin_tick // clock
            bit_ticks = bit_ticks_of(self.machine, clock, baud, waited_ms)
        begin_tick = CYCLE_TICKS * self.machine.cpu.cycles
        self.scenario = replace(self.scenario, bit_ticks=bit_ticks, begin_tick=begin_tick)
        self.subject = Subject(self.machine.device, image, begin_tick, clock=clock, begin_tick=begin_tick)
        self.checks = checks
        for check in checks:
            _refuse_unseen(check, self.subject)
        self.oracle, self.bus = self.machine.oracle, self.machine.bus
        after = -1 if after_ticks is None else after_ticks
        state, cpu = self.machine.board, self.machine.cpu
        harness = Harness(state, cpu, self.oracle, bit_ticks, after_ticks=after, device=machine)
        program = Program(
            INPUTS.index(input),
            repair=lambda body: self._repaired(body, self.program.frames),
            character_ticks=CHARACTER_BITS * bit_ticks,
            choices=0 if machine is None else machine.values,
            pins=0 if machine is None else len(machine.choices) - machine.values,
        )
        super().__init__(image, harness, program)
        self.code = 0
        self.left_out: dict[str, str] = {}  # checks that fail without any input, and why
        self.monitors: list[Any] = []
        self._wrong: Failure | None = None

    def _repaired(self, body: bytes, number: int | None = None) -> bytes:
        """The characters of a frame. Raises BadInput where the wire format fails itself."""
        protocol = self.protocol
        if protocol is None:
            return body
        return called(protocol.repair, lambda: bytes(memoryview(protocol.repair(body, number))))

    def run(self, data: Any) -> int:
        if self.checks and self.wired is not None:  # monitors of pins and values look on from the beginning
            self.harness.back()
            self.monitors = [self._monitor(check) for check in self.checks]
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
        if self.wired is None:
            self.monitors = [self._monitor(check) for check in self.checks]
        for check, monitor in zip(self.checks, self.monitors, strict=True):
            try:
                if isinstance(monitor, Failure):
                    return monitor
                self._feed(monitor)
                monitor.end(tick)
            except (Exception, SystemExit) as error:
                return self._raised(check, error)
            if monitor.failures:
                return monitor.failures[0]  # type: ignore[no-any-return]
        return None

    def _monitor(self, check: Check) -> Any:
        try:
            return check.monitor(self.subject)
        except (Exception, SystemExit) as error:
            return self._raised(check, error)

    def _raised(self, check: Check, error: BaseException) -> Failure:
        hertz = self.subject.clock
        return Failure(check.name, 0, 0, self.end_tick(), "", raised(error), alone_hz=hertz)

    def _feed(self, monitor: Any) -> None:
        """Passes the characters received and sent in the last run, and the edges of RST, to a monitor."""
        bus = self.bus
        happened: list[tuple[int, Event | None]] = [
            (tick - before, None) for tick in bus.resets for before in (RESET_TICKS, 0)
        ]
        # Without events where it can be: they take longer to make than a short run.
        if type(monitor).event is SerialMonitor.event:
            monitor.received = [Character(value, tick, bool(stop)) for value, stop, tick in bus.received]
            monitor.sent = [Character(value, tick) for value, tick in bus.sent]
        elif monitor.EVENTS:
            for value, stop, tick in bus.received:
                event = Event(tick=tick, what="received", slot=0, value=value, good_stop=bool(stop))
                happened.append((tick, event))
            sent = (("transmitted", 0, bus.sent), ("heard", PC, getattr(bus, "to_pc", ())))
            for kind, slot, characters in sent:
                happened += [
                    (tick, Event(tick=tick, what=kind, slot=slot, value=value)) for value, tick in characters
                ]
        for tick, caused in sorted(happened, key=_BY_TICK):
            if caused is None:
                monitor.restarted(tick)
            elif caused.what in monitor.EVENTS:
                monitor.event(caused)

    def _awake(self) -> int:
        """Checks that the firmware sleeps again; while it is still sending it may continue.

        Returns a failure code or 0.
        """
        cpu, bus = self.cpu, self.bus
        end = 12 * cpu.cycles + LONGEST_ANSWER_TICKS
        sent = -1
        while sent != len(bus.sent) and 12 * cpu.cycles < end:
            sent = len(bus.sent)
            idle = cpu.idle_cycles
            self.machine.run(self.end_tick() + SETTLE_TICKS)
            if bus.fault_kind:
                return NO_FAULT_CODE
            if cpu.idle_cycles > idle:
                return 0
        return NEVER_SLEEPS_CODE

    def end_tick(self) -> int:
        return 12 * self.cpu.cycles

    @property
    def failure(self) -> TargetFailure | None:
        fault = self.machine.fault()
        if self.code == NO_FAULT_CODE and fault is not None:
            return TargetFailure(NO_FAULT, fault.tick, fault.pc, str(fault))
        if self.code == NEVER_SLEEPS_CODE:
            where = self.image.symbols.name_at(self.cpu.pc)
            reason = f"awake long after the last character{f', in {where}' if where else ''}"
            return TargetFailure(NEVER_SLEEPS, self.end_tick(), 0, reason)
        if self.code == CHECK_CODE and self._wrong is not None:
            return TargetFailure(self._wrong.check, self.end_tick(), 0, self._wrong.what)
        return None

    def put_at(self, tick: int, which: int, value: int) -> Put:
        assert self.wired is not None
        return self.wired.put_at(tick, which, value)

    def describe(self, data: bytes) -> str:
        return "\n".join(self._line(item) for item in self.script(data))

    def _line(self, item: ScriptItem) -> str:
        protocol = self.protocol
        if protocol is None or not isinstance(item, Transmission):
            return described(item)
        parts = called(protocol.decode, lambda: [shown(part) for part in protocol.decode(item.data)])
        return f"{described(item)}  # {'; '.join(parts)}"

    def seeds(self) -> list[bytes]:
        """First inputs of a campaign: the protocol's samples, one by one and all together."""
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
        puts = [PUT + bytes([which]) + bits + WAIT for which in range(self.program.choices) for bits in _BITS]
        own = puts[:MOST_PUT_SEEDS] if self.input == "session" else []
        played = [] if self.wired is None else self.inputs_of(self.wired.played())
        return list(dict.fromkeys([*each, b"".join(each), *played, *own]))

    def inputs_of(self, happened: Iterable[ScriptItem]) -> list[bytes]:
        """At most one input. Only a session keeps pauses, resets and puts.

        A frame is kept as its payload, unless inputs are bytes.
        """
        items = [item for item in happened if not isinstance(item, Transmission) or item.direction == DOWN]
        texts = [item.data for item in items if isinstance(item, Transmission)]
        if self.input != "session":
            whole = b"".join(texts) if self.input == "bytes" else b"".join(map(self._operations, texts))
            return [whole] if whole else []
        data, end_tick = bytearray(), items[0].tick if items else 0
        for item in items:
            data += waited(item.tick - end_tick)
            end_tick = item.tick
            if isinstance(item, Transmission):
                data += self._operations(item.data)
                end_tick += CHARACTER_BITS * self.harness.bit_ticks * len(item.data)
            elif isinstance(item, Reset) and item.level:
                data.append(RESET)
            elif isinstance(item, Put) and self.wired is not None:
                paths = [path for path, _ in self.wired.choices]
                if item.path not in paths:  # of another board, or of a type that no bits choose
                    continue
                which = paths.index(item.path)
                op, number = (PUT, which) if which < self.wired.values else (PIN, which - self.wired.values)
                data += op + bytes([number]) + self.wired.bits_of(which, item.value).to_bytes(2, "little")
        return [bytes(data)] if data else []

    def _operations(self, characters: bytes) -> bytes:
        """The frames in these characters as their payloads; the other characters are kept in a session only."""
        protocol = self.protocol
        frames = (
            [] if protocol is None else called(protocol.decode, lambda: list(protocol.decode(characters)))
        )
        data, begin = b"", 0
        for frame in frames:
            if isinstance(frame, Frame) and len(frame.body) <= MOST_OF_A_BODY:
                between = characters[begin : frame.start]
                data += (raw(between) if self.input == "session" else b"") + frame_input(
                    frame.body, self.input
                )
                begin = frame.end
        return data + (raw(characters[begin:]) if self.input == "session" else b"")

    def note(self) -> str:
        """From when on inputs are played, for people."""
        if self.wired is None:
            return ""
        begin_tick, clock = self.harness.begin_tick, self.scenario.clock
        values, pins = self.wired.values, len(self.wired.choices) - self.wired.values
        named = [path for path, _ in self.wired.choices[:values]]
        if pins:
            named.append(amount(pins, "pin that nothing drives", "pins that nothing drives"))
        puts = ", ".join(named) if self.input == "session" else ""
        return f"inputs begin at {at(begin_tick, clock)}: {self.wired.how}; they put {puts or 'nothing'}"

    def chip_notes(self) -> list[str]:
        """Registers that the chip lacks and resets by its watchdog while the firmware came up, a line each."""
        return [] if self.wired is None else self.wired.device.notes()

    def __repr__(self) -> str:
        return f"BoardTarget({self.image.path}, input={self.input!r}, {self.scenario})"


def _refuse_unseen(check: Check, subject: Subject) -> None:
    """Raises BadInput for a check that wants to see more than characters and memories."""
    unseen = [reason for reason in checked_monitor(check, subject).EVENTS if reason not in _SEEN]
    if unseen:
        reason = f"{check.name} judges by {', '.join(unseen)}, which only a whole run shows"
        raise BadInput("", "--expect-all", reason, "leave it out: each input that is new is judged so")


def seen_in_target(checks: Sequence[Check], subject: Subject) -> list[Check]:
    """The checks that need no World: they judge by characters, memories, pins and values."""
    seen = []
    for check in checks:
        monitor = checked_monitor(check, subject)
        later = any(
            getattr(type(monitor), name) is not getattr(Monitor, name) for name in ("period", "period_over")
        )
        if not later and all(event in (*_SEEN, "heard") for event in monitor.EVENTS):
            seen.append(check)
    return seen


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


def wired_target(spec: TargetSpec) -> BoardTarget:
    """The target of a specification with a board. `parameters`: `tables`, the scenario; `steps`, how many of its steps
    bring the board up; `boot_ms`; `parts`, FILE.py:CLASS. Raises BadInput.
    """
    tables, steps, boot_ms, parts = (
        spec.parameters.get(key) for key in ("tables", "steps", "boot_ms", "parts")
    )
    PluginFiles(parts=parts or ()).bring()
    as_settings(spec.expected)  # checks in files are known by their names from here on
    scenario = board_of_tables(dict(tables or {}), "").scenario
    image = load_firmware(spec.image, CHIPS[scenario.board.chip].flash_bytes, named=False)
    machine = WiredMachine(scenario, image, steps_of(scenario, ""), steps or 0, boot_ms or 0)
    target = BoardTarget(
        image,
        spec.input,
        protocol_named(spec.protocol) if spec.protocol else None,
        baud=spec.baud,
        after_ticks=spec.after_ticks,
        machine=machine,
    )
    wanted = checks_of_table(scenario, "", "expect", scenario.expect).values()
    target.checks = seen_in_target([check for check in wanted if check is not None], target.subject)
    while target.run(b"") == CHECK_CODE and target.failure is not None:
        failed = target.failure
        target.left_out[failed.check] = failed.what
        target.checks = [check for check in target.checks if check.name != failed.check]
    return target
