"""`--expect` with a check of a user's own in test, campaign, fuzz and replay, and what settings leave out there."""

import sys

import pytest

from tests.mirotwin import plugins

STILL = "stands_still: net0/robot0: tick "
CAMPAIGN = 'scenario = "fig6"\nseeds = "0-2"\nset = { duration_s = 0.2 }\n'
TEST = 'scenario = "fig6"\nduration_s = 0.2\n'
NO_SUCH = "there is no such check; did you mean stands_still?"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The current folder with a campaign and two tests, and a check of another distribution."""
    plugins.install_all(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "site"))
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    (tmp_path / "a.scenario.toml").write_text(TEST)
    (tmp_path / "b.scenario.toml").write_text(TEST)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("plugged_")]:
        del sys.modules[name]


def test_a_test_is_judged_by_it_and_its_line_repeats_that(mirotwin):
    code, out, err = mirotwin("test", "a.scenario.toml", "--expect", "stands_still")
    assert (code, err) == (1, "")
    assert f"expectation failed: {STILL}" in out
    assert "    mirotwin test a.scenario.toml --expect stands_still" in out.splitlines()
    code, out, _ = mirotwin("test", "a.scenario.toml", "--expect", "frames_accepted_min=1")
    assert (code, out.splitlines()[-1]) == (0, "1 passed")


@pytest.mark.slow
def test_a_campaign_has_a_column_for_it_from_every_process(mirotwin, here):
    from mirotwin import campaign

    command = ("campaign", "run", "c.toml", "--out", "c.parquet", "--jobs", 2)
    code, _, err = mirotwin(*command, "--expect", "stands_still", "--expect", "frames_accepted_min=1")
    assert code == 1
    assert f"failed: runs 0, 1, 2: {STILL}" in err or f"failed: run 0: {STILL}" in err
    rows = campaign.read(here / "c.parquet")[0].to_pylist()
    assert {row["check.stands_still"] for row in rows} == {"failed"}
    assert {row["check.frames_accepted_min"] for row in rows} == {"passed"}


def test_a_campaign_goes_on_with_the_same_expectations_only(mirotwin, here):
    command = ("campaign", "run", "c.toml", "--out", "c.parquet", "--jobs", 1)
    assert mirotwin(*command, "--expect", "frames_accepted_min=1")[0] == 0
    code, out, _ = mirotwin(*command, "--expect", "frames_accepted_min=1")
    assert (code, out) == (0, "c.parquet has all 3 runs already\n")
    for more in ((), ("--expect", "frames_accepted_min=2"), ("--expect", "stands_still")):
        code, _, err = mirotwin(*command, *more)
        assert code == 2
        assert "c.parquet: holds the results of another campaign" in err


@pytest.mark.slow
def test_a_find_of_it_is_a_case_that_replays_to_the_same_failure(mirotwin, here):
    code, out, _ = mirotwin(
        *("fuzz", "--time", "1s", "--jobs", 1, "--minimise", "0.2s", "--out", "out"),
        "--expect",
        "stands_still",
    )
    assert code == 1
    case = next((here / "out" / "crashes").glob("stands_still-*.stream"))
    assert f"    mirotwin replay {case.relative_to(here)}" in out
    code, _, err = mirotwin("replay", case, "-q")
    assert (code, err.startswith(f"mirotwin: fails as recorded: {STILL}")) == (1, True)


@pytest.mark.parametrize(
    "command",
    [("run", "fig6"), ("test", "a.scenario.toml"), ("campaign", "run", "c.toml"), ("fuzz", "--time", "1s")],
)
def test_a_wrong_name_is_told_the_nearest_one_and_a_file_is_refused(mirotwin, command):
    code, out, err = mirotwin(*command, "--expect", "stands_stil")
    assert (code, NO_SUCH in out + err) == (2, True)
    assert "--expect stands_stil" in out + err
    code, _, err = mirotwin(*command, "--expect", "mine.py:stands_still")
    assert code == 2
    assert (
        "--expect mine.py:stands_still: a check in a file is for firmware on a bare processor, and given by --check; "
        in err
    )


NOTE = "leaves out calibration, pattern, centroid, window_px, self_calibration"


def test_what_a_setting_leaves_out_is_told_once_for_all_tests(mirotwin):
    code, _, err = mirotwin("test", ".", "--set", "camera.kind=gaussian")
    assert (code, err) == (0, f"mirotwin: note: --set camera.kind=gaussian {NOTE}\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "more", "place"),
    [
        (CAMPAIGN, ("--set", "camera.kind=gaussian"), "--set camera.kind=gaussian"),
        (
            CAMPAIGN.replace("0.2", '0.2, camera.kind = "gaussian"'),
            (),
            'c.toml: set.camera.kind: camera.kind="gaussian"',
        ),
        (
            f'{CAMPAIGN}[grid]\ncamera.kind = ["pixels", "gaussian"]\n',
            (),
            'c.toml: grid.camera.kind[1]: camera.kind="gaussian"',
        ),
        (
            f'{CAMPAIGN}[factor.eye]\nfar = ["camera.kind=gaussian"]\n',
            (),
            "c.toml: factor.eye.far: camera.kind=gaussian",
        ),
    ],
)
def test_a_campaign_tells_once_what_leaves_keys_out(mirotwin, here, text, more, place):
    (here / "c.toml").write_text(text)
    code, _, err = mirotwin("campaign", "run", "c.toml", "-q", "--jobs", 2, *more)
    assert (code, err) == (0, f"mirotwin: note: {place} {NOTE}\n")


@pytest.mark.parametrize(
    "kind",
    ['camera = { kind = "gaussian" }', '[camera]\nkind = "gaussian"', 'set = { camera.kind = "gaussian" }'],
)
def test_a_file_may_choose_another_kind_in_each_form(mirotwin, here, kind):
    (here / "a.scenario.toml").write_text(f"{TEST}{kind}\n")
    code, out, err = mirotwin("test", "a.scenario.toml")
    note = f'mirotwin: note: set.camera.kind="gaussian" {NOTE}\n' if kind.startswith("set") else ""
    assert (code, out.splitlines()[-1], err) == (0, "1 passed", note)
