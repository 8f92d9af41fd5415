"""A target that is any 8051 firmware with a serial port, on a bare processor.

Where the firmware sleeps when it has nothing to do, a run ends when it sleeps and has sent all it had; where it polls
for ever, 10 ms (at 24 MHz) after the last character, unless a time is given.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.plugins import PluginError, Registry
from miro_exact.raised import at_place, defined_at, raised, raised_at
from miro_exact.raised import described as described_error
from miro_protocol.actions import ScriptItem
from miro_protocol.protocol import Damage, Frame, Protocol
from miro_protocol.toml_text import TomlError, struct_of
from miro_protocol.transmission import Transmission
from miro_robot.board_spec import CRYSTAL_HZ
from miro_robot.harness.harness import AWAKE, SETTLE_TICKS, Harness
from miro_robot.harness.program import INPUTS, Program
from miro_robot.harness.recording_bus import LONGEST_ANSWER_TICKS, BareOracle
from miro_robot.image import SPACE_BYTES, Image
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.target import Target, TargetFailure, described
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.bare.exchange import (
    NEVER_SLEEPS,
    NO_FAULT,
    Exchange,
    NamedCheck,
    check_named,
)
from mirotwin.verify.bare.machine import BOOT_MS, BareLine, BareProcessor, bit_ticks_of

OPTION = "--protocol"
PROTOCOLS: Registry[Protocol] = Registry(
    "mirotwin.protocols",
    word="protocol",
    key="protocol",
    base="miro_protocol.protocol:Protocol",
    own={"miro": "miro_protocol.miro_wire:Miro"},
)


def protocol_named(text: str) -> Protocol:
    """The protocol that `NAME` or `FILE.py:CLASS` means, with parameters behind it: `:KEY=VALUE,KEY=VALUE`, as in TOML.

    A file is run: `text` must come from the command line. Raises BadInput.
    """
    found, name, parameters = _class_in_file(text) or _installed(text)
    try:
        given = tomllib.loads(f"given = {{{parameters}}}")["given"]
    except tomllib.TOMLDecodeError:
        form = "write NAME:KEY=VALUE,KEY=VALUE, such as miro:robots=5"
        raise BadInput("", OPTION, f"{parameters!r} are no parameters", form) from None
    try:
        return struct_of(given, found)
    except TomlError as error:
        keys = ", ".join(field.name for field in msgspec.structs.fields(found)) or "no parameters"
        raise BadInput("", OPTION, f"{text}: {error.place}: {error.what}", f"{name} has {keys}") from None
    except (Exception, SystemExit) as error:  # from the protocol's own check of its parameters
        what = f"{text}: cannot check its parameters: {raised(error)}"
        raise BadInput("", OPTION, what, "repair the protocol") from error


NO_FAULT_CODE, NEVER_SLEEPS_CODE, CHECK_CODE = 1, 2, 3
MOST_OF_A_BODY = 32
"""Bytes of a body in a seed; the harness's program has a form for longer ones, which a fuzzer triage."""
_BITS = 10

T = TypeVar("T")


class BareTarget(Target):
    """`image` on a bare processor, up and in silence.

    `protocol` makes frames of bodies; without it they are sent as they are. `check` judges each run, `baud` 0 takes the
    rate of the receiver, `after_ticks` is how long a run goes on after its last character. `run(data)` returns 0 or
    what `failure` is: a fault, no sleep, what the check says. Raises BadInput where the firmware does not come up.
    """

    def __init__(
        self,
        image: Image,
        input: str = "session",
        protocol: Protocol | None = None,
        check: NamedCheck | None = None,
        crystal_hz: int = CRYSTAL_HZ,
        baud: int = 0,
        boot_ms: int = BOOT_MS,
        after_ticks: int | None = None,
    ) -> None:
        if input not in INPUTS:
            raise BadInput("", "--input", f"{input!r} is no class of inputs", f"use {', '.join(INPUTS)}")
        self.protocol = protocol
        self.check = check
        self.processor = BareProcessor(image)
        try:
            BareLine(crystal_hz)
        except ValueError as error:
            raise BadInput("", "--crystal", str(error)) from None
        self.processor.start_up(crystal_hz, boot_ms)
        bit_ticks = bit_ticks_of(self.processor, crystal_hz, baud, boot_ms)
        self.line = BareLine(crystal_hz, bit_ticks, self.processor.begin_tick)
        self.oracle = BareOracle(self.processor.bus, self.processor.cpu)
        after = -1 if after_ticks is None else after_ticks
        harness = Harness(self.processor, self.processor.cpu, self.oracle, bit_ticks, after_ticks=after)
        program = Program(
            INPUTS.index(input),
            repair=lambda body: self._repaired(body, self.program.frames),
            character_ticks=_BITS * bit_ticks,
        )
        super().__init__(image, harness, program)
        self.code = 0
        self._wrong = ""

    def _repaired(self, body: bytes, number: int | None = None) -> bytes:
        """The characters of a frame. Raises BadInput where the wire format fails itself."""
        protocol = self.protocol
        if protocol is None:
            return body
        return _asked(protocol.repair, lambda: bytes(memoryview(protocol.repair(body, number))))

    def run(self, data: Any) -> int:
        ended = self.play(data)
        self.code = NO_FAULT_CODE if self.oracle.code else 0
        if ended == AWAKE and not self.code:
            self.code = self._awake()
        if self.check is not None and not self.code:
            self._judge(self.check)
        return self.code

    def _judge(self, check: NamedCheck) -> None:
        """What the check says. That it fails itself is a failure too: it is told when the crash is confirmed."""
        try:
            self._wrong = check.judge(self.exchange()) or ""
        except BadInput as error:
            self._wrong = str(error)
        self.code = CHECK_CODE if self._wrong else 0

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

    def exchange(self) -> Exchange:
        """What went in and out in the last run; its memory is good until the next one."""
        return self.processor.exchange()

    def end_tick(self) -> int:
        return 12 * self.cpu.cycles

    @property
    def failure(self) -> TargetFailure | None:
        fault = self.processor.fault()
        if self.code == NO_FAULT_CODE and fault is not None:
            return TargetFailure(NO_FAULT, fault.tick, fault.pc, str(fault))
        if self.code == NEVER_SLEEPS_CODE:
            where = self.image.symbols.name_at(self.cpu.pc)
            what = f"awake long after the last character{f', in {where}' if where else ''}"
            return TargetFailure(NEVER_SLEEPS, self.end_tick(), 0, what)
        if self.code == CHECK_CODE and self.check is not None:
            return TargetFailure(self.check.name, self.end_tick(), 0, self._wrong)
        return None

    def describe(self, data: bytes) -> str:
        return "\n".join(self._line(one) for one in self.script(data))

    def _line(self, one: ScriptItem) -> str:
        protocol = self.protocol
        if protocol is None or not isinstance(one, Transmission):
            return described(one)
        said = _asked(protocol.decode, lambda: [_shown(part) for part in protocol.decode(one.data)])
        return f"{described(one)}  # {'; '.join(said)}"

    def seeds(self) -> list[bytes]:
        """Inputs to begin with: the protocol's samples, one by one and all together."""
        protocol = self.protocol
        samples: tuple[bytes, ...] = (b"\0", b"A", bytes(range(8)))
        if protocol is not None:
            samples = _asked(
                protocol.samples, lambda: tuple(bytes(memoryview(body)) for body in protocol.samples())
            )
        if self.input == "bytes":
            each = [self._repaired(body) for body in samples]
        else:
            each = [frame_input(body, self.input) for body in samples]
        return list(dict.fromkeys([*each, b"".join(each)]))

    def __repr__(self) -> str:
        return f"BareTarget({self.image.path}, input={self.input!r}, {self.line})"


def _installed(text: str) -> tuple[type[Protocol], str, str]:
    """The class, its name and the parameters of `NAME:PARAMETERS`."""
    name, _, parameters = text.partition(":")
    try:
        return PROTOCOLS.find(name), name, parameters
    except PluginError as error:
        raise BadInput("", OPTION, error.what, error.remedy) from error


def _class_in_file(text: str) -> tuple[type[Protocol], str, str] | None:
    """The same of `FILE.py:CLASS:PARAMETERS`; None for another text."""
    match = re.match(r"(.+?\.py)(?::([^:]*))?(?::(.*))?$", text, re.DOTALL)
    if match is None:
        return None
    path, name, parameters = match[1], match[2] or "", match[3] or ""
    return PROTOCOLS.of_file(path, name, OPTION), name, parameters


def _asked(method: Callable[..., object], call: Callable[[], T]) -> T:
    """What a protocol's method gives. Raises BadInput where it fails itself."""
    try:
        return call()
    except (Exception, SystemExit) as error:
        name = method.__name__
        what = at_place(f"`{name}` failed: {described_error(error)}", raised_at(error) or defined_at(method))
        raise BadInput("", "--protocol", what, f"let `{name}` do what miro_protocol.protocol says") from error


def _shown(part: Frame | Damage) -> str:
    return f"damage ({part.reason})" if isinstance(part, Damage) else f"frame {part.body.hex(' ')}"


def frame_input(body: bytes, input: str) -> bytes:
    """The input that sends one body; of a class other than `bytes`, which has none."""
    kept = body[:MOST_OF_A_BODY] or b"\0"
    return (b"\x07" if input == "session" else b"") + bytes([len(kept) - 1]) + kept


def bare_target(spec: TargetSpec) -> BareTarget:
    """The target of a specification; `parameters` may hold `crystal_hz` and `boot_ms`. Raises BadInput."""
    return BareTarget(
        load_firmware(spec.image, SPACE_BYTES, named=False),
        spec.input,
        protocol_named(spec.protocol) if spec.protocol else None,
        check_named(spec.check) if spec.check else None,
        baud=spec.baud,
        after_ticks=spec.after_ticks,
        **spec.parameters,
    )
