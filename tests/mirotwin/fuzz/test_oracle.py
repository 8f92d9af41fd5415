"""A crash counts once a World says so, is told apart by its path, made small, and left as a case."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol import stream
from miro_robot.harness.fast_oracle import NAMES
from miro_robot.image.debug_info import Sources
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.inputs import input_of, seeds, sent, talks
from mirotwin.fuzz.oracle import NEVER_SLEEPS, RobotOracle, expected_of
from mirotwin.fuzz.target import RobotTarget, TargetFailure
from mirotwin.fuzz.triage import Triage, minimise
from mirotwin.verify.checks.expect import CHECKS
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image, planted


def oracle(image):
    return RobotOracle(RobotTarget(image))


def triage_of(image, tmp_path, kind="session"):
    reached = InputCoverage(image, lambda: RobotTarget(image, kind))
    folder = CampaignFolder(tmp_path / "out")
    return Triage(reached, RobotOracle(RobotTarget(image, kind)), folder, Sources([image.path.parent]))


def test_each_name_of_the_quick_judgement_is_a_check():
    assert set(filter(None, NAMES)) <= set(CHECKS.names())
    assert expected_of(NEVER_SLEEPS) == {"acts_within_ms": True}


def test_what_shipped_firmware_does_right_is_not_confirmed(tmp_path):
    triage = triage_of(own_image(), tmp_path)
    for check in ("no_fault", "acts_within_ms", NEVER_SLEEPS):
        said = TargetFailure(check, 900_000, 0, "said")
        assert triage.oracle.confirm(seeds("session", 3, 0)[0], said).failure is None


def test_an_input_that_does_not_fail_again_is_counted_and_left_out(tmp_path):
    triage = triage_of(own_image(), tmp_path)
    assert triage.take(seeds("session", 3, 0)[0]) is None
    assert (triage.found, triage.unrepeated) == ([], 1)


def damaged(place=14):
    """A frame with one wrong character, in the middle of good ones."""
    good, bad = bytes([6, 0, 2, *bytes(10)]), bytes([12, place, 0xFF, 6, *bytes(12)])
    return good + bad + good


@needs_sdcc
def test_a_find_is_minimised_confirmed_and_left_as_a_case_that_replays(tmp_path, mirotwin):
    image = planted("takes frames with a bad CRC")
    triage = triage_of(image, tmp_path)
    data = damaged()
    assert triage.target.run(data)
    crash = triage.take(data)
    assert crash.confirmed
    assert crash.sizes[0] == len(data) > crash.sizes[1]
    left = {path.name for path in (tmp_path / "out" / "crashes").iterdir()}
    assert left == {f"{crash.name}.{suffix}" for suffix in ("stream", "input", "txt", "info")}
    case = tmp_path / "out" / "crashes" / f"{crash.name}.stream"
    assert stream.read(case).header.verdict == crash.verdict
    code, _, err = mirotwin("replay", case, "--firmware", image.path)
    assert (code, err) == (1, f"mirotwin: fails as recorded: {crash.verdict}\n")
    code, out, _ = mirotwin("replay", case, "--firmware", own_image().path)
    assert out.startswith("cured: ") or code == 1


@needs_sdcc
def test_many_inputs_of_one_mistake_come_down_to_few_finds(tmp_path):
    triage = triage_of(planted("takes frames with a bad CRC"), tmp_path)
    failing = [damaged(place) + bytes(extra) for place in range(9, 22) for extra in range(3)]
    failing = [data for data in failing if triage.target.run(data)]
    assert len(failing) > 20
    for data in failing:
        triage.take(data)
    assert 1 <= len(triage.found) <= 3
    assert len(triage.found) + triage.more.total() == len(failing)


@needs_sdcc
def test_what_a_world_does_not_find_wrong_is_kept_apart(tmp_path, monkeypatch):
    triage = triage_of(planted("takes frames with a bad CRC"), tmp_path)
    monkeypatch.setattr(triage, "oracle", oracle(own_image()))  # there the same input does no harm
    crash = triage.take(damaged())
    assert not crash.confirmed
    assert triage.unconfirmed == [crash]
    kept = tmp_path / "out" / "unconfirmed" / f"{crash.name}.stream"
    assert stream.read(kept).header.verdict is None
    assert not (tmp_path / "out" / "crashes").exists()


@needs_sdcc
def test_an_input_that_a_world_finds_wrong_takes_the_place_of_one_that_it_did_not(tmp_path, monkeypatch):
    triage = triage_of(planted("takes frames with a bad CRC"), tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(triage, "oracle", oracle(own_image()))
        triage.take(damaged())
    crash = triage.take(damaged())
    assert crash.confirmed
    assert (triage.found, triage.more[crash.name]) == ([crash], 1)
    assert not list((tmp_path / "out" / "unconfirmed").iterdir())
    assert len(list((tmp_path / "out" / "crashes").iterdir())) == 4


def test_a_find_of_a_check_in_python_is_made_small_in_worlds(tmp_path):
    triage = triage_of(own_image(), tmp_path)
    expected = {"wheels_within_m_s": {"limit_m_s": 0.1, "overshoot_m_s": 0.0}}
    data = bytes([6, 0, 64, 0, 64, *bytes(8), 6, 0, 64, 0, 64, *bytes(8)])
    failure = triage.oracle.judged(data, expected).failure
    assert failure is not None
    crash = triage.take_judged(data, failure, expected)
    assert crash.confirmed
    assert crash.check == "wheels_within_m_s"
    assert crash.sizes[1] < len(data)


@pytest.mark.parametrize("kind", ["bytes", "frames", "session"])
def test_seeds_do_no_harm_in_target_and_world(kind):
    image = own_image()
    target = RobotTarget(image, kind)
    for data in seeds(kind, 3, 0):
        assert (target.run(data), target.failure) == (0, None)
        expected = {name: True for name in NAMES if name}
        assert RobotOracle(target).judged(data, expected).failure is None


# What inputs reach


def coverage():
    image = own_image()
    return InputCoverage(image, lambda: RobotTarget(image))


def of_talk(number):
    return input_of("session", sent(talks(3, 0)[number], 3), 3)


def test_what_runs_while_the_firmware_starts_counts_in_the_total():
    reached = coverage()
    assert reached.names.functions
    assert "_main" in map(reached.function, reached.total)
    before = set(reached.total)
    reached.run(of_talk(0))
    assert before < set(reached.total)


def test_the_counts_of_an_input_do_not_depend_on_the_inputs_before():
    reached = coverage()
    alone = reached.run(of_talk(0))
    for data in seeds("session", 3, 0):
        reached.run(data)
    assert reached.run(of_talk(0)) == alone


def test_the_counters_see_what_the_fast_run_does():
    reached = coverage()
    fast = RobotTarget(own_image())
    for data in seeds("session", 3, 0):
        reached.run(data)
        fast.run(data)
        both = [[cpu.peek_iram(at) for at in range(256)] for cpu in (fast.cpu, reached.target.cpu)]
        assert both[0] == both[1]
        assert fast.cpu.cycles == reached.target.cpu.cycles


# Inputs are made small, in the same way each time


def small(data, still, tries=100_000):
    return minimise(data, still, tries, 60.0)


def test_what_does_not_matter_goes_away_and_the_rest_becomes_zero():
    data = bytes(range(1, 200))
    assert small(data, lambda one: 77 in one and one.index(77) >= 3) == bytes([0, 0, 0, 77])


def test_bytes_that_belong_together_stay_together():
    data = b"....A....B........"
    assert small(data, lambda one: b"A" in one and b"B" in one[one.index(b"A") :]) == b"AB"


@given(st.binary(max_size=60), st.binary(min_size=1, max_size=3))
def test_the_result_still_does_it_and_has_no_byte_that_could_be_left_out(data, needle):
    whole = data + needle + data

    def still(one):
        return needle in one

    found = small(whole, still)
    assert found == needle
    assert small(found, still) == found


@given(st.binary(max_size=80))
def test_the_same_input_is_tried_in_the_same_order(data):
    def asked(one, log):
        log.append(one)
        return sum(one) % 7 == 3

    logs = [[], []]
    results = [small(data, lambda one, log=log: asked(one, log)) for log in logs]
    assert results[0] == results[1]
    assert logs[0] == logs[1]


def test_an_input_that_does_not_do_it_comes_back_as_it_was():
    assert small(b"abc", lambda one: False) == b"abc"


def test_a_search_ends_with_its_tries():
    tried = []
    minimise(bytes(range(256)), lambda one: tried.append(one) or len(one) == 256, 10, 60.0)
    assert len(tried) == 10


def test_a_search_ends_with_its_time():
    began_s = time.monotonic()
    minimise(bytes(4000), lambda one: time.sleep(0.01) or len(one) == 4000, 10**9, 0.2)
    assert time.monotonic() - began_s < 5.0
