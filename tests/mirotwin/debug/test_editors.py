"""Editors and the adapter: the client with which adapters are tested, nvim without a screen, and files for VS Code.

    npm install --prefix build/npm @vscode/debugadapter-testsupport@1.68.0

What the adapter sends is compared with the published schema of the protocol, which the package debugpy carries.
nvim-dap is in no package registry: its test is run where nvim finds it, or where NVIM_DAP names its folder.
"""

import json
import os
import re
import shutil
import sys
from pathlib import Path

import msgspec
import pytest

from miro_robot.firmware import source_folder
from mirotwin.debug.subject import DebugSubject, launched
from tests import children

ROOT = Path(__file__).parents[3]
MODULES = ROOT / "build" / "npm" / "node_modules"
HERE = Path(__file__).parent
EXAMPLES = ROOT / "examples"
EXTENSION = json.loads((EXAMPLES / "vscode" / "package.json").read_text())
LAUNCHES = [
    one
    for project in ("hil", "boards/car")
    for one in json.loads((EXAMPLES / project / ".vscode/launch.json").read_text())["configurations"]
]
VALUES = {"string": "1s", "integer": 1, "array": ["one"]}


@pytest.fixture(scope="module")
def sent(tmp_path_factory):
    """Messages that the adapter sent while the client asked for all that it can do."""
    there = shutil.which("node") is not None and (MODULES / "@vscode" / "debugadapter-testsupport").is_dir()
    if not there and not os.environ.get("CI"):
        pytest.skip("node, or the package @vscode/debugadapter-testsupport in build/npm, is not there")
    log = tmp_path_factory.mktemp("dap") / "sent"
    words = ["node", HERE / "dap_client.js", sys.executable, HERE / "dap_server.py", source_folder()]
    environment = {**os.environ, "NODE_PATH": str(MODULES), "DAP_SENT": str(log)}
    done = children.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    found, data = [], log.read_bytes()
    while data:
        head, _, rest = data.partition(b"\r\n\r\n")
        size = int(re.fullmatch(rb"Content-Length: (\d+)", head)[1])
        found.append(msgspec.json.decode(rest[:size]))
        data = rest[size:]
    return found


def test_the_client_gets_what_it_asks_for(sent):
    assert [message["seq"] for message in sent] == list(range(1, len(sent) + 1))
    assert {message["type"] for message in sent} == {"response", "event"}


def schema():
    jsonschema = pytest.importorskip("jsonschema", reason="needs the extra develop")
    debugpy = pytest.importorskip("debugpy", reason="needs the extra develop")
    path = Path(debugpy.__file__).parent / "_vendored/pydevd/_pydevd_bundle/_debug_adapter/debugProtocol.json"
    return jsonschema.Draft4Validator, msgspec.json.decode(path.read_bytes())


def definition_of(message, definitions):
    """The name of the schema's definition for a message: `StackTraceResponse`, `StoppedEvent`."""
    if message["type"] == "response" and not message["success"]:
        return "ErrorResponse"
    name = message["command"] if message["type"] == "response" else message["event"]
    return next(one for one in definitions if one.lower() == f"{name}{message['type']}".lower())


@pytest.mark.develop
def test_each_message_is_valid_against_the_published_schema(sent):
    validator, document = schema()
    seen = set()
    for message in sent:
        name = definition_of(message, document["definitions"])
        seen.add(name)
        checker = validator({**document, "$ref": f"#/definitions/{name}"})
        assert not [f"{name}: {error.message}: {message}" for error in checker.iter_errors(message)]
    assert len(seen) > 25


@pytest.mark.develop
def test_a_message_that_is_wrong_would_be_found():
    validator, document = schema()
    checker = validator({**document, "$ref": "#/definitions/StoppedEvent"})
    wrong = {"seq": 1, "type": "event", "event": "stopped", "body": {"threadId": "one"}}
    assert list(checker.iter_errors(wrong))


def nvim(*words, **environment):
    """What nvim says, and its exit code."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    plugin = f"let &runtimepath .= ',' . '{os.environ.get('NVIM_DAP', '')}'"
    command = ["nvim", "--headless", "-n", "-i", "NONE", "--cmd", plugin, *words]
    done = children.run(
        command, env={**os.environ, "PATH": path, **environment}, capture_output=True, text=True, timeout=120
    )
    return done.returncode, done.stderr


@pytest.fixture
def configuration():
    """The text of the documentation, where nvim and the plug-in are there."""
    if shutil.which("nvim") is None or nvim("-c", "lua require('dap')", "-c", "qall!") != (0, ""):
        pytest.skip("nvim, or nvim-dap on its runtime path or in the folder NVIM_DAP, is not there")
    howto = (ROOT / "docs" / "howto" / "debug.md").read_text()
    return re.search(r"For nvim-dap .*:\n\n```text\n(.*?)```", howto, re.DOTALL)[1]


def test_nvim_steps_both_ways_and_shows_variables(configuration, tmp_path):
    source = source_folder() / "failsafe.c"
    script = f"luafile {HERE / 'nvim_dap.lua'}"
    code, said = nvim("-c", script, source, CONFIGURATION=configuration, XDG_CACHE_HOME=str(tmp_path))
    assert (code, said.splitlines()[-1:]) == (0, ["done"]), said


def test_each_key_of_the_extension_is_one_that_a_launch_takes():
    keys = EXTENSION["contributes"]["debuggers"][0]["configurationAttributes"]["launch"]["properties"]
    for key, about in keys.items():
        if key not in ("stopOnEntry", "token"):  # the adapter's own
            assert launched({key: VALUES[about["type"]]}) != DebugSubject()


@pytest.mark.parametrize("configuration", LAUNCHES, ids=lambda one: one["name"])
def test_configurations_of_a_project_have_keys_that_the_extension_names(configuration):
    launch = EXTENSION["contributes"]["debuggers"][0]["configurationAttributes"]["launch"]
    assert configuration.keys() - {"type", "request", "name", "preLaunchTask"} <= launch["properties"].keys()
    assert "subject" in configuration
