"""Where a project gets Mirotwin from: by PEP 610, or as the user says; never by a mere name."""

import json
from email.message import Message
from importlib import metadata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packaging.requirements import Requirement

from miro_exact.bad_input import BadInput
from mirotwin.testing import origin

COMMIT = "7921be1537eac1e97bc40179a57f0349c2aee67d"


class Installed:
    """A distribution with this `direct_url.json`, and in its metadata this address of the repository."""

    version = "0.3.0"

    def __init__(self, text, repository=origin.PLACEHOLDER):
        self.text = text
        self.metadata = Message()
        self.metadata["Project-URL"] = f"Repository, {repository}"

    def read_text(self, name):
        return self.text if name == "direct_url.json" else None


@pytest.fixture
def installed(monkeypatch, tmp_path):
    def line(text):
        text = text if text is None or isinstance(text, str) else json.dumps(text)
        monkeypatch.setattr(metadata, "distribution", lambda name: Installed(text))
        return origin.installed(tmp_path / "mine")

    return line


def git(**more):
    return {"url": "https://example.org/a.git", "vcs_info": {"vcs": "git", "commit_id": COMMIT, **more}}


@pytest.mark.parametrize(
    ("found", "address"),
    [
        (git(), f"git+https://example.org/a.git@{COMMIT}"),
        (git(requested_revision="main"), f"git+https://example.org/a.git@{COMMIT}"),
        ({**git(), "subdirectory": "b"}, f"git+https://example.org/a.git@{COMMIT}#subdirectory=b"),
        ({**git(), "url": "ssh://git@example.org/a"}, f"git+ssh://git@example.org/a@{COMMIT}"),
        ({"url": "https://example.org/a.whl", "archive_info": {}}, "https://example.org/a.whl"),
    ],
)
def test_an_address_is_that_of_the_commit_or_archive(installed, found, address):
    assert installed(found) == f"mirotwin[report] @ {address}"
    assert Requirement(installed(found)).url == address


@pytest.mark.parametrize(
    "about", [{"dir_info": {"editable": True}}, {"dir_info": {}}, {"archive_info": {"hash": ""}}]
)
def test_a_path_is_that_of_the_checkout_or_wheel(installed, tmp_path, about):
    place = tmp_path / "my r\u00f6bot.whl"
    place.write_text("")
    found = installed({"url": place.as_uri(), **about})
    assert found == f"mirotwin[report] @ {place.as_uri()}"
    assert " " not in Requirement(found).url


@pytest.mark.parametrize(
    "text",
    [
        None,
        "",
        "{",
        "[]",
        "{}",
        '{"url": 1}',
        '{"url": ""}',
        '{"url": "https://a/b\\nmirotwin"}',
        '{"url": "file:///no/such"}',
    ],
)
def test_what_an_index_gave_what_is_gone_and_what_cannot_be_read_are_not_known(installed, text):
    assert installed(text) is None


def test_a_release_from_an_index_is_its_tag_in_the_repository(monkeypatch, tmp_path):
    found = Installed(None, "https://example.org/a/mirotwin")
    monkeypatch.setattr(metadata, "distribution", lambda name: found)
    line = origin.installed(tmp_path)
    assert line == "mirotwin[report] @ git+https://example.org/a/mirotwin@v0.3.0"


def test_a_tree_that_is_not_installed_is_not_known(monkeypatch, tmp_path):
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "distribution", missing)
    assert origin.installed(tmp_path) is None


def test_a_wheel_within_the_project_is_relative_to_it(tmp_path, monkeypatch):
    wheel = tmp_path / "mine" / "wheels" / "mirotwin-0.3.0-py3-none-any.whl"
    wheel.parent.mkdir(parents=True)
    wheel.write_text("")
    monkeypatch.chdir(tmp_path)
    line = origin.given("mine/wheels/mirotwin-0.3.0-py3-none-any.whl", tmp_path / "mine")
    assert line == "./wheels/mirotwin-0.3.0-py3-none-any.whl[report]"


def test_a_checkout_beside_the_project_is_relative_to_it_and_one_elsewhere_is_not(tmp_path):
    for name in ("mirotwin", "other/mirotwin"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "pyproject.toml").write_text("")
    assert origin.given(f"{tmp_path / 'mirotwin'}", tmp_path / "mine") == "../mirotwin[report]"
    elsewhere = tmp_path / "other" / "mirotwin"
    assert origin.given(f"{elsewhere}", tmp_path / "mine") == f"mirotwin[report] @ {elsewhere.as_uri()}"


def test_a_checkout_is_a_source_and_any_other_folder_is_none(tmp_path):
    with pytest.raises(BadInput, match="--from: is no wheel, no source archive and no checkout; give git"):
        origin.given(str(tmp_path), tmp_path / "mine")
    (tmp_path / "pyproject.toml").write_text("")
    assert origin.given(str(tmp_path), tmp_path / "mine") == f"mirotwin[report] @ {tmp_path.as_uri()}"


def test_a_name_that_no_file_can_have_is_refused_like_one_that_no_file_has(tmp_path):
    with pytest.raises(BadInput, match="--from: is no address, and there is no such file or folder"):
        origin.given("a" * 300, tmp_path)


@given(st.text() | st.from_regex(r"(git\\+)?https?://\\S*", fullmatch=True))
def test_whatever_is_given_is_one_line_with_an_address_or_refused(tmp_path_factory, source):
    try:
        line = origin.given(source, tmp_path_factory.getbasetemp() / "mine")
    except BadInput:
        return
    assert line.isprintable()
    assert line.startswith(("mirotwin[report] @ ", "./", "../"))
    assert line.isascii()
