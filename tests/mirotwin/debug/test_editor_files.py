"""The extension for VS Code and the configurations that `mirotwin init` writes say what `launch` takes."""

import json
from pathlib import Path

import pytest

from mirotwin.debug.subject import DebugSubject, launched

EXAMPLES = Path(__file__).parents[3] / "examples"
EXTENSION = json.loads((EXAMPLES / "vscode" / "package.json").read_text())
LAUNCH = json.loads((EXAMPLES / "hil" / ".vscode" / "launch.json").read_text())
VALUES = {"string": "1s", "integer": 1, "array": ["one"]}


def test_the_extension_starts_the_adapter():
    (debugger,) = EXTENSION["contributes"]["debuggers"]
    assert [debugger["runtime"], *debugger["args"]] == ["mirotwin", "debug", "--dap"]


def test_each_key_of_the_extension_is_one_that_a_launch_takes():
    keys = EXTENSION["contributes"]["debuggers"][0]["configurationAttributes"]["launch"]["properties"]
    for key, about in keys.items():
        if key != "stopOnEntry":  # the adapter's own
            assert launched({key: VALUES[about["type"]]}) != DebugSubject()


@pytest.mark.parametrize("configuration", LAUNCH["configurations"], ids=lambda one: one["name"])
def test_configurations_of_a_project_have_keys_that_the_extension_names(configuration):
    launch = EXTENSION["contributes"]["debuggers"][0]["configurationAttributes"]["launch"]
    assert configuration.keys() - {"type", "request", "name"} <= launch["properties"].keys()
    assert "subject" in configuration
