"""Checks in Python for a bare processor: finding them by name, and what they may say."""

import sys

import pytest

from miro_exact.bad_input import BadInput
from mirotwin.verify.bare.exchange import check_named
from tests.host import distribution

SOURCE = """
limit = 3

def quiet(run):
    return None

def loud(run):
    return f"too\\n  {run}"

def odd(run):
    return 5

def broken(run):
    return run.nothing

def leaves(run):
    raise SystemExit(0)
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mycheck.py"
    path.write_text(SOURCE)
    return path


def test_a_function_of_a_file(file):
    found = check_named(f"{file}:loud")
    assert (found.name, found.from_file) == ("loud", True)
    assert found.judge("loud") == "too loud"
    assert check_named(f"{file}:quiet").judge("anything") is None


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("odd", "returned 5 ({file}:10 in odd); return None, or what is wrong as text"),
        ("leaves", "raised SystemExit: 0 ({file}:17 in leaves); repair the check"),
        (
            "broken",
            "raised AttributeError: 'str' object has no attribute 'nothing' ({file}:14 in broken); repair the check",
        ),
    ],
)
def test_a_check_that_fails_itself_says_where(file, name, said):
    with pytest.raises(BadInput) as caught:
        check_named(f"{file}:{name}").judge("text")
    assert str(caught.value).endswith(said.format(file=file))
    assert f"--check {file}:{name}" in str(caught.value)


def test_what_is_no_check_is_refused(file, tmp_path):
    for text, said in (
        (f"{file}:nothing", "there is no function 'nothing'; it has quiet, loud, odd, broken"),
        (f"{file}:limit", "there is no function 'limit'"),
        (f"{tmp_path}/none.py:f", "there is no such file"),
        ("nothing", "there is no check 'nothing' for a bare processor; give FILE.py:FUNCTION"),
    ):
        with pytest.raises(BadInput) as caught:
            check_named(text)
        assert said in str(caught.value)
    file.write_text("raise RuntimeError('no')")
    with pytest.raises(BadInput, match=r"cannot be run: RuntimeError: no \(.*mycheck.py:1\); repair it"):
        check_named(f"{file}:quiet")


def test_a_distribution_may_bring_one(tmp_path, monkeypatch):
    parts = {
        "always_wrong": "their_check:wrong",
        "no_function": "their_check:text",
        "absent": "their_check:absent",
    }
    source = "text = 'x'\n\ndef wrong(run):\n    return 'wrong'\n"
    distribution.install(tmp_path, "theirs", "1.0", parts, "bare_checks", their_check=source)
    monkeypatch.syspath_prepend(tmp_path)
    found = check_named("always_wrong")
    assert (found.judge(None), found.from_file, found.name) == ("wrong", False, "always_wrong")
    with pytest.raises(BadInput, match="is no function"):
        check_named("no_function")
    with pytest.raises(BadInput, match="cannot be imported: AttributeError"):
        check_named("absent")
    sys.modules.pop("their_check")
