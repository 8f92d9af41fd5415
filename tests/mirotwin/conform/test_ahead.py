"""The second process of `mirotwin conform`: the same outcomes in the same order, and nothing of it is left."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mirotwin.conform import run
from mirotwin.conform.rules import RULES
from mirotwin.conform.run import FEWEST, Outcome, tried_ahead, try_all
from mirotwin.verify.checks.interface import Failure
from tests import children
from tests.mirotwin.conform.images import FAULTS, HANGS, image_of
from tests.mirotwin.verify.checks.rig import own_image

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="Linux alone forks")
SOME = RULES[: 2 * FEWEST]


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(run, "has_core", lambda: True)


def failing(rule):
    """An outcome that says which process it is from."""
    return Outcome(rule.id, (Failure("conforms_to", os.getpid(), 1, 7, "one", "another"),))


def processes():
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()


@pytest.fixture
def no_children():
    """Says whether there is no process but those that other tests of this one have left, such as a resource tracker."""
    before = processes()

    def check():
        assert processes() == before

    return check


def test_every_second_rule_is_tried_by_another_process_which_is_gone_then(no_children):
    with tried_ahead(SOME, failing) as tried:
        found = [tried(rule) for rule in SOME]
    assert [one.rule for one in found] == [rule.id for rule in SOME]
    processes = [one.failures[0].network for one in found]
    assert set(processes[1::2]) == {os.getpid()}
    assert len(set(processes[::2])) == 1
    assert processes[0] != os.getpid()
    no_children()


def test_rules_may_be_left_out(no_children):
    with tried_ahead(SOME, failing) as tried:
        assert [tried(rule).rule for rule in SOME[5::3]] == [rule.id for rule in SOME[5::3]]
    no_children()


@pytest.mark.parametrize("last", [0, 4], ids=["begins", "has told some"])
def test_what_a_process_does_not_tell_is_tried_by_the_first(last):
    own = os.getpid()

    def tried_until(rule):
        if os.getpid() != own and rule == SOME[last]:
            os.kill(os.getpid(), signal.SIGKILL)
        return failing(rule)

    with tried_ahead(SOME, tried_until) as tried:
        found = [tried(rule) for rule in SOME]
    assert [one.rule for one in found] == [rule.id for rule in SOME]
    assert {one.failures[0].network for one in found[last:]} == {own}


def test_an_error_is_raised_where_the_first_process_meets_it(no_children):
    def error(rule):
        raise ZeroDivisionError(rule.id)

    with pytest.raises(ZeroDivisionError, match=SOME[0].id), tried_ahead(SOME, error) as tried:
        tried(SOME[0])
    no_children()


def test_few_rules_and_a_single_core_need_no_process(monkeypatch):
    with tried_ahead(SOME[: FEWEST - 1], failing) as tried:
        assert tried is failing
    monkeypatch.setattr(run, "has_core", lambda: False)
    with tried_ahead(SOME, failing) as tried:
        assert tried is failing


@pytest.mark.slow
@pytest.mark.parametrize("code", [HANGS, FAULTS, None], ids=["hangs", "faults", "own"])
def test_outcomes_are_those_of_one_process(code):
    image = own_image() if code is None else image_of(code)
    alone = list(try_all(RULES, image, keep=True))
    assert list(try_all(RULES, image, keep=True, ahead=True)) == alone


HOLDS = """
import os, time
from mirotwin.conform import run
from mirotwin.conform.rules import RULES

run.has_core = lambda: True
def tried(rule):
    os.write(1, b"%d\\n" % os.getpid())
    time.sleep(1)

with run.tried_ahead(RULES, tried) as one:
    one(RULES[1])
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_signal_to_the_first_process_leaves_no_other(number):
    with children.start([sys.executable, "-c", HOLDS], stdout=subprocess.PIPE, text=True) as process:
        pids = {int(process.stdout.readline()) for _ in range(2)}
        process.send_signal(number)
        process.wait(30)
    (other,) = pids - {process.pid}
    ends_s = time.monotonic() + 30
    while _runs(other):  # until it has something to tell
        assert time.monotonic() < ends_s
        time.sleep(0.05)


def _runs(process):
    try:
        return ") Z" not in Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return False
