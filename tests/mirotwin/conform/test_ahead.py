"""The second process of `mirotwin conform`: the same outcomes in the same order, and nothing of it is left."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from mirotwin.conform import run
from mirotwin.conform.rules import RULES, presupposed_first
from mirotwin.conform.run import FEWEST, Outcome, try_all
from mirotwin.shell import process_pool
from tests import children
from tests.mirotwin.conform.images import FAULTS, HANGS, image_of
from tests.mirotwin.verify.checks.rig import own_image

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="Linux alone forks")
SOME = presupposed_first(RULES[: 2 * FEWEST])


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(process_pool, "cores", lambda: 2)


@pytest.fixture
def trying(monkeypatch):
    """Has rules tried by this function instead of a trial, in this process and in the one that is copied from it."""
    return lambda tried: monkeypatch.setattr(run, "try_rule", lambda rule, *_: tried(rule))


def processes():
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()


@pytest.fixture(autouse=True)
def no_children():
    """No process is left but those that other tests of this one have left, such as a resource tracker."""
    before = processes()
    yield
    assert processes() == before


def by_this_process(rule):
    """An outcome that says which process it is from."""
    return Outcome(rule.id, (), fault_count=os.getpid())


def ahead(rules):
    """Rules in the order in which they were tried -> the process that did it."""
    return {one.rule: one.fault_count for one in try_all(rules, own_image(), ahead=True)}


def test_another_process_tries_every_second_rule(trying):
    trying(by_this_process)
    found = ahead(SOME)
    assert list(found) == [rule.id for rule in SOME]
    first, second = list(found.values())[::2], list(found.values())[1::2]
    assert set(first) == {os.getpid()}
    assert len(set(second)) == 1
    assert second[0] != os.getpid()


@pytest.mark.parametrize("last", [1, 5], ids=["first", "third"])
def test_what_a_killed_process_was_to_try_is_tried_by_the_first(trying, last):
    own = os.getpid()

    def tried_until(rule):
        if os.getpid() != own and rule == SOME[last]:
            os.kill(os.getpid(), signal.SIGKILL)
        return by_this_process(rule)

    trying(tried_until)
    found = ahead(SOME)
    assert list(found) == [rule.id for rule in SOME]
    assert {found[rule.id] for rule in SOME[last:]} == {own}


def test_jobs_are_so_small_that_a_pipe_takes_all_that_wait():
    """Else whoever writes them waits for ever where the process was killed."""
    assert max(len(pickle.dumps((run._try_in_copy, rule))) for rule in RULES) < 4096


@pytest.mark.parametrize("place", [0, 1])
def test_an_error_in_a_trial_is_raised_by_whichever_process_it_came(trying, place):
    def tried(rule):
        if rule == SOME[place]:
            raise ZeroDivisionError(rule.id)
        return by_this_process(rule)

    trying(tried)
    with pytest.raises(ZeroDivisionError, match=SOME[place].id):
        ahead(SOME)


def test_few_rules_need_no_other_process(trying):
    trying(by_this_process)
    assert set(ahead(SOME[: FEWEST - 1]).values()) == {os.getpid()}


def test_nor_does_a_single_core_have_one(trying, monkeypatch):
    trying(by_this_process)
    monkeypatch.setattr(process_pool, "cores", lambda: 1)
    assert set(ahead(SOME).values()) == {os.getpid()}


def test_a_process_with_threads_is_not_copied(trying):
    trying(by_this_process)
    end = threading.Event()
    thread = threading.Thread(target=end.wait)
    thread.start()
    assert set(ahead(SOME).values()) == {os.getpid()}
    end.set()
    thread.join()


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
from mirotwin.shell import process_pool
from mirotwin.shell.firmware_image import load_firmware

process_pool.cores = lambda: 2
def tried(rule, *others):
    if rule != RULES[0]:
        os.write(1, b"%d\\n" % os.getpid())
        time.sleep(1)
    return run.Outcome(rule.id, ())

run.try_rule = tried
list(run.try_all(RULES[:12], load_firmware(), ahead=True))
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
