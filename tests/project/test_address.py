"""The address of the repository is set in one place, and README, CITATION, site and metadata have that one."""

import re
import shutil
from types import SimpleNamespace

import pytest
import yaml

from docs.site import address, release
from mirotwin.testing.origin import PLACEHOLDER

ADDRESS = "https://example.org/somebody/mirotwin"


@pytest.fixture
def tree(tmp_path):
    """The files with the address, before it is set."""
    for name in address.FILES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(address.ROOT / name, tmp_path / name)
    address.write(PLACEHOLDER, tmp_path)
    return tmp_path


def test_front_pages_and_citation_have_the_address_of_the_setting_and_no_other():
    pages = [(address.ROOT / name).read_text("utf-8") for name in ("README.md", "docs/index.md")]
    citation = yaml.safe_load((address.ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["repository-code"] == address.setting()
    for page in pages:
        assert re.findall(r"git clone (\S+)", page) == [address.setting()]
    others = {*re.findall(r"https?://[^\s)`\"]+", "".join(pages))} - {address.setting()}
    assert others == {"https://doi.org/10.1109/70.768190"}


def test_one_command_writes_it_everywhere_and_changes_nothing_else(tree):
    before = {name: (tree / name).read_text("utf-8") for name in address.FILES}
    address.write(ADDRESS, tree)
    assert address.setting(tree) == address.known(tree) == ADDRESS
    for name, text in before.items():
        assert (tree / name).read_text("utf-8") == text.replace(PLACEHOLDER, ADDRESS) != text
    address.write(PLACEHOLDER, tree)
    assert {name: (tree / name).read_text("utf-8") for name in address.FILES} == before
    assert address.known(tree) == ""


@pytest.mark.parametrize("wrong", ["", "mirotwin", "https://example.org", "http://a/b", 'https://a/b"c'])
def test_what_is_no_address_is_refused_and_writes_nothing(tree, wrong):
    with pytest.raises(ValueError, match="is no address of a repository"):
        address.write(wrong, tree)
    assert address.setting(tree) == PLACEHOLDER


def test_the_site_leads_there_once_it_is_set(monkeypatch):
    config = SimpleNamespace(repo_url="", extra={})
    monkeypatch.setattr(address, "known", lambda: ADDRESS)
    release.describe(config)
    assert (config.repo_url, config.extra) == (ADDRESS, {"source": "repository"})
