"""What the tests of the commands share: a short scenario, and a way to call the program in this process."""

import io

import pytest
from click.testing import CliRunner
from intelhex import IntelHex

from mirotwin.commands import main

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
    """Calls the command; gives exit code, stdout and stderr. Anything but a clean exit fails the test."""

    def call(*arguments):
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.stdout, result.stderr

    return call


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
    code, _, err = mirotwin("run", short, "--seed", 5, "--out", folder)
    assert (code, err) == (0, "")
    return folder


def hex_text(code):
    """Intel HEX of `code`, from address 0 on."""
    file, text = IntelHex(), io.StringIO()
    file.frombytes(code)
    file.write_hex_file(text)
    return text.getvalue()


def hex_file(path, code):
    path.write_text(hex_text(code))
    return path
