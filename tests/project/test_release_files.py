"""The files that tell a release: CHANGELOG.md, CITATION.cff, and the version that they share with the package."""

import datetime
import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
RELEASE = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})$", re.M)
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
PERSON = {"family-names", "given-names"}


def releases():
    return [(version, datetime.date.fromisoformat(day)) for version, day in RELEASE.findall(CHANGELOG)]


def test_the_newest_release_of_the_changelog_is_this_version_and_the_citation_agrees():
    version, day = releases()[0]
    assert version == VERSION == CITATION["version"]
    assert CITATION["date-released"] == day.isoformat()


def test_releases_stand_in_the_order_of_their_dates_and_sections_have_the_agreed_names():
    found = releases()
    assert len(found) == len(re.findall(r"^## ", CHANGELOG, re.M))
    assert found == sorted(found, key=lambda one: one[1], reverse=True)
    assert set(re.findall(r"^### (.*)$", CHANGELOG, re.M)) <= KINDS


def test_the_citation_has_what_version_1_2_0_of_its_format_requires():
    """Schema guide of the Citation File Format 1.2.0, "Valid keys": cff-version, message, title, authors."""
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION["type"] == "software"
    assert isinstance(CITATION["message"], str)
    assert isinstance(CITATION["title"], str)
    assert isinstance(CITATION["version"], str)
    assert CITATION["authors"]
    assert all(set(author) in ({"name"}, PERSON) for author in CITATION["authors"])
    assert CITATION["license"] == "MIT"
    for reference in CITATION["references"]:
        assert reference.keys() >= {"type", "title", "authors"}  # all that a reference needs
        assert all(set(author) == PERSON for author in reference["authors"])


def test_the_citation_names_the_paper_whose_robot_this_is():
    (paper,) = CITATION["references"]
    assert paper["doi"] == "10.1109/70.768190"
    assert (paper["volume"], paper["issue"], paper["start"], paper["end"], paper["year"]) == (
        15,
        3,
        578,
        587,
        1999,
    )
