"""What a release is made of: its versions and files, the bounds that CI holds, the workflows that build and publish."""

import datetime
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from tests import children
from tests.project import lowest

ROOT = Path(__file__).parents[2]
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
PROJECT = tomllib.loads(PYPROJECT)
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
RELEASE = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})$", re.M)
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
PERSON = {"family-names", "given-names"}
CONSTRAINTS = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8")
WORKFLOWS = {path.name: path for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))}
PINNED = re.compile(r"[\w.-]+/[\w./-]+@(v\d+(\.\d+)*|[0-9a-f]{40})")
FILE_OF_THE_TREE = re.compile(r"(?:\{project\}/)?\b((?:tests|docs|benchmarks|examples)/[\w./-]+\.\w+)")


def test_the_digest_that_is_cited_as_an_example_is_that_of_the_run():
    page = (ROOT / "docs/howto/reproduce.md").read_text(encoding="utf-8")
    (cited,) = re.findall(
        r"Mirotwin ([0-9.]+), commit .*, `mirotwin run fig6 --seed 7`,\n> digest ([0-9a-f]{12})\n", page
    )
    digests = json.loads((ROOT / "tests/vectors/digests.json").read_text(encoding="utf-8"))
    assert cited == (CITATION["version"], digests["fig6 6 s seed 7"][:12])


def releases():
    return [(version, datetime.date.fromisoformat(day)) for version, day in RELEASE.findall(CHANGELOG)]


def test_the_newest_release_of_the_changelog_is_this_version_and_the_citation_agrees():
    version, day = releases()[0]
    assert version == PROJECT["project"]["version"] == CITATION["version"]
    assert CITATION["date-released"] == day.isoformat()


def test_releases_stand_in_the_order_of_their_dates_and_sections_have_the_agreed_names():
    found = releases()
    headings = re.findall(r"^## (.*)$", CHANGELOG, re.M)
    assert len(found) == len(headings) - (headings[0] == "[Unreleased]")
    assert found == sorted(found, key=lambda one: one[1], reverse=True)
    assert set(re.findall(r"^### (.*)$", CHANGELOG, re.M)) <= KINDS


def test_the_citation_has_what_version_1_2_0_of_its_format_requires():
    """Schema guide of the Citation File Format 1.2.0, "Valid keys": cff-version, message, title, authors."""
    assert (CITATION["cff-version"], CITATION["type"]) == ("1.2.0", "software")
    assert all(isinstance(CITATION[key], str) for key in ("message", "title", "version"))
    assert CITATION["authors"]
    assert all(set(author) in ({"name"}, PERSON) for author in CITATION["authors"])
    assert CITATION["license"] == "MIT"
    for reference in CITATION["references"]:
        assert reference.keys() >= {"type", "title", "authors"}  # all that a reference needs
        assert all(set(author) == PERSON for author in reference["authors"])


def test_the_citation_names_the_paper_whose_robot_this_is():
    (paper,) = CITATION["references"]
    assert paper["doi"] == "10.1109/70.768190"
    place = [paper[key] for key in ("volume", "issue", "start", "end", "year")]
    assert place == [15, 3, 578, 587, 1999]


def pinned():
    lines = [line for line in CONSTRAINTS.splitlines() if not line.startswith("#")]
    return {plain(name): version for name, _, version in (line.partition("==") for line in lines)}


def plain(name):
    """The name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def numbers(version):
    return tuple(int(part) for part in version.split("."))


def test_every_requirement_has_one_lower_bound():
    assert lowest.bounds(PYPROJECT).keys() >= {"cython", "setuptools", "numpy", "hypothesis", "pytest"}
    assert "cython==3.1\n" in lowest.constraints(lowest.bounds(PYPROJECT))


@pytest.mark.parametrize(
    ("requirement", "complaint"),
    [
        ("numpy", "not written as"),
        ("numpy==2.0", "not written as"),
        ("cython>=3.2", "two lower bounds: 3.1 and 3.2"),
    ],
)
def test_a_requirement_without_a_plain_lower_bound_is_refused(requirement, complaint):
    with pytest.raises(ValueError, match=complaint):
        lowest.bounds(PYPROJECT.replace('"numpy>=1.26"', f'"{requirement}"'))


def test_ci_pins_everything_that_is_required_within_its_bounds():
    versions = pinned()
    for name, bound in lowest.bounds(PYPROJECT).items():
        assert numbers(versions[plain(name)]) >= numbers(bound), name


def test_ci_installs_by_the_constraints_also_what_a_build_needs():
    commands = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 'PIP_CONSTRAINT="$PWD/.ci/constraints.txt"' in commands
    assert 'PIP_BUILD_CONSTRAINT="$PWD/.ci/constraints.txt"' in commands
    assert not re.search("index|https?:", CONSTRAINTS)


def workflow(name):
    return yaml.safe_load(WORKFLOWS[name].read_text(encoding="utf-8"))


def steps(name):
    return [step for job in workflow(name)["jobs"].values() for step in job.get("steps", ())]


def identifiers(platform, architecture):
    pytest.importorskip("cibuildwheel", reason="needs the extra develop")
    command = ["-m", "cibuildwheel", "--print-build-identifiers", "--platform", platform]
    done = children.run(
        [sys.executable, *command, "--archs", architecture, str(ROOT)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("name", WORKFLOWS)
def test_each_action_has_a_version_and_each_file_that_is_named_is_there(name):
    used = [step["uses"] for step in steps(name) if "uses" in step]
    used += [job["uses"] for job in workflow(name)["jobs"].values() if "uses" in job]
    assert used
    for action in used:
        assert (ROOT / action).is_file() if action.startswith("./") else PINNED.fullmatch(action), action
    for step in steps(name):
        for path in FILE_OF_THE_TREE.findall(step.get("run", "")):
            assert (ROOT / path).is_file(), path


@pytest.mark.parametrize("name", WORKFLOWS)
def test_a_workflow_may_only_read_unless_a_job_says_more(name):
    assert workflow(name)["permissions"] == {"contents": "read"}


def test_publishing_needs_all_packages_and_no_password():
    jobs = workflow("release.yml")["jobs"]
    publish = jobs["publish"]
    assert jobs[publish["needs"]]["uses"] == "./.github/workflows/wheels.yml"
    assert publish["environment"]["name"] == "pypi"
    assert publish["permissions"] == {"id-token": "write"}
    assert "secrets." not in WORKFLOWS["release.yml"].read_text(encoding="utf-8")


def test_everything_that_is_built_is_published():
    kept = [step["with"]["name"] for step in steps("wheels.yml") if "upload-artifact" in step.get("uses", "")]
    (fetched,) = [
        step["with"] for step in steps("release.yml") if "download-artifact" in step.get("uses", "")
    ]
    assert len(kept) == len(workflow("wheels.yml")["jobs"])
    prefix = fetched["pattern"].removesuffix("*")
    assert prefix != fetched["pattern"]
    assert all(name.startswith(prefix) for name in kept)


def test_each_package_is_tried_where_it_is_built():
    command = PROJECT["tool"]["cibuildwheel"]["test-command"]
    (path,) = FILE_OF_THE_TREE.findall(command)
    assert (ROOT / path).is_file()
    assert "--engine compiled" in command
    jobs = workflow("wheels.yml")["jobs"]
    for name in ("source", "pure"):
        assert any(path in step.get("run", "") for step in jobs[name]["steps"]), name


@pytest.mark.develop
@pytest.mark.parametrize(
    "machine",
    ["linux x86_64", "linux aarch64", "macos arm64", "macos x86_64", "windows AMD64"],
)
def test_wheels_are_built_for_every_python_from_the_lowest_that_is_supported(machine):
    lowest = int(re.fullmatch(r">=3\.(\d+)", PROJECT["project"]["requires-python"])[1])
    tags = {name.partition("-")[0] for name in identifiers(*machine.split())}
    assert tags == {f"cp3{minor}" for minor in range(lowest, 15)}
