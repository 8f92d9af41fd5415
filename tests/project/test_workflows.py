"""The workflows that build and publish packages, and which wheels they build."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from tests import children

ROOT = Path(__file__).parents[2]
WORKFLOWS = {path.name: path for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PINNED = re.compile(r"[\w.-]+/[\w./-]+@(v\d+(\.\d+)*|[0-9a-f]{40})")
FILE_OF_THE_TREE = re.compile(r"(?:\{project\}/)?\b((?:tests|docs|benchmarks|examples)/[\w./-]+\.\w+)")


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


def test_there_is_a_workflow_that_builds_and_one_that_publishes():
    assert {"wheels.yml", "release.yml"} <= set(WORKFLOWS)


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


@pytest.mark.parametrize(
    ("platform", "architecture"),
    [
        ("linux", "x86_64"),
        ("linux", "aarch64"),
        ("macos", "arm64"),
        ("macos", "x86_64"),
        ("windows", "AMD64"),
    ],
)
def test_wheels_are_built_for_every_python_from_the_lowest_that_is_supported(platform, architecture):
    lowest = int(re.fullmatch(r">=3\.(\d+)", PROJECT["project"]["requires-python"])[1])
    tags = {name.partition("-")[0] for name in identifiers(platform, architecture)}
    assert tags == {f"cp3{minor}" for minor in range(lowest, 15)}
