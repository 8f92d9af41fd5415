"""`mirotwin conform --port`: the rules that answers can show, on a robot in virtual time."""

import json

import pytest

from mirotwin.conform.by_answers import NOT_OBSERVABLE
from mirotwin.conform.rules import RULES
from mirotwin.desk.robot_port import RobotPort
from tests.mirotwin.desk.rig import ROBOT
from tests.mirotwin.verify.checks.rig import planted
from tests.mutants.sdcc import needs_sdcc

QUICK = "set=camera={kind=%22gaussian%22}"
SEEN = [rule.id for rule in RULES if rule.id not in NOT_OBSERVABLE]


def verdicts(mirotwin, robot, rules, *options):
    code, out, err = mirotwin(
        *("conform", "--json", "-q", "--port", robot, *options),
        *(word for rule in rules for word in ("--rule", rule)),
    )
    found = {case["rule"]: case for case in json.loads(out)["cases"]}
    told = {one["verdict"] for one in found.values()}
    assert code == (1 if "failed" in told else 0 if "passed" in told else 5), err
    return found


@pytest.mark.parametrize("rule", SEEN)
def test_the_shipped_firmware_passes_each_rule_that_answers_show(mirotwin, rule):
    found = verdicts(mirotwin, f"{ROBOT}&{QUICK}", [rule])
    assert (found[rule]["verdict"], found[rule]["lines"]) == ("passed", [])


@pytest.mark.parametrize("rule", ["P41", "P43", "P44", "P45"])
def test_an_adapter_that_keeps_characters_for_16_ms_lets_no_rule_fail(mirotwin, monkeypatch, rule):
    read, kept = RobotPort._read, []

    def late(port, wait_ticks):
        kept.append((port._now + 16 * 24_000, read(port, min(wait_ticks, 24_000))))
        come = [data for due_tick, data in kept if due_tick <= port._now]
        del kept[: len(come)]
        return b"".join(come)

    monkeypatch.setattr(RobotPort, "_read", late)
    assert verdicts(mirotwin, f"{ROBOT}&{QUICK}", [rule])[rule]["verdict"] == "passed"


@pytest.fixture
def two_robots(tmp_path):
    """The port of a network in which robots 0 and 1 answer."""
    scenario = tmp_path / "two.scenario.toml"
    scenario.write_text(
        'name = "two"\nduration_s = 600.0\ncamera.kind = "gaussian"\n'
        '[[network]]\nhost = "silent"\nradio.bit_error_rate = 0.0\n'
        'robot = [{slot = 0, reference = {kind = "line", drive_s = 0.0}},'
        ' {slot = 1, reference = {kind = "line", drive_s = 0.0, start_y_cm = 30.0}}]\n'
    )
    return f"miro://{scenario}"


def test_of_several_robots_at_a_port_one_is_tried_and_named(mirotwin, two_robots):
    rules = ("--rule", "P41", "--rule", "P43", "--rule", "P44", "--rule", "P45")
    code, out, err = mirotwin("conform", "-q", "--port", two_robots, *rules)
    assert (code, out) == (0, "")
    assert err == f"mirotwin: {two_robots}: robots 0 and 1 answer; robot 0 is tried\n"


@needs_sdcc
def test_another_robot_at_the_port_hides_no_mistake(mirotwin, two_robots):
    robots = f"{two_robots}?firmware={planted('answers frames that ask nobody').path}"
    assert verdicts(mirotwin, robots, ["P43"])["P43"]["verdict"] == "failed"


def test_what_answers_do_not_show_is_never_passed(mirotwin):
    found = verdicts(mirotwin, f"{ROBOT}&{QUICK}", NOT_OBSERVABLE)
    assert {one["verdict"] for one in found.values()} == {"not observable"}


def test_verdicts_are_counted(mirotwin):
    code, out, _ = mirotwin("conform", "--port", f"{ROBOT}&{QUICK}", "--rule", "P05", "--rule", "P24")
    assert code == 0
    assert out.splitlines()[-1] == "2 rules: 1 passed, 0 failed, 1 not observable"


def test_where_nobody_answers_both_sizes_of_networks_are_named(mirotwin, monkeypatch):
    monkeypatch.setattr(RobotPort, "_take", lambda port, data: None)
    err = mirotwin.refuses("conform", "--port", ROBOT)
    assert "no robot of a network of 3 or 5 answers: nothing comes" in err


def test_options_of_the_twin_are_refused(mirotwin):
    assert "--seed: is not for a robot at a port" in mirotwin.refuses("conform", "--port", ROBOT, "--seed", 3)


FOUND = {
    "acts on a frame that is repeated": "P20",
    "takes step 0 for fresh": "P17",
    "takes any other step for fresh": "P17",
    "takes frames with a bad CRC": "P07",
    "takes frames of another layout too": "P06",
    "loses sync for good after a bad CRC": "P07",
    "does not count damaged frames": "P49",
    "counts stale frames as accepted": "P17",
    "goes off 100 ms late": "P45",
    "answers frames that ask nobody": "P43",
    "tells what happened again and again": "P45",
}
"""Mistakes that answers show, and the rule that finds them."""


def robot_with(name):
    return f"{ROBOT}&{QUICK}&firmware={planted(name).path}"


@pytest.mark.slow
@needs_sdcc
@pytest.mark.parametrize("name", FOUND)
def test_a_mistake_that_answers_show_is_found(mirotwin, name):
    rule = FOUND[name]
    found = verdicts(mirotwin, robot_with(name), [rule])[rule]
    assert (found["verdict"], bool(found["wanted"])) == ("failed", True)


@needs_sdcc
def test_a_rule_that_presupposes_a_failed_one_is_not_judged(mirotwin):
    found = verdicts(mirotwin, robot_with("takes frames with a bad CRC"), ["P08", "P07"])
    assert found["P07"]["verdict"] == "failed"
    assert (found["P08"]["verdict"], found["P08"]["cause"]) == ("not judged", "P07")


@needs_sdcc
def test_without_noise_in_pauses_the_counters_tell_who_does_not_look_at_spacings(mirotwin):
    robot = f"{robot_with('does not look at spacings')}&set=network.radio.squelch=true"
    assert verdicts(mirotwin, robot, ["P49"])["P49"]["verdict"] == "failed"


@needs_sdcc
def test_what_was_found_before_a_robot_fell_silent_is_told(mirotwin, tmp_path):
    robot = robot_with("loses sync for good after a bad CRC")
    rules = ("--rule", "P05", "--rule", "P07", "--rule", "P16")
    code, out, err = mirotwin("conform", "--port", robot, *rules, "--junit", tmp_path / "j.xml")
    assert (code, "no robot of a network of 3 answers" in err) == (2, True)
    assert out.splitlines()[-1] == "2 rules: 1 passed, 1 failed"
    assert (tmp_path / "j.xml").read_text().count("<testcase") == 2
