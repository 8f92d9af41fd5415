"""The steps of a scenario, actions and waits, and the frames of a host: one frozen struct per kind.

A step's table has one key that names its kind, the verb: `VERBS`. The other keys belong to the verb. A new kind is a
class here with `do`, in the table `PLAIN`, and a row on the page of the steps. Its verb is no key that every step has.
A step's result is an attribute of `Player`; `Run.result` and `play_at_port` add it to the result of a run.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import msgspec
from msgspec import Meta

from miro_exact.bad_input import amount
from miro_exact.clock import (
    CONTROL_PERIOD_TICKS,
    HOST_CHARACTER_TICKS,
    LM629_SAMPLE_TICKS,
    TICKS_PER_SECOND,
)
from miro_host.wheels import UNITS_PER_COUNT, Wheels, nearest
from miro_protocol.actions import OF_BOARDS, Fault, Power, RadioState, Reset, fault_text
from miro_protocol.frames import ServiceFrame, TeamFrame
from miro_protocol.table import DOWNLINK, SEQ_MODULUS, Opcode
from miro_robot.parts.values import checked_put, leaves
from miro_sim.world.conditions import (
    BOTH,
    Followed,
    Kind,
    Network,
    OfPin,
    OnBoard,
    Reached,
    Recorded,
    Slot,
    SpeedMS,
    WheelSpeeds,
    unknown_robot_pin,
)
from miro_sim.world.followers import shown
from miro_sim.world.machine import Feature
from mirotwin.verify.checks.following import unknown_source
from mirotwin.verify.checks.interface import Check, in_ms, ms_ticks

if TYPE_CHECKING:
    from miro_sim.scenario.board import BoardScenario
    from miro_sim.scenario.keys import NetworkSpec as ScenarioNetwork
    from mirotwin.verify.steps.player import Host, Player


CHARACTER = re.compile(r"[0-9a-fA-F]{2}!?")
MOST_ACCELERATION_M_S2 = 16_000.0
FilterWord = Annotated[int, Meta(ge=0, le=0x7FFF)]
Pair = tuple[SpeedMS, SpeedMS]
FILE = re.compile(r"[A-Za-z0-9_-]{1,64}\.world")
LONGEST_MS = 86_400_000.0
PauseMs = Annotated[float, Meta(gt=0.0, le=LONGEST_MS)]
WithinMs = Annotated[float, Meta(ge=0.0, le=LONGEST_MS)]
GapMs = Annotated[float, Meta(ge=0.0, le=60_000.0)]
Awaited = Recorded | WheelSpeeds | Reached | OnBoard


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base. `number`: from 1 on, as messages count them. `note`: for people, in the messages of the step."""

    VERB: ClassVar[str] = ""
    CHANGES: ClassVar[bool] = True
    """True if later steps depend on this one."""
    NEEDS: ClassVar[Feature | None] = None
    """The feature of the machine that the step needs."""
    SUBJECTS: ClassVar[tuple[Kind, ...]] = BOTH
    """The kinds of device that it works with: robots, a single board."""

    number: int = 0
    note: str = ""

    @property
    def needs(self) -> Feature | None:
        """The feature of the machine that the step needs, by all its keys."""
        return self.NEEDS

    @property
    def network(self) -> int:
        """The network of the step: by its key, or by the condition that it waits for."""
        return getattr(self, "network_", None) or 0

    @property
    def subjects(self) -> tuple[Kind, ...]:
        """The kinds of device that it works with, considering all its keys."""
        return self.SUBJECTS

    def problem(self, network: ScenarioNetwork) -> str:
        """Reason why this network of robots does not allow it, as `key: reason; remedy`; "" if it does."""
        return absent(getattr(self, "slot", None), network)

    def problem_alone(self, scenario: BoardScenario) -> str:
        """Reason why the board of a scenario does not allow it, as `key: reason; remedy`; "" if it does."""
        return ""

    def do(self, player: Player) -> None:
        """Executes the step; time passes as far as the step requires."""
        raise NotImplementedError

    @property
    def lasts_ms(self) -> float:
        """Shortest duration of the step in milliseconds."""
        return float(getattr(self, "for_ms", 0.0))

    def in_words(self) -> str:
        """The step in a few words."""
        value = getattr(self, self.VERB, "")
        return f"{self.VERB} {value}" if isinstance(value, str | int) else self.VERB

    def __str__(self) -> str:
        note = f" ({self.note})" if self.note else ""
        return f"step {self.number}{note}: {self.in_words()}"


class OfNetwork(Step, frozen=True, kw_only=True):
    """Base of steps with a `network` key."""

    network_: Network | None = msgspec.field(default=0, name="network")


class OfRobot(OfNetwork, frozen=True, kw_only=True):
    """Base of steps for the robot in `slot` (left out: the network's first)."""

    slot: Slot | None = None


class Send(OfNetwork, frozen=True, kw_only=True, tag_field="send", omit_defaults=True):
    """`send`: the host of `network` sends a frame or characters, once, as soon as the transmitter is free."""

    VERB = "send"

    @property
    def needs(self) -> Feature | None:
        bad_stop = getattr(self, "bad_stop", ()) or "!" in getattr(self, "hex", "")
        return "bad stop" if bad_stop else None

    def in_words(self) -> str:
        return f"send {self.__struct_config__.tag}"


class SendFrame(Send, frozen=True, kw_only=True):
    """Base of frames. `seq`: left out, the next one that is fresh. `wrong_bits`: bits that are sent wrong, counted from
    the first of HDR in the order in which they are sent; `bad_stop`: characters whose stop bit is space, counted from
    the first of the preamble. `slot`: left out, the network's first robot.
    """

    SUBJECTS = ("robot",)

    slot: Slot | None = None
    seq: Annotated[int, Meta(ge=0, lt=SEQ_MODULUS)] | None = None
    wrong_bits: tuple[int, ...] = ()
    bad_stop: tuple[int, ...] = ()

    def problem(self, network: ScenarioNetwork) -> str:
        if self.seq is None and network.host != "silent":
            return 'seq: this network\'s host counts its frames itself; give seq, or write host = "silent"'
        form = DOWNLINK[network.robots]
        first = len(form.lead) + len(form.sync)
        bits = 8 * (form.wire_size - first)
        for bit in self.wrong_bits:
            if not 0 <= bit < bits:
                return f"wrong_bits: bit {bit} is out of range 0..{bits - 1}, the bits from HDR to CRC"
        if sorted({*range(form.wire_size)}.intersection(self.bad_stop)) != [*self.bad_stop]:
            reason = f"bad_stop: {[*self.bad_stop]} are not characters of the frame in their order"
            return f"{reason}; use 0 to {form.wire_size - 1}"
        return beyond(self.slot, network.robots)

    def do(self, player: Player) -> None:
        host, slot = player.hosts[self.network], player.slot(self.slot, self.network)
        frame = self.frame(host, slot, self.next_seq(host, slot) if self.seq is None else self.seq)
        host.put(frame, bad_stop=self.bad_stop, wrong_bits=self.wrong_bits)

    def next_seq(self, host: Host, slot: int) -> int:
        return host.next_seq()

    def frame(self, host: Host, slot: int, seq: int) -> TeamFrame | ServiceFrame:
        """The transmission of `host` to the robot in `slot`, with this number."""
        raise NotImplementedError


class SendTeam(SendFrame, frozen=True, kw_only=True, tag="team"):
    """Velocities. A wheel that is not given keeps its last velocity; at first that is 0.

    `left_m_s`, `right_m_s`: of the robot in `slot`; or `team_m_s`: of all slots. `ask`: a frame of type 3, to which
    robot (seq mod N) answers.
    """

    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    team_m_s: tuple[Pair, ...] | None = None
    ask: bool = False

    def problem(self, network: ScenarioNetwork) -> str:
        if self.team_m_s is not None and len(self.team_m_s) != network.robots:
            pairs = amount(len(self.team_m_s), "pair")
            return f"team_m_s: {pairs} for {network.robots} slots; give one pair [left, right] a slot"
        single_robot = (self.slot, self.left_m_s, self.right_m_s)
        if self.team_m_s is not None and single_robot != (None, None, None):
            return "team_m_s: tells all slots; leave out slot, left_m_s and right_m_s"
        return super().problem(network)

    def frame(self, host: Host, slot: int, seq: int) -> TeamFrame:
        host.command(slot, self.left_m_s, self.right_m_s)
        for slot_of_pair, (left, right) in enumerate(self.team_m_s or ()):
            host.command(slot_of_pair, left, right)
        return host.team(self.ask, seq)


class SendPoll(SendFrame, frozen=True, kw_only=True, tag="poll"):
    """A team frame of type 3 whose number asks the robot in `slot` to answer; all velocities as they were sent last."""

    def problem(self, network: ScenarioNetwork) -> str:
        if None not in (self.seq, self.slot) and self.seq % network.robots != self.slot:  # type: ignore[operator]
            return f"seq: {self.seq} does not ask robot {self.slot}; leave it out"
        return super().problem(network)

    def next_seq(self, host: Host, slot: int) -> int:
        return host.asking_seq(slot)

    def frame(self, host: Host, slot: int, seq: int) -> TeamFrame:
        return host.team(True, seq)


class SendPing(SendFrame, frozen=True, kw_only=True, tag="ping"):
    """A frame that sets nothing, and counts as fresh."""

    def frame(self, host: Host, slot: int, seq: int) -> ServiceFrame:
        return ServiceFrame.ping(seq, slot)


class SendFilter(SendFrame, frozen=True, kw_only=True, tag="filter"):
    """The words of the LM629's filter, for both wheels."""

    kp: FilterWord
    ki: FilterWord
    kd: FilterWord
    il: FilterWord

    def frame(self, host: Host, slot: int, seq: int) -> ServiceFrame:
        return ServiceFrame.filter(seq, slot, self.kp, self.ki, self.kd, self.il)


class SendAcceleration(SendFrame, frozen=True, kw_only=True, tag="acceleration"):
    """The acceleration of both wheels."""

    acceleration_m_s2: Annotated[float, Meta(ge=0.001, le=MOST_ACCELERATION_M_S2)]

    def frame(self, host: Host, slot: int, seq: int) -> ServiceFrame:
        return ServiceFrame(seq, slot, Opcode.ACCELERATION, (acceleration_units(self.acceleration_m_s2),))


def acceleration_units(acceleration_m_s2: float) -> int:
    """1/65536 count per sample squared, rounded: 5973 for 6 m/s^2."""
    counts_per_m = Wheels().units_per_m_s / UNITS_PER_COUNT * (TICKS_PER_SECOND / LM629_SAMPLE_TICKS)
    sample_s = LM629_SAMPLE_TICKS / TICKS_PER_SECOND
    return nearest(65536.0 * counts_per_m * sample_s * sample_s * acceleration_m_s2)


class SendCharacters(Send, frozen=True, kw_only=True):
    """Base of characters as they are. `gap_ms`: between two of them, to a board; left out, none."""

    gap_ms: GapMs | None = None

    def problem(self, network: ScenarioNetwork) -> str:
        if self.gap_ms is not None:
            return "gap_ms: is for a board; a network's host sends without a gap, so make it several steps"
        return self.problem_of_text()

    def problem_alone(self, scenario: BoardScenario) -> str:
        return self.problem_of_text()

    def problem_of_text(self) -> str:
        """Why these are no characters, or the empty string."""
        return ""

    def characters(self) -> tuple[bytes, tuple[int, ...]]:
        """The bytes, and the indices of those with a bad stop bit."""
        raise NotImplementedError

    def do(self, player: Player) -> None:
        data, bad_stop = self.characters()
        machine = player.machine
        if not self.gap_ms:
            machine.inject(data, self.network, bad_stop=bad_stop)
            return
        at_tick = None
        for index in range(len(data)):
            bad = (0,) if index in bad_stop else ()
            tick = machine.inject(data[index : index + 1], self.network, at_tick, bad)
            character_ticks = player.world.lines[self.network].outbox.character_ticks
            at_tick = tick + character_ticks + ms_ticks(self.gap_ms, machine.clock)


class SendBytes(SendCharacters, frozen=True, kw_only=True, tag="bytes"):
    """Characters as they are: pairs of hex digits, a `!` after one whose stop bit is bad (`55 55! ff`)."""

    hex: str

    def problem_of_text(self) -> str:
        words = self.hex.split()
        for word in words:
            if not CHARACTER.fullmatch(word):
                return f"hex: {word[:20]!r} is no character; write two hex digits, and ! for a bad stop bit"
        return "" if words else "hex: there is no character; write two hex digits for each"

    def characters(self) -> tuple[bytes, tuple[int, ...]]:
        words = self.hex.split()
        bad = tuple(at for at, word in enumerate(words) if word.endswith("!"))
        return bytes(int(word[:2], 16) for word in words), bad


class SendText(SendCharacters, frozen=True, kw_only=True, tag="text"):
    """A text in UTF-8, to a board."""

    SUBJECTS = ("board",)

    text: Annotated[str, Meta(min_length=1, max_length=4096)]

    def characters(self) -> tuple[bytes, tuple[int, ...]]:
        return self.text.encode(), ()

    def in_words(self) -> str:
        return f"send text {self.text[:40]!r}"


SENDS: dict[str, type[Send]] = {
    str(struct.__struct_config__.tag): struct
    for struct in (SendTeam, SendPoll, SendPing, SendFilter, SendAcceleration, SendBytes, SendText)
}


class StreamStep(OfRobot, frozen=True, kw_only=True):
    """`stream = "on"`: from now on team frames go out by themselves, as a station's do, with the velocities sent last.

    `every_ms`: left out, a camera period (33.367). `frames`: so many, and then no more. `slot`, `left_m_s`,
    `right_m_s`: velocities that are sent first. `ask`: each asks the robot whose turn it is. `"off"`: no more.
    """

    VERB = "stream"
    SUBJECTS = ("robot",)

    stream: Literal["on", "off"]
    every_ms: PauseMs | None = None
    frames: Annotated[int, Meta(ge=1, le=1_000_000)] | None = None
    left_m_s: SpeedMS | None = None
    right_m_s: SpeedMS | None = None
    ask: bool = True

    @property
    def every_ticks(self) -> int:
        return CONTROL_PERIOD_TICKS if self.every_ms is None else ms_ticks(self.every_ms)

    def problem(self, network: ScenarioNetwork) -> str:
        if self.stream == "off":
            return ""
        if network.host != "silent":
            return 'stream: this network\'s host sends by itself; write host = "silent" for the network'
        shortest_ticks = DOWNLINK[network.robots].wire_size * HOST_CHARACTER_TICKS
        if self.every_ticks < shortest_ticks:
            return f"every_ms: {self.every_ms:g} is too short; a frame takes {in_ms(shortest_ticks)}"
        return beyond(self.slot, network.robots)

    def do(self, player: Player) -> None:
        host = player.hosts[self.network]
        host.end()
        if self.stream == "on":
            host.command(player.slot(self.slot, self.network), self.left_m_s, self.right_m_s)
            host.begin(self.every_ticks, self.frames, self.ask)


class ConditionStep(Step, frozen=True, kw_only=True):
    """Base of steps with a condition: `wait_for`, `expect`, `never`, `hold`, `silence_for_ms`."""

    CHANGES = False

    verb: str
    condition: Awaited

    @property
    def needs(self) -> Feature | None:
        return self.condition.needs

    @property
    def network(self) -> int:
        return self.condition.network

    @property
    def subjects(self) -> tuple[Kind, ...]:
        return self.condition.SUBJECTS

    def in_words(self) -> str:
        return f"{self.verb} {self.condition.what}"

    def problem_alone(self, scenario: BoardScenario) -> str:
        return unknown_source(self.condition, scenario)

    def problem(self, network: ScenarioNetwork) -> str:
        if isinstance(self.condition, OfPin) and (reason := unknown_robot_pin(self.condition.pin)):
            return reason
        return absent(getattr(self.condition, "slot", None), network)


class WaitStep(ConditionStep, frozen=True, kw_only=True):
    """`wait_for`: goes on to the first event that fits. `expect`: the next event of the kind has to fit.

    What happened since the last wait counts, unless `from_now`. `within_ms`, from now on: left out, to the run's end.
    """

    within_ms: WithinMs | None = None
    from_now: bool = False

    def do(self, player: Player) -> None:
        kind = self.condition.any_of_its_kind() if self.verb == "expect" else self.condition
        player.wait_for(self.condition, kind, self.within_ms, self.from_now)


class HoldStep(ConditionStep, frozen=True, kw_only=True):
    """For so long from now on, `never`: no event that fits; `hold`: what is true now stays so."""

    for_ms: PauseMs

    def do(self, player: Player) -> None:
        player.hold(self.condition, self.for_ms, self.verb != "hold")

    def forbidden(self) -> Awaited:
        """The condition that must not become true; that of wheels is none, only a predicate."""
        condition = self.condition
        return condition.opposite() if self.verb == "hold" and isinstance(condition, Followed) else condition


class SilenceStep(HoldStep, frozen=True, kw_only=True):
    """`silence_for_ms`: never a character at the PC."""

    verb: str = "never"
    for_ms: PauseMs = msgspec.field(name="silence_for_ms")


class PauseStep(Step, frozen=True, kw_only=True):
    """`pause_ms`: time passes. What happens meanwhile is there for the next wait."""

    VERB = "pause_ms"

    pause_ms: PauseMs

    @property
    def lasts_ms(self) -> float:
        return self.pause_ms

    def do(self, player: Player) -> None:
        player.pause(self.pause_ms)


class CheckStep(OfRobot, frozen=True, kw_only=True):
    """`check`: checks as in `[expect]`, judged from now on, for the robots of `network`, or for that in `slot`."""

    VERB = "check"
    CHANGES = False
    NEEDS = "inside"

    check: dict[str, Any]
    network_: Network | None = msgspec.field(default=None, name="network")
    checks: tuple[Check, ...] = ()

    def in_words(self) -> str:
        return f"check {', '.join(self.check)}"

    def problem(self, network: ScenarioNetwork) -> str:
        if not self.check:
            return "check: there is no check; give it keys as [expect] has them"
        return super().problem(network)

    def do(self, player: Player) -> None:
        player.begin_checks(self.checks, self.network_, self.slot)


class RadioStep(OfNetwork, frozen=True, kw_only=True):
    """`radio`: of a network: `up`, `down` (no carrier) or `noise` (the receiver gets noise)."""

    VERB = "radio"
    NEEDS = "switch"
    SUBJECTS = ("robot",)

    radio: Literal["up", "down", "noise"]

    def do(self, player: Player) -> None:
        machine = player.machine
        machine.do(RadioState(machine.earliest_action_tick, self.network, self.radio))


class ResetStep(OfRobot, frozen=True, kw_only=True):
    """`reset`: the level of a robot's reset pin; 1 holds its processor in reset."""

    VERB = "reset"
    NEEDS = "switch"

    reset: Literal[0, 1]

    def do(self, player: Player) -> None:
        slot, machine = player.slot(self.slot, self.network), player.machine
        machine.do(Reset(machine.earliest_action_tick, self.network, slot, self.reset))


class PowerStep(OfRobot, frozen=True, kw_only=True):
    """`power`: a robot is switched off, or on."""

    VERB = "power"
    NEEDS = "switch"

    power: Literal["on", "off"]

    def do(self, player: Player) -> None:
        slot, machine = player.slot(self.slot, self.network), player.machine
        machine.do(Power(machine.earliest_action_tick, self.network, slot, int(self.power == "on")))


class FaultStep(OfRobot, frozen=True, kw_only=True):
    """`fault`: hardware breaks, or is mended; of a board RAM, a pin, the supply, RXD. It has to change something."""

    VERB = "fault"
    NEEDS = "switch"

    fault: str

    def problem(self, network: ScenarioNetwork) -> str:
        return self._misspelt() or super().problem(network)

    def problem_alone(self, scenario: BoardScenario) -> str:
        word = self.fault.split()[:1]
        if word == ["rxd"] and scenario.others:
            return "fault: rxd: only the wire from a PC to one board can break"
        if self._misspelt() or word[0] in OF_BOARDS:
            return self._misspelt()
        return f'fault: a board has {", ".join(OF_BOARDS)}; put a value of the part, as eyes.echo = "none"'

    def _misspelt(self) -> str:
        try:
            fault_text(self.fault)
        except ValueError as error:
            return f"fault: {error}"
        return ""

    def do(self, player: Player) -> None:
        slot, machine = player.slot(self.slot, self.network), player.machine
        fault = Fault(machine.earliest_action_tick, self.network, slot, fault_text(self.fault))
        player.break_hardware(fault, f"{self}")


class SaveStep(Step, frozen=True, kw_only=True):
    """`save`: the world's state, as `World.save` gives it, into a file of this name (`NAME.world`)."""

    VERB = "save"
    CHANGES = False
    NEEDS = "save"

    save: str

    def problem(self, network: ScenarioNetwork) -> str:
        if FILE.fullmatch(self.save):
            return ""
        return (
            f"save: {self.save!r} is not the name of a file here; write letters, digits, - and _, then .world"
        )

    def do(self, player: Player) -> None:
        player.saved[self.save] = player.world.save()


class PutStep(Step, frozen=True, kw_only=True):
    """`put`: values of parts of a board, `{ eyes.distance_cm = 60 }`, all on one tick."""

    VERB = "put"
    NEEDS = "switch"
    SUBJECTS = ("board",)

    put: dict[str, Any]

    def in_words(self) -> str:
        return f"put {', '.join(f'{path} = {shown(value)}' for path, value in leaves(self.put))}"

    def problem_alone(self, scenario: BoardScenario) -> str:
        values = list(leaves(self.put))
        if not values:
            return "put: there is no value; write put = { eyes.distance_cm = 60 }"
        for path, value in values:
            try:
                checked_put(scenario.parts, path, value)
            except ValueError as error:
                return f"put: {error}"
        return ""

    def do(self, player: Player) -> None:
        player.put(list(leaves(self.put)))


class PressStep(Step, frozen=True, kw_only=True):
    """`press`: a button of a board is pressed, and let go `for_ms` (100) later; meanwhile the steps go on."""

    VERB = "press"
    NEEDS = "switch"
    SUBJECTS = ("board",)

    press: str
    for_ms: PauseMs = 100.0

    @property
    def lasts_ms(self) -> float:
        return 0.0

    def problem_alone(self, scenario: BoardScenario) -> str:
        try:
            checked_put(scenario.parts, f"{self.press}.pressed", True)
        except ValueError as error:
            return f"press: {error}"
        return ""

    def do(self, player: Player) -> None:
        player.press(self.press, self.for_ms)


PLAIN: dict[str, type[Step]] = {
    struct.VERB: struct
    for struct in (
        *(StreamStep, PauseStep, CheckStep, RadioStep, ResetStep, PowerStep, SaveStep),
        *(PutStep, PressStep, FaultStep),
    )
}
"""Steps whose table contains only their own keys."""
LOOKING: dict[str, type[ConditionStep]] = {
    "wait_for": WaitStep,
    "expect": WaitStep,
    "never": HoldStep,
    "silence_for_ms": SilenceStep,
    "hold": HoldStep,
}
"""Steps whose table also contains the keys of a condition."""
VERBS = ("send", *LOOKING, *PLAIN)


def beyond(slot: int | None, robots: int) -> str:
    """The error of a slot that a network of `robots` robots does not have, or the empty string."""
    if slot is None or slot < robots:
        return ""
    return f"slot: {slot} does not exist on a network of {robots} robots; use 0 to {robots - 1}"


def absent(slot: int | None, network: ScenarioNetwork) -> str:
    """The error of a slot that has no robot on `network`, or the empty string."""
    slots = sorted(robot.slot for robot in network.robot)
    if slot is None or slot in slots:
        return ""
    return f"slot: there is no robot in slot {slot}; there is {', '.join(map(str, slots))}"
