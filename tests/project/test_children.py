"""Programs that tests start have the default action of signals; that tests start them so is a rule of ruff's."""

import os
import signal
import subprocess
import sys

import pytest

from tests import children

SHOW = "import signal; print([signal.getsignal(n) == signal.SIG_IGN for n in (signal.SIGINT, signal.SIGHUP)])"


@pytest.mark.skipif(os.name != "posix", reason="signals that are ignored are inherited on POSIX only")
def test_a_child_has_default_signals_where_the_tests_ignore_them():
    before = [signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)]
    try:
        plain = subprocess.run(  # noqa: TID251
            [sys.executable, "-c", SHOW], capture_output=True, text=True, check=True
        )
        ours = children.run([sys.executable, "-c", SHOW], capture_output=True, text=True, check=True)
        with children.start([sys.executable, "-c", SHOW], stdout=subprocess.PIPE, text=True) as child:
            started = child.communicate()[0]
    finally:
        for number, handler in zip((signal.SIGINT, signal.SIGHUP), before, strict=True):
            signal.signal(number, handler)
    assert plain.stdout == "[True, True]\n"
    assert ours.stdout == started == "[False, False]\n"


@pytest.mark.skipif(os.name != "posix", reason="preexec_fn is of POSIX")
def test_what_a_test_prepares_in_its_child_is_done_too(tmp_path):
    children.run(["true"], check=True, preexec_fn=(tmp_path / "there").touch)
    assert (tmp_path / "there").exists()
