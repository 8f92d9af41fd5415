"""The versions that CI holds: the lower bounds of `pyproject.toml`, and its own constraints."""

import re
from pathlib import Path

import pytest

from tests.project import lowest

ROOT = Path(__file__).parents[2]
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
CONSTRAINTS = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8")


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
