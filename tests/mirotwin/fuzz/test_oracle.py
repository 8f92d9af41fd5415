"""A crash counts once a World says so, and what is left of it gives the verdict again."""

import pytest

from miro_protocol import stream
from miro_robot.harness.fast_oracle import NAMES
from miro_robot.image.debug_info import Sources
from mirotwin.fuzz.files import CampaignFolder
from mirotwin.fuzz.input_coverage import InputCoverage
from mirotwin.fuzz.inputs import seeds
from mirotwin.fuzz.oracle import NEVER_SLEEPS, RobotOracle, expected_of
from mirotwin.fuzz.target import TargetFailure, target_for
from mirotwin.fuzz.triage import Triage
from mirotwin.verify.checks.expect import CHECKS
from tests.mirotwin.verify.checks.rig import needs_sdcc, own_image, planted


def oracle(image):
    return RobotOracle(target_for(image))


def triage_of(image, tmp_path, kind="session"):
    reached = InputCoverage(image, lambda: target_for(image, kind))
    folder = CampaignFolder(tmp_path / "out")
    folder.make()
    return Triage(reached, RobotOracle(target_for(image, kind)), folder, Sources([image.path.parent]))


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
def test_minimising_twice_leaves_the_same_bytes(tmp_path):
    image = planted("takes frames with a bad CRC")
    left = []
    for number in range(2):
        triage = triage_of(image, tmp_path / str(number))
        crash = triage.take(damaged(15))
        left.append(
            (crash, (tmp_path / str(number) / "out" / "crashes" / f"{crash.name}.input").read_bytes())
        )
    assert left[0] == left[1]


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
    target = target_for(image, kind)
    for data in seeds(kind, 3, 0):
        assert (target.run(data), target.failure) == (0, None)
        expected = {name: True for name in NAMES if name}
        assert RobotOracle(target).judged(data, expected).failure is None
