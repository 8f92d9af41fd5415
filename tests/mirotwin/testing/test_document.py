"""The page for people who test their own firmware: its examples run as they stand there."""

import re
from pathlib import Path

from hypothesis import settings

from miro_robot.firmware import image_path
from tests.mirotwin.testing.sessions import session

PAGE = Path(__file__).parents[3] / "mirotwin/testing/README.md"
PLUGIN, BENCH, MACHINE = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_examples_of_the_fixtures_pass(tmp_path):
    (tmp_path / "test_mine.py").write_text(PLUGIN)
    done = session(tmp_path)
    assert done.returncode == 0, done.stdout
    assert f"{PLUGIN.count('def test_')} passed" in done.stdout


def test_the_bench_counts_and_hears_answers(capsys):
    exec(BENCH, {})
    counters, answer = capsys.readouterr().out.splitlines()
    assert counters.startswith("(1")
    assert "TelemetryFrame(seq=" in answer


def test_the_state_machine_takes_an_image_of_ones_own():
    names: dict[str, object] = {}
    exec(MACHINE.replace("build/mine.ihx", str(image_path())), names)
    case = names["TestMyFirmware"]
    case.settings = settings(max_examples=2, stateful_step_count=3, deadline=None)  # type: ignore[attr-defined]
    case("runTest").runTest()  # type: ignore[operator]
