"""The progress bar: only for people, and only when there is something to wait for."""

import io
import sys

import pytest

from mirotwin.shell import progress
from mirotwin.shell.progress import ProgressBar


class Screen(io.StringIO):
    def isatty(self):
        return True


def drawn(monkeypatch, screen, patience_s, quiet=False):
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", patience_s)
    with ProgressBar("simulating", 10, quiet) as bar:
        for done in range(10):
            bar.to(done)
    return screen.getvalue()


def test_a_bar_is_drawn_on_a_terminal_after_a_while(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    assert "simulating" in drawn(monkeypatch, Screen(), 0.0)


@pytest.mark.parametrize(
    ("screen", "patience_s", "quiet"),
    [(Screen(), 60.0, False), (io.StringIO(), 0.0, False), (Screen(), 0.0, True)],
    ids=["soon over", "no terminal", "quiet"],
)
def test_otherwise_nothing_is_drawn(monkeypatch, screen, patience_s, quiet):
    assert drawn(monkeypatch, screen, patience_s, quiet) == ""


def test_what_is_counted_is_shown_with_its_rate_and_the_time_left(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    monkeypatch.setattr(ProgressBar, "PATIENCE_S", 0.0)
    now_s = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s[0])
    with ProgressBar("noise.toml", 1000, unit="runs", begun=200) as bar:
        now_s[0] += 10.0
        bar.to(240)
    assert "4.0 runs/s, 0:03:10 left" in screen.getvalue()
