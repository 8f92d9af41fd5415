"""The extension for VS Code: a .vsix as editors take it, and what it does when a session begins."""

import io
import json
import os
import re
import shlex
import shutil
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.testing.starter import VSIX, contents_of
from mirotwin.testing.vsix import packed
from tests import children

HERE = Path(__file__).parent
SCHEMA = "{http://schemas.microsoft.com/developer/vsx-schema/2011}"
CONTENT = "{http://schemas.openxmlformats.org/package/2006/content-types}"
LAUNCH = {"type": "mirotwin", "request": "launch", "name": "a", "subject": "fig6"}
MISSING = "Mirotwin cannot start: "


@pytest.fixture(scope="module")
def archive(mirotwin, tmp_path_factory):
    """The file that the command writes, read as a zip."""
    folder = tmp_path_factory.mktemp("vsix")
    assert mirotwin.succeeds("examples", "vscode", folder) == f"{folder / VSIX}\n"
    return zipfile.ZipFile(folder / VSIX)


def test_it_holds_what_the_format_wants(archive):
    names = [
        "[Content_Types].xml",
        "extension.vsixmanifest",
        "extension/extension.js",
        "extension/package.json",
    ]
    assert archive.namelist() == names
    assert archive.testzip() is None


def test_the_manifest_says_what_the_package_says(archive):
    package = json.loads(archive.read("extension/package.json"))
    manifest = ElementTree.fromstring(archive.read("extension.vsixmanifest"))
    identity = manifest.find(f"{SCHEMA}Metadata/{SCHEMA}Identity").attrib
    named = {key: package[key.lower()] for key in ("Version", "Publisher")}
    assert identity == {"Language": "en-US", "Id": package["name"], **named}
    properties = {one.get("Id"): one.get("Value") for one in manifest.iter(f"{SCHEMA}Property")}
    assert properties["Microsoft.VisualStudio.Code.Engine"] == package["engines"]["vscode"]
    (target,) = manifest.iter(f"{SCHEMA}InstallationTarget")
    assert target.get("Id") == "Microsoft.VisualStudio.Code"
    assets = {one.get("Type"): one.get("Path") for one in manifest.iter(f"{SCHEMA}Asset")}
    assert assets == {"Microsoft.VisualStudio.Code.Manifest": "extension/package.json"}


def test_each_file_has_a_type(archive):
    types = ElementTree.fromstring(archive.read("[Content_Types].xml"))
    ends = {one.get("Extension") for one in types.iter(f"{CONTENT}Default")}
    assert {Path(name).suffix for name in archive.namelist()[1:]} <= ends


def test_it_has_the_same_bytes_whenever_it_is_made():
    (content,) = contents_of("vscode").values()
    assert content == contents_of("vscode")[VSIX]
    entries = zipfile.ZipFile(io.BytesIO(content)).infolist()
    assert {(one.date_time, one.compress_type) for one in entries} == {
        ((1980, 1, 1, 0, 0, 0), zipfile.ZIP_STORED)
    }


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1))
def test_names_of_any_characters_stay_themselves(text):
    package = {"name": text, "version": "1", "publisher": "p", "displayName": text, "description": text}
    package |= {"categories": ["Debuggers"], "engines": {"vscode": "^1.75.0"}, "extensionKind": ["workspace"]}
    made = zipfile.ZipFile(io.BytesIO(packed({"package.json": json.dumps(package).encode()})))
    manifest = ElementTree.fromstring(made.read("extension.vsixmanifest"))
    assert manifest.find(f"{SCHEMA}Metadata/{SCHEMA}Identity").get("Id") == text
    assert manifest.find(f"{SCHEMA}Metadata/{SCHEMA}DisplayName").text == text


def test_the_package_names_its_file_and_starts_when_a_session_does(archive):
    package = json.loads(archive.read("extension/package.json"))
    assert f"extension/{Path(package['main'])}" in archive.namelist()
    (debugger,) = package["contributes"]["debuggers"]
    assert package["activationEvents"] == [f"onDebugResolve:{debugger['type']}"]
    assert package["contributes"]["configuration"]["properties"].keys() == {"mirotwin.path"}


# What it does, in node


@pytest.fixture
def session(archive, tmp_path):
    """Begins a session in a folder; what came of it."""
    if shutil.which("node") is None and not os.environ.get("CI"):
        pytest.skip("node is not there")
    archive.extractall(tmp_path / "installed")

    def begin(folder=None, setting="", answer="", configuration=LAUNCH, path="/nowhere"):
        words = (tmp_path / "installed/extension", folder or "", setting, answer, json.dumps(configuration))
        node = shutil.which("node")
        environment = {**os.environ, "PATH": path}
        command = [node, HERE / "extension_host.js", *words]
        done = children.run(command, env=environment, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return begin


def program(path):
    """A `mirotwin` in a folder of its own."""
    path.parent.mkdir(parents=True)
    words = shlex.join([sys.executable, "-c", "from mirotwin.entry import main; main()"])
    path.write_text(f'#!/bin/sh\nPYTHONPATH={shlex.quote(os.pathsep.join(sys.path))} exec {words} "$@"\n')
    path.chmod(0o755)
    return path


@pytest.mark.parametrize("where", ["setting", "home", "folder", ".venv", "PATH"])
def test_it_starts_the_program_that_it_finds(session, tmp_path, where, monkeypatch):
    folder = tmp_path / "mine"
    folder.mkdir()
    monkeypatch.setenv("HOME", str(tmp_path))
    places = {
        "setting": (tmp_path / "a/mirotwin", {"setting": f"{tmp_path}/a/mirotwin"}),
        "home": (tmp_path / "a/mirotwin", {"setting": "~/a/mirotwin"}),
        "folder": (folder / "env/mirotwin", {"setting": "${workspaceFolder}/env/mirotwin"}),
        ".venv": (folder / ".venv/bin/mirotwin", {}),
        "PATH": (tmp_path / "a/mirotwin", {"path": f"/nowhere:{tmp_path}/a:/usr/bin:/bin"}),
    }
    path, given = places[where]
    seen = session(folder, **given, **{} if "path" in given else {"path": "/usr/bin:/bin"})
    assert program(path) is path
    assert seen["configuration"] == "ended"  # it was not there yet
    seen = session(folder, **given, **{} if "path" in given else {"path": "/usr/bin:/bin"})
    assert (seen["command"], seen["args"]) == (f"{path}", ["debug", "--dap"])
    assert seen["options"] == {"cwd": f"{folder}"}
    assert [(one["command"], one["success"]) for one in seen["answers"]] == [
        ("initialize", True), ("launch", True), ("disconnect", True),
    ]  # fmt: skip
    assert (seen["code"], seen["messages"]) == (0, [])


def test_where_the_program_is_missing_a_message_says_so_and_opens_the_setting(session, tmp_path):
    seen = session(tmp_path, answer="Open Settings")
    (message,) = seen["messages"]
    assert message[0].startswith(
        f"{MISSING}it is neither in .venv of this folder nor on the PATH. Set mirotwin.path"
    )
    assert seen["commands"] == [["workbench.action.openSettings", "mirotwin.path"]]
    assert seen["configuration"] == "ended"
    assert session(tmp_path)["commands"] == []


@pytest.mark.parametrize("setting", ["/nowhere/mirotwin", "mirotwin-of-mine", "."])
def test_a_setting_that_names_no_program_is_told(session, tmp_path, setting):
    program(tmp_path / ".venv/bin/mirotwin")
    (message,) = session(tmp_path, setting=setting)["messages"]
    assert message[0].startswith(
        f"{MISSING}mirotwin.path is {setting}, and no program is there. Set mirotwin.path"
    )


def test_a_session_without_a_folder_takes_the_path(session, tmp_path):
    path = program(tmp_path / "a/mirotwin")
    seen = session(path=f"{path.parent}:/usr/bin:/bin")
    assert (seen["command"], "options" in seen) == (f"{path}", False)


def test_a_server_needs_no_program_here_and_no_configuration_opens_the_file(session, tmp_path):
    served = {**LAUNCH, "debugServer": 4711}
    seen = session(tmp_path, configuration=served)
    assert (seen["configuration"], seen["messages"]) == (served, [])
    assert session(tmp_path, configuration={})["configuration"] is None


@pytest.mark.parametrize("project", ["hil", "boards/car"])
def test_the_task_of_a_launch_is_there_and_finds_the_compilers_errors(project):
    folder = HERE.parents[2] / "examples" / project / ".vscode"
    launches = json.loads((folder / "launch.json").read_text())["configurations"]
    (task,) = json.loads((folder / "tasks.json").read_text())["tasks"]
    named = {one["preLaunchTask"] for one in launches if "preLaunchTask" in one}
    assert (named, task["command"]) == ({task["label"]}, "make")
    assert all("preLaunchTask" in one for one in launches if "firmware" in one)
    pattern = task["problemMatcher"]["pattern"]
    for line, message in (
        ("main.c:12: error 20: Undefined identifier 'y'", "20: Undefined identifier 'y'"),
        ("main.c:12: syntax error: token -> 'bar' ; column 27", "token -> 'bar' ; column 27"),
        ("main.c:12: warning 85: in function f unreferenced", "85: in function f unreferenced"),
    ):
        found = re.match(pattern["regexp"], line)
        assert (found[pattern["file"]], found[pattern["line"]]) == ("main.c", "12")
        assert (found[pattern["severity"]] in line, found[pattern["message"]]) == (True, message)
