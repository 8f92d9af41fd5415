"""`mirotwin fuzz --regress`: saved cases, run again as a project's CI does."""

import pytest

from miro_protocol import stream
from tests.mirotwin.verify.checks.rig import needs_sdcc

MISTAKE = "takes frames with a bad CRC"


@needs_sdcc
def test_saved_cases_fail_with_the_mistake_and_pass_without(mirotwin, engines, built, tmp_path):
    image = built(MISTAKE)
    mirotwin("fuzz", image, "--time", "5s", "--minimise", "1s", "-q", "--out", tmp_path / "out")
    cases = tmp_path / "out" / "crashes"
    for other in set(cases.iterdir()) - set(
        cases.glob("moves_only_when_fresh-*")
    ):  # chance finds more than one
        other.unlink()
    names = sorted(cases.glob("*.stream"))
    assert names
    code, out, err = mirotwin("fuzz", image, "--regress", cases)
    assert (code, err) == (1, "")
    lines = out.splitlines()
    assert [line.split(":")[0] for line in lines[:-1]] == [f"FAILED  {name}" for name in names]
    assert lines[0].endswith(stream.read(names[0]).header.verdict)
    assert lines[-1].endswith(f" 0 passed, {len(names)} failed")
    code, out, err = mirotwin("fuzz", "--regress", cases)
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        *(f"passed  {name}" for name in names),
        f"{len(names)} {'case' if len(names) == 1 else 'cases'}: {len(names)} passed, 0 failed",
    ]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda folder: None, "there is no such folder; name the folder with the saved cases"),
        (lambda folder: folder.mkdir(), "holds no case; put the cases of `mirotwin fuzz` there"),
        (lambda folder: (folder.mkdir(), (folder / "a.stream").write_text("x")), "a.stream:1:1: "),
    ],
)
def test_a_folder_without_cases_is_refused(mirotwin, tmp_path, make, said):
    make(tmp_path / "cases")
    code, _, err = mirotwin("fuzz", "--regress", tmp_path / "cases")
    assert code == 2
    assert said in err


def test_a_case_that_cannot_be_read_stops_no_other(mirotwin, tmp_path):
    (tmp_path / "a.stream").write_text("x")
    (tmp_path / "b.stream").write_text("# mirotwin stream 2\n2400000 > 55\n")
    code, out, err = mirotwin("fuzz", "--regress", tmp_path)
    assert code == 2
    assert f"{tmp_path / 'a.stream'}:1:1: " in err
    assert out.splitlines()[-1] == "2 cases: 1 passed, 0 failed, 1 not run"


def test_a_check_that_no_case_names_is_refused(mirotwin, tmp_path):
    (tmp_path / "b.stream").write_text("# mirotwin stream 2\n2400000 > 55\n")
    code, _, err = mirotwin("fuzz", "--regress", tmp_path, "--expect", "mine.py:judge")
    assert code == 2
    assert "no case is judged by --expect mine.py:judge; leave it out" in err


def test_options_of_a_campaign_do_not_go_with_saved_cases(mirotwin, tmp_path):
    code, _, err = mirotwin("fuzz", "--regress", tmp_path, "--time", "5s")
    assert code == 2
    assert "--time does not go with --regress." in err
