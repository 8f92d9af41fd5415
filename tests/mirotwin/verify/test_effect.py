"""A fault that changed something is told from one that did not, whatever else goes into the run."""

import msgspec
import pytest

from miro_exact.clock import ms
from miro_protocol.actions import Fault
from miro_sim.scenario.file import load
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.verify.effect import Proof
from mirotwin.verify.steps.reading import steps_of
from tests.mirotwin.verify.checks.rig import own_image
from tests.mirotwin.verify.steps.rig import ORIGIN, scenario_of

DRIVES = '{ pause_ms = 100 }, { stream = "on", left_m_s = 0.5, right_m_s = 0.5 }, { pause_ms = 190.3 }'
QUIET = '{ radio = "down" }, { pause_ms = 40 }'
GOES_ON = (
    '{ pause_ms = 33 }, { send = "poll", slot = 0 }, { power = "off" }, { pause_ms = 50 }, { power = "on" }'
)


def result(steps, **changes):
    scenario = msgspec.structs.replace(scenario_of(steps), **changes)
    spec = RunSpec(scenario=scenario, image=own_image(), steps=steps_of(scenario, ORIGIN), origin=ORIGIN)
    return Run.traced(spec).play().result()


@pytest.mark.parametrize(
    "what",
    [
        *("encoder left lost", "lm629 right busy", "rxd 0", "power dip", "flip FFh.0", "encoder left ok"),
        *("motor left open", "wheel right blocked", "pin P0.0 0", "pin P3.3 0"),
    ],
)
def test_a_fault_that_changes_something_leaves_the_verdict_to_the_checks(what):
    found = result(f'{DRIVES}, {{ fault = "{what}" }}, {GOES_ON}')
    assert not any(verdict == "not judged" for verdict, _ in found.verdict_lines)


@pytest.mark.parametrize(
    ("before", "what"),
    [
        (DRIVES + ", " + QUIET, "rxd 1"),
        ("{ pause_ms = 100 }", "encoder right a1"),
        ("{ pause_ms = 100 }", "motor left open"),
        ("{ pause_ms = 100 }", "wheel left blocked"),
        (DRIVES + ", " + QUIET, "pin P1.0 0"),  # the slot, which is read once
        (DRIVES + ", " + QUIET, "pin P1.7 0"),  # which is wired to nothing
        (DRIVES + ", " + QUIET, "pin P3.4 0"),  # T0, which counts nothing
        (DRIVES + ", " + QUIET, "pin P3.7 0"),
    ],
)
def test_one_that_changes_nothing_is_not_judged_among_all_that_goes_in(before, what):
    found = result(
        f'{before}, {{ fault = "{what}" }}, {{ fault = "{what.rsplit(" ", 1)[0]} ok" }}, {GOES_ON}'
    )
    number = before.count("{ ") + 1
    line = f"step {number}: fault {what}: the fault changed nothing up to the end of the run"
    assert (found.verdict, found.texts, found.code) == ("not judged", (line,), 1)


def test_hosts_that_compute_say_the_same_to_the_twin():
    """The radio is off for a moment, in which the wire to RXD is at the level that it has anyway."""
    scenario = load(
        "fig6", ["duration_s=1.0", "camera={kind = 'gaussian'}", "network.radio.squelch=true"]
    ).scenario
    spec = RunSpec(scenario=scenario, image=own_image(), seed=3)
    for state, missing in (("down", True), ("up", False)):
        world = spec.world()
        world.run_to(ms(333) + 77)
        world.set_radio(state)
        world.run_to(ms(350))
        world.inject(b"U" * 5)
        proofs = []
        fault = Fault(world.earliest_action_tick, 0, 0, "rxd 1")
        Proof.begin(proofs, world, "it", fault)
        world.do(fault)
        world.do(Fault(ms(400), 0, 0, "rxd ok"))
        world.run_to(ms(420))
        world.set_radio("up")
        world.inject(b"U" * 3)
        world.run_to(ms(1000))
        assert bool(proofs[0].missing(spec.world)) == missing, state


def test_a_fault_that_comes_after_the_end_is_not_judged():
    world = (spec := RunSpec(scenario=scenario_of(""), image=own_image())).world()
    fault = Fault(ms(2000), 0, 0, "rxd 1")
    proof = Proof(world, "it", fault)
    world.do(fault)
    world.run_to(ms(100))
    assert proof.missing(spec.world) == "it: the run ended before the fault"


@pytest.mark.parametrize(
    "what",
    [
        *("encoder left lost", "lm629 left busy", "rxd 0"),
        *("motor right open", "wheel left blocked", "pin P2.0 0", "pin P2.4 1"),
    ],
)
def test_a_robot_that_is_broken_need_not_act(what):
    assert result(f'{DRIVES}, {{ fault = "{what}" }}, {{ pause_ms = 400 }}').failures == []
