"""A Hypothesis state machine: host and robot over the link, with everything that may go wrong between them.

What must hold: no firmware fault; decoders never raise; firmware and Python count the same frames; a state that
is saved and loaded is the same and goes on the same way; every answer is from the robot asked and counts
what it accepted. A failure carries what the robot heard as a stream file, and leaves it in `stream_file`: Hypothesis
runs the smallest failing example last, so that is what stands in the file, then as a case where a check can judge it.
`mirotwin replay` takes both.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from hypothesis import strategies as st
from hypothesis.control import current_build_context
from hypothesis.internal.conjecture import engine
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from miro_exact.seed import MAX_SEED
from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.frames import ServiceFrame, TeamFrame, asking_step, encode
from miro_protocol.hypothesis_frames import numbers
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, SERVICE_DATA, VELOCITY, FrameType, Opcode
from miro_protocol.transmission import Transmission
from miro_robot.image import Image
from miro_sim.radio.params import Bursts, Dropouts, Radio
from mirotwin.testing.bench import LOOKING_TICKS, MS, Bench, LinkFailure
from mirotwin.verify.cases.case import write_case
from mirotwin.verify.cases.replay_line import foreign_path, replay_line
from mirotwin.verify.cases.rerun import rerun_robot

BIT_ERROR_RATES = (0.0, 1e-4, 1e-3, 1e-2)


def link_profiles() -> st.SearchStrategy[Radio]:
    """Radios from an ideal wire (what shrinking ends at) to a keyed carrier with noise, one wrong bit in 100, bursts,
    drop-outs, false start bits and lost characters; without what leaves the grid of bits (see `Bench`).
    """
    wires = st.just(Radio.ideal())
    radios = st.builds(
        Radio,
        latency_s=st.sampled_from([0.0, 1 / 24e6, 1 / 9600, 0.005]),
        bit_error_rate=st.sampled_from(BIT_ERROR_RATES),
        carrier=st.sampled_from(["on", "keyed"]),
        keyup_s=st.sampled_from([0.001, 0.002]),
        squelch=st.booleans(),
        bursts=st.none() | st.just(Bursts(good_to_bad=1e-3, bad_to_good=1e-2)),
        dropouts=st.none() | st.just(Dropouts(every_s=0.3, length_s=0.02)),
        false_starts_hz=st.sampled_from([0.0, 19.2]),
        lost_character_rate=st.sampled_from([0.0, 0.01]),
    )
    return st.one_of(wires, radios)


def seeds() -> st.SearchStrategy[int]:
    """Of all noise on the air."""
    return st.integers(0, MAX_SEED)


_RESET_TICKS = 48
"""How long the pin is held: two machine cycles are enough (AT89C52 data sheet), these are four."""


def case_of_bench(bench: Bench) -> str | None:
    """The case of what the robot has heard on `bench` since power-on; None where no check fails by it."""
    heard = [entry.what for entry in bench.heard_stream()]
    script: list[ScriptItem] = [sent for sent in heard if isinstance(sent, Transmission)]
    for tick in bench.resets:
        script += [Reset(tick, 0, bench.slot, 1), Reset(tick + _RESET_TICKS, 0, bench.slot, 0)]
    until_tick = bench.now + LOOKING_TICKS
    again = rerun_robot(bench.image, bench.n, bench.slot, script, _expected(bench), until_tick)
    return again.case() if again.failures else None


def _expected(bench: Bench) -> dict[str, Any]:
    expect: dict[str, Any] = {"accepts_only_sent": True, "moves_only_when_fresh": True}
    if bench.freshness.accepted:
        expect["frames_accepted_min"] = bench.freshness.accepted
    return expect


STEPS = st.sampled_from([1, 1, 1, 2, 8, 9, 0, 63])
"""How far the sequence number moves: mostly as a host's does, but also as one that is stuck or restarted."""
TIMES = st.integers(1, 40).map(lambda count: 5 * count * MS)


class LinkMachine(RuleBasedStateMachine):
    """Subclass it to test another firmware: give `image`, and narrow `profiles` if it need not bear all.

    `stream_file`: where a failure leaves what the robot heard; None for nowhere. `shrink_seconds`: how long Hypothesis
    may look for a smaller example of the same failure; what it has by then is what it shows.
    """

    image: ClassVar[Image | None] = None
    profiles: ClassVar[st.SearchStrategy[Radio]] = link_profiles()
    stream_file: ClassVar[Path | None] = Path("link-failure.stream")
    shrink_seconds: ClassVar[float] = 30.0

    bench: Bench
    seq: int

    @initialize(data=st.data(), n=st.sampled_from(ROBOT_COUNTS), seed=seeds())
    def power_on(self, data: st.DataObject, n: int, seed: int) -> None:
        slot = data.draw(st.integers(0, n - 1), label="slot")
        radio = data.draw(self.profiles, label="radio")
        self.seq = 0
        self._do(lambda: self._plug(Bench(n, slot, radio, seed, self.image)))

    def _plug(self, bench: Bench) -> None:
        self.bench = bench

    @rule(data=st.data(), step=STEPS)
    def send_team_frame(self, data: st.DataObject, step: int) -> None:
        self._team(FrameType.TEAM, data, step)

    @rule(data=st.data(), step=STEPS)
    def send_poll(self, data: st.DataObject, step: int) -> None:
        self._team(FrameType.TEAM_ASK, data, step)

    @rule()
    def poll_the_robot(self) -> None:
        """The next number at which it is this robot's turn."""
        step = asking_step(self.seq, self.bench.slot, self.bench.n)
        stopped = ((0, 0),) * self.bench.n
        self._do(lambda: self.bench.send(TeamFrame(FrameType.TEAM_ASK, self._next(step), stopped)))

    @rule(data=st.data(), step=STEPS, opcode=st.sampled_from(Opcode))
    def send_service_frame(self, data: st.DataObject, step: int, opcode: Opcode) -> None:
        slot = data.draw(st.integers(0, self.bench.n - 1), label="slot")
        values = data.draw(st.tuples(*(numbers(field) for field in SERVICE_DATA[opcode])), label="values")
        self._do(lambda: self.bench.send(ServiceFrame(self._next(step), slot, opcode, values)))

    @rule(data=st.binary(min_size=1, max_size=40))
    def send_garbage(self, data: bytes) -> None:
        self._do(lambda: self.bench.send_bytes(data))

    @rule(after=st.integers(0, 30_000).map(lambda some: 24 * some), bits=st.integers(1, 100))
    def burst_of_noise(self, after: int, bits: int) -> None:
        """Falls into the next frame, if one comes in time."""
        self._do(lambda: self.bench.trouble("burst", after, 2500 * bits))

    @rule(after=st.integers(0, 30_000).map(lambda some: 24 * some), length=TIMES)
    def drop_the_link(self, after: int, length: int) -> None:
        self._do(lambda: self.bench.trouble("mark", after, length))

    @rule(length=TIMES)
    def wait(self, length: int) -> None:
        self._do(lambda: self.bench.wait(length))

    @rule()
    def save_and_load(self) -> None:
        self._do(lambda: self._plug(self.bench.reloaded()))

    @rule(seq_step=STEPS, percent=st.integers(0, 100))
    def save_and_load_in_the_middle_of_a_frame(self, seq_step: int, percent: int) -> None:
        stopped = ((0, 0),) * self.bench.n
        wire = encode(TeamFrame(FrameType.TEAM, self._next(seq_step), stopped), self.bench.n)

        def send() -> None:
            begun, end = self.bench.now, self.bench.begin(wire)
            self.bench.run_to(begun + (end - begun) * percent // 100)
            self._plug(self.bench.reloaded())
            self.bench.run_to(end)

        self._do(send)

    @precondition(lambda self: not self.bench.wire.troubles)
    @rule()
    def reset_the_robot(self) -> None:
        self._do(self.bench.reset)

    def _team(self, kind: FrameType, data: st.DataObject, step: int) -> None:
        pair = st.tuples(*(numbers(field) for field in VELOCITY))
        velocities = data.draw(st.tuples(*[pair] * self.bench.n), label="velocities")
        self._do(lambda: self.bench.send(TeamFrame(kind, self._next(step), velocities)))

    def _next(self, step: int) -> int:
        self.seq = (self.seq + step) % SEQ_MODULUS
        return self.seq

    def _do(self, action: Callable[[], None]) -> None:
        try:
            action()
        except LinkFailure as failure:
            no_limit() if is_last_run() else limit(self.shrink_seconds)
            if self.stream_file is not None:
                failure.add_note(self._leave(self.stream_file, failure))
            raise

    def _leave(self, file: Path, failure: LinkFailure) -> str:
        """Writes what the robot heard; in the end, where a check can judge it, as a case. Returns how to use it."""
        case = None
        if is_last_run() and hasattr(self, "bench"):
            case = case_of_bench(self.bench)
        write_case(file, failure.stream if case is None else case)
        image = None if self.image is None else foreign_path(self.image)
        what = "see it with" if case is None else "it fails again by"
        return f"written to {file}; {what}: {replay_line(file, image)}"


_DEFAULT = engine.MAX_SHRINKING_SECONDS


def limit(seconds: float) -> None:
    """From now on, shrinking lasts at most so long."""
    engine.MAX_SHRINKING_SECONDS = seconds  # type: ignore[assignment]


def no_limit() -> None:
    """Hypothesis' own limit again."""
    engine.MAX_SHRINKING_SECONDS = _DEFAULT


def is_last_run() -> bool:
    """Whether Hypothesis runs the example that it will show."""
    return bool(current_build_context().is_final)
