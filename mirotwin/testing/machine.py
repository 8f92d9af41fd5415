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
from typing import ClassVar

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from miro_protocol.frames import ServiceFrame, TeamFrame, asking_step, encode
from miro_protocol.hypothesis_frames import numbers
from miro_protocol.table import ROBOT_COUNTS, SEQ_MODULUS, SERVICE_DATA, VELOCITY, FrameType, Opcode
from miro_robot.image import Image
from miro_sim.radio.params import Radio
from mirotwin.testing import shrinking
from mirotwin.testing.bench import MS, Bench, LinkFailure
from mirotwin.testing.bench_case import case_of_bench
from mirotwin.testing.profiles import link_profiles, seeds
from mirotwin.verify.cases.case import write_case
from mirotwin.verify.cases.replay_line import foreign_path, replay_line

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
            shrinking.no_limit() if shrinking.is_last_run() else shrinking.limit(self.shrink_seconds)
            if self.stream_file is not None:
                failure.add_note(self._leave(self.stream_file, failure))
            raise

    def _leave(self, file: Path, failure: LinkFailure) -> str:
        """Writes what the robot heard; in the end, where a check can judge it, as a case. Returns how to use it."""
        case = None
        if shrinking.is_last_run() and hasattr(self, "bench"):
            case = case_of_bench(self.bench)
        write_case(file, failure.stream if case is None else case)
        image = None if self.image is None else foreign_path(self.image)
        what = "see it with" if case is None else "it fails again by"
        return f"written to {file}; {what}: {replay_line(file, image)}"
