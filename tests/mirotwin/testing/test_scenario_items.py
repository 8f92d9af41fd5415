"""pytest collects scenario files: as a user has it, in a session of its own."""

from xml.etree import ElementTree

import pytest

from tests.mirotwin.testing.sessions import session

HEAD = 'scenario = "silent"\nduration_s = 0.3\n'
GOOD = HEAD + 'step = [{ pause_ms = 5 }, { send = "poll" }, { expect = "answer", within_ms = 60 }]\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("session")
    (folder / "pytest.ini").write_text("[pytest]\n")
    (folder / "good.scenario.toml").write_text(GOOD)
    (folder / "late.scenario.toml").write_text(GOOD.replace("60", "20"))
    (folder / "wrong.scenario.toml").write_text(GOOD.replace("within_ms", "within_s"))
    return folder


@pytest.mark.slow
def test_each_file_is_a_test_and_a_failure_is_its_line_without_a_traceback(folder):
    done = session(folder, "-p", "no:xdist", "--junitxml=out.xml")
    assert done.returncode == 1, done.stdout
    assert "2 failed, 1 passed" in done.stdout
    assert (
        "\nstep failed: step 3: expect answer: tick 600000 (25.000 ms): wanted answer within 20 ms, "
        in done.stdout
    )
    assert (
        "\nwrong.scenario.toml: step 3.within_s: unknown key; use within_ms, in milliseconds\n" in done.stdout
    )
    assert "\nagain: mirotwin test late.scenario.toml\n" in done.stdout
    assert "Traceback" not in done.stdout
    assert ".py:" not in done.stdout
    (suite,) = ElementTree.parse(folder / "out.xml").getroot()
    names = {one.get("name") for one in suite.iter("property")}
    assert names == {"mirotwin_seed", "mirotwin_digest", "mirotwin_firmware_sha256", "mirotwin_reproduce"}


@pytest.mark.slow
def test_tests_are_chosen_spread_over_processes_and_begun_again_with_the_last_failed(folder):
    assert "1 passed" in session(folder, "-k", "good", "-n", "1", child=True).stdout
    assert session(folder, "-p", "no:xdist").returncode == 1
    assert "2 failed" in session(folder, "--lf", "-p", "no:xdist").stdout
    assert "good.scenario.toml::good" in session(folder, "-q", "--collect-only", "-p", "no:xdist").stdout
