"""The state machine finds nothing wrong with the firmware, and finds what was put wrong: as a file to replay.

`python -m tests.mirotwin.testing.explore 2000` goes on as long as one likes.
"""

from collections.abc import Callable

import pytest
from hypothesis import Phase, find, given, settings
from hypothesis import strategies as st
from hypothesis.internal.conjecture import engine
from hypothesis.stateful import run_state_machine_as_test
from intelhex import IntelHex

from miro_protocol import stream
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import TeamFrame
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.radio.params import Radio
from mirotwin.testing.bench import Bench, LinkFailure
from mirotwin.testing.machine import LinkMachine, case_of_bench, link_profiles, seeds
from tests.mirotwin.conftest import mirotwin

__all__ = ["mirotwin"]
UNDEFINED = 0xA5


class Quiet(LinkMachine):
    stream_file = None


TestLink = Quiet.TestCase
TestLink.settings = settings(max_examples=25, stateful_step_count=12, deadline=None)


@settings(deadline=None, max_examples=10)
@given(link_profiles(), seeds(), st.sampled_from([3, 5]))
def test_every_radio_that_is_drawn_can_be_put_on_the_bench(radio, seed, n):
    bench = Bench(n, n - 1, radio, seed)
    for seq in range(3):
        bench.send(TeamFrame(3, seq, ((1, 1),) * n))
    bench.check()


@pytest.mark.parametrize("wanted", ["bit errors", "squelch", "latency", "always on"])
def test_profiles_of_every_kind_are_drawn(wanted):
    def shows(radio: Radio) -> bool:
        return {
            "bit errors": radio.error_threshold > 0,
            "squelch": not radio.squelch,
            "latency": radio.latency_ticks > 0,
            "always on": radio.carrier == "on",
        }[wanted]

    find(link_profiles(), shows, settings=settings(phases=[Phase.generate], database=None))


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """The firmware with an undefined opcode where a poll is answered."""
    path = tmp_path_factory.mktemp("broken") / "broken.ihx"
    original = load_hex(image_path())
    symbol = original.symbols.find("_telemetry_answer")
    assert symbol is not None
    code = IntelHex(str(image_path()))
    code[symbol.address] = UNDEFINED
    code.write_hex_file(str(path))
    for suffix in (".map", ".cdb"):
        path.with_suffix(suffix).write_bytes(image_path().with_suffix(suffix).read_bytes())
    return load_hex(path)


def test_a_planted_fault_is_found_and_shrunk_to_a_stream_file_that_shows_it_again(mirotwin, broken, tmp_path):
    class Planted(LinkMachine):
        image = broken
        profiles = st.just(Radio.ideal())
        stream_file = tmp_path / "failure.stream"

    with pytest.raises(LinkFailure, match=r"undefined opcode A5 .* in _telemetry_answer") as caught:
        run_state_machine_as_test(  # type: ignore[no-untyped-call]
            Planted,
            settings=settings(max_examples=60, stateful_step_count=3, deadline=None, database=None),
        )
    assert any("it fails again by: mirotwin replay" in note for note in caught.value.__notes__)
    sent = stream.read(tmp_path / "failure.stream").transmissions()
    (frame,) = [
        event for one in sent for event in Decoder(3).feed(one.data) if isinstance(event, Received)
    ] or [event for one in sent for event in Decoder(5).feed(one.data) if isinstance(event, Received)]
    assert frame.type == 3  # one poll is left of it all
    code, _, err = mirotwin("replay", tmp_path / "failure.stream", "--firmware", broken.path)
    assert code == 3
    assert "fails as recorded: no_fault" in err
    assert "undefined opcode A5" in err
    own = mirotwin("replay", tmp_path / "failure.stream", "--firmware", image_path())
    assert own[0] == 0
    assert "cured: no_fault passes" in own[1]


def test_a_reset_is_part_of_the_case(broken):
    bench = Bench(3, 1, image=broken)
    bench.send(TeamFrame(0, 4, ((0, 0),) * 3))
    bench.reset()
    with pytest.raises(LinkFailure, match="undefined opcode A5"):
        bench.send(TeamFrame(3, 4, ((0, 0),) * 3))
    case = case_of_bench(bench)
    assert case is not None
    assert "no_fault" in case
    assert [" reset 1\n" in case, " reset 0\n" in case] == [True, True]


def test_shrinking_ends_when_its_time_is_over(broken, tmp_path):
    runs = []

    class Planted(LinkMachine):
        image = broken
        stream_file = None
        shrink_seconds = 0.0

        def _do(self, action: Callable[[], None]) -> None:
            try:
                super()._do(action)
            except LinkFailure:
                runs.append(engine.MAX_SHRINKING_SECONDS)
                raise

    limit = engine.MAX_SHRINKING_SECONDS
    with pytest.raises(LinkFailure):
        run_state_machine_as_test(  # type: ignore[no-untyped-call]
            Planted,
            settings=settings(
                max_examples=20,
                stateful_step_count=8,
                deadline=None,
                database=None,
                report_multiple_bugs=False,
            ),
        )
    assert runs[0] == 0.0
    assert len(runs) <= 4  # the first, once more before shrinking, at its limit, and the one that is shown
    assert limit == engine.MAX_SHRINKING_SECONDS
