"""`mirotwin test --port` and the pytest fixtures: what a PC can do and see runs, the rest never passes."""

import pytest

from tests.mirotwin.desk.rig import ROBOT, stream_text

pytest_plugins = ["pytester"]
HEAD = """
name = "poll"
duration_s = 1.0
[[network]]
host = "silent"
[[network.robot]]
slot = 0
reference = {kind = "line", drive_s = 0.0}
"""
POLL = """
[[step]]
send = "poll"
[[step]]
wait_for = "answer"
within_ms = 80
accepted = 1
"""
SECOND, WRONG = (POLL.replace("accepted = 1", f"accepted = {count}") for count in (2, 3))
INSIDE = """
[[step]]
send = "ping"
[[step]]
wait_for = "command"
name = "RDRP"
[[step]]
hold = "wheels"
left_m_s = 0.0
for_ms = 20
"""
SWITCH = """
[[step]]
reset = 1
[[step]]
pause_ms = 5
[[step]]
silence_for_ms = 20
"""


UNSEEN = "steps and expectations are not observable on a port"


@pytest.fixture
def at_port(mirotwin, tmp_path):
    def run(steps, *options):
        path = tmp_path / "poll.scenario.toml"
        path.write_text(HEAD + steps)
        return mirotwin("test", path, "--port", ROBOT, *options)

    return run


def test_steps_that_a_pc_can_do_and_see_pass(at_port):
    code, out, err = at_port(POLL)
    assert (code, err) == (0, "")
    assert out.startswith("passed ")
    assert out.endswith("1 passed\n")


def test_an_answer_that_is_not_what_was_wanted_fails(at_port):
    code, out, _ = at_port(WRONG)
    assert code == 1
    assert "step failed: step 2: wait_for answer" in out


def test_waits_inside_the_robot_are_passed_over_and_counted(at_port):
    code, out, _ = at_port(INSIDE + SECOND)
    assert (code, out.splitlines()[-1]) == (0, f"1 passed; 2 {UNSEEN}")
    assert "step 2: wait_for command: not observable on a port: it is inside the robot" in out


def test_a_file_of_which_nothing_can_be_seen_does_not_pass(at_port):
    code, out, _ = at_port(INSIDE)
    assert (code, out.startswith("not observable ")) == (5, True)
    assert "passed" not in out


def test_behind_a_switch_that_no_port_has_nothing_is_judged(at_port):
    code, out, _ = at_port(POLL + SWITCH)
    assert (code, out.splitlines()[-1]) == (0, f"1 passed; 3 {UNSEEN}")
    assert at_port(SWITCH)[1].startswith("not observable ")


def test_expectations_are_counted_as_not_observable(at_port):
    code, out, _ = at_port(POLL + "[expect]\nframes_accepted_min = 1\n")
    assert code == 0
    assert "expectation frames_accepted_min: not observable on a port" in out
    assert "1 step or expectation is not observable" in out


def test_a_step_that_moves_is_refused_unless_it_is_allowed(at_port):
    steps = '[[step]]\nsend = "team"\nleft_m_s = 0.1\n' + POLL
    code, out, _ = at_port(steps)
    assert (code, "--allow-motion" in out) == (2, True)
    assert at_port(steps.replace("accepted = 1", "accepted = 2"), "--allow-motion")[0] == 0


def test_a_controller_needs_more_than_a_port(at_port):
    code, out, _ = at_port("", "--set", 'network.host="controller"')
    said = "    a controller, which needs a camera: not observable on a port"
    assert (code, out.splitlines()[1]) == (5, said)


def test_the_recording_of_a_test_is_compared_with_its_twin(at_port, mirotwin, tmp_path):
    at_port(POLL + SECOND, "--artifacts", tmp_path / "left")
    (folder,) = (tmp_path / "left").iterdir()
    code, out, err = mirotwin("replay", folder)
    assert (code, "the robot answers as its twin does" in out) == (0, True), out + err


def test_a_port_that_is_not_there_leaves_no_folder(mirotwin, tmp_path):
    path = tmp_path / "poll.scenario.toml"
    path.write_text(HEAD + POLL)
    code, out, _ = mirotwin("test", path, "--port", "/dev/nope", "--artifacts", tmp_path / "left")
    said = "    /dev/nope: there is no such port; `python -m serial.tools.list_ports` lists those there are"
    assert (code, out.splitlines()[1]) == (2, said)
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_cannot_be_made_is_told_behind_the_verdict(at_port, tmp_path):
    (tmp_path / "left").touch()
    code, out, _ = at_port(POLL, "--artifacts", tmp_path / "left")
    said = f"nothing could be left in {tmp_path}/left/"
    assert (code, said in out, out.splitlines()[-1]) == (0, True, "1 passed")


def test_the_case_of_an_earlier_failure_is_not_told_of_a_robot(at_port, mirotwin, tmp_path):
    wrong = WRONG
    at_port(wrong, "--artifacts", tmp_path / "left")
    mirotwin("test", tmp_path / "poll.scenario.toml", "--artifacts", tmp_path / "left")
    assert (found := list(tmp_path.glob("left/*/case.stream")))
    code, out, _ = at_port(wrong, "--artifacts", tmp_path / "left")
    assert (code, "case.stream" in out, found[0].exists()) == (1, False, False)


def test_a_seed_is_refused_for_a_robot(at_port):
    said = "mirotwin: error: --seed: is not for a robot at a port; leave it out\n"
    assert at_port(POLL, "--seed", 4) == (2, "", said)


TESTS = """
import pytest
from mirotwin import Telemetry, conditions, ms

def test_answer(link):
    link.poll()
    assert link.expect(Telemetry, within=ms(80)).accepted == 1

def test_silence(link, world):
    link.ping()
    link.expect_silence(ms(50))
    link.poll()
    assert world.run_until(conditions.Answer(slot=0), within=ms(80)).value == 0

def test_inside(robot):
    raise AssertionError

def test_commands(link, world):
    link.ping()
    world.run_until(conditions.Command(name="STT"), within=ms(50))

def test_switch(link):
    link.radio("down")

def test_digest(world):
    assert world.digest == ""

def test_a_name_that_no_machine_has(world):
    assert world.digset == ""

def test_nobody_asks(link):
    link.expect(Telemetry, within=ms(50))

def test_motion(link):
    link.send(velocities={0: (100, 100)})

@pytest.mark.mirotwin(expect={"frames_accepted_min": 1})
def test_expectation(link):
    link.ping()
"""


SAID = """\
mirotwin: robots at miro://*; what a port does not show is skipped
*'RobotPort' object has no attribute 'digset'*
*test_nobody_asks*
*WaitFailed: no answer within 50 ms*
*test_motion*
*--allow-motion*
"""
SKIPPED = """\
*robot: not observable on a port: it is inside the robot*
*command with name = "STT": not observable on a port: it is inside the robot*
*RadioState: not observable on a port: only a twin has such a switch*
*world.digest: not observable on a port: only a twin has it*
"""


@pytest.mark.slow
def test_fixtures_run_at_a_port_and_what_it_does_not_show_is_skipped(pytester):
    pytester.makepyfile(test_desk=TESTS)
    for name, steps in (("poll", POLL), ("inside", INSIDE)):
        (pytester.path / f"{name}.scenario.toml").write_text(HEAD + steps)
    found = pytester.runpytest_subprocess("-rs", "-p", "no:xdist", f"--mirotwin-port={ROBOT}")
    found.assert_outcomes(passed=4, skipped=5, failed=3)
    found.stdout.fnmatch_lines(SAID)
    found.stdout.fnmatch_lines_random(SKIPPED)


def test_a_failed_test_at_a_port_leaves_its_recording_and_its_story(pytester, mirotwin):
    pytester.makepyfile(
        test_desk="from mirotwin import Telemetry, ms\n"
        "def test_answer(link):\n    link.poll()\n    link.expect(Telemetry, within=ms(80), accepted=9)\n"
    )
    found = pytester.runpytest_inprocess(
        "-p", "no:xdist", f"--mirotwin-port={ROBOT}", "--mirotwin-max-speed=0.1", "--mirotwin-artifacts=left"
    )
    found.assert_outcomes(failed=1)
    (folder,) = (pytester.path / "left").iterdir()
    lines = (folder / "report.txt").read_text().splitlines()
    assert lines[1] == f"robots at {ROBOT}"
    assert any("net0/pc: answer telemetry" in line for line in lines)
    again = f"pytest test_desk.py::test_answer --mirotwin-seed 0 --mirotwin-port '{ROBOT}' --mirotwin-max-speed 0.1"
    assert lines[-3:] == [
        f"  {again}",
        f"  mirotwin replay left/{folder.name}",
        f"page: mirotwin report left/{folder.name}",
    ]
    code, out, _ = mirotwin("replay", folder)
    assert (code, "the robot answers as its twin does" in out) == (0, True)


def test_a_port_that_is_not_there_is_told_once_for_each_test(pytester):
    pytester.makepyfile("def test_answer(link): link.poll()")
    found = pytester.runpytest_inprocess("-p", "no:xdist", "--mirotwin-port=/dev/nope")
    found.assert_outcomes(errors=1)
    found.stdout.no_fnmatch_line("*another exception occurred*")
    assert sum(line.startswith("/dev/nope: there is no such port") for line in found.outlines) == 1


@pytest.mark.parametrize("command", ["replay", "test", "conform"])
def test_a_port_without_a_name_does_not_mean_the_twin(mirotwin, pytester, command):
    assert "'--port': the path is empty" in mirotwin.refuses(command, "some.file", "--port", "")
    found = pytester.runpytest_inprocess("--mirotwin-port=")
    found.stderr.fnmatch_lines(["ERROR: --mirotwin-port: is empty; name the port of the robots*"])


@pytest.mark.parametrize("workers", ["2", "auto"])
def test_a_port_is_not_shared_by_workers_of_xdist(pytester, monkeypatch, workers):
    monkeypatch.setenv("PYTEST_XDIST_AUTO_NUM_WORKERS", "2")
    found = pytester.runpytest_inprocess("-p", "xdist", "-n", workers, f"--mirotwin-port={ROBOT}")
    assert found.ret == pytest.ExitCode.USAGE_ERROR
    found.stderr.fnmatch_lines(["ERROR: --mirotwin-port: 2 workers cannot share one port; give -n 0"])


def test_a_case_is_refused_before_anything_is_sent(mirotwin, at_port, tmp_path):
    at_port(POLL)
    body = stream_text(1).partition("\n")[2]
    (tmp_path / "old.stream").write_text(f"# mirotwin stream 2\n#: expect.no_fault = true\n{body}")
    said = mirotwin.refuses("test", tmp_path, "--port", ROBOT)
    why = "a case is judged by what is inside the twin, which no port shows"
    assert said == f"{tmp_path}/old.stream: --port: {why}; leave it out, or send it with `mirotwin replay`"
    code, out, _ = mirotwin("test", tmp_path, "-k", "scenario", "--port", ROBOT)
    assert (code, out.splitlines()[-1]) == (0, "1 passed")


def test_the_page_of_a_failure_shows_the_robot_beside_its_twin(at_port, tmp_path):
    wrong = WRONG
    code, out, _ = at_port(wrong, "--artifacts", tmp_path / "left", "--pages")
    (page,) = (tmp_path / "left").rglob("report.html")
    assert (code, f"    left in {page.parent}" in out.splitlines()) == (1, True)
    assert "Robot 0 and its twin" in page.read_text()
