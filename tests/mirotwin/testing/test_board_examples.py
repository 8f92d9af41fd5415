"""The boards among the examples: their tests pass, and their images are what SDCC makes of their sources."""

import shutil
from pathlib import Path

import pytest

from tests import children

BOARDS = Path(__file__).parents[3] / "examples" / "boards"
SOURCES = sorted(BOARDS.glob("*/*.c"))


def test_the_tests_of_the_boards_pass(mirotwin):
    code, out, errors = mirotwin("test", BOARDS)

    assert code == 0, out + errors
    assert out.count("\npassed ") + out.startswith("passed ") == len(list(BOARDS.glob("*/*.scenario.toml")))


@pytest.mark.skipif(shutil.which("sdcc") is None, reason="needs sdcc")
@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_an_image_is_what_its_source_says(source, tmp_path):
    built = tmp_path / source.with_suffix(".ihx").name
    done = children.run(
        ["sdcc", "-mmcs51", "--model-small", source, "-o", built], capture_output=True, text=True
    )

    assert done.returncode == 0, done.stderr
    assert built.read_bytes() == source.with_suffix(".ihx").read_bytes()
