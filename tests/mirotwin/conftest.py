"""What the tests of the commands share: the program, a short scenario, and a run of it."""

import io

import pytest
from intelhex import IntelHex

from tests.mirotwin import program

SHORT = """# half a dozen control periods
name = "short"
title = "A short line"
duration_s = 0.2

[[network]]
[network.radio]
bit_error_rate = 2e-3

[[network.robot]]
slot = 0
start_error_x_cm = 2.0
reference.kind = "line"

[[network.robot]]
slot = 2
reference.kind = "arc"
"""


@pytest.fixture(scope="session")
def mirotwin():
    return program.mirotwin


@pytest.fixture(scope="session")
def short(tmp_path_factory):
    """The short scenario as a file."""
    path = tmp_path_factory.mktemp("scenario") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def finished(mirotwin, short):
    """The folder of a finished run of the short scenario with seed 5."""
    folder = short.parent / "finished"
    mirotwin.succeeds("run", short, "--seed", 5, "--out", folder)
    return folder


def hex_text(code, at=0):
    """Intel HEX of `code` at an address."""
    file, text = IntelHex(), io.StringIO()
    file.frombytes(code, at)
    file.write_hex_file(text)
    return text.getvalue()


def hex_file(path, code, at=0):
    path.write_text(hex_text(code, at))
    return path
