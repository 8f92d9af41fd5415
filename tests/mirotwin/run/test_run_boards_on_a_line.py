"""`mirotwin run` and `diff` of several boards on one line."""

import re
import shutil

import pytest

from mirotwin.testing import starter


@pytest.fixture(scope="module")
def monitor(tmp_path_factory, mirotwin):
    folder = tmp_path_factory.mktemp("line") / "monitor"
    shutil.copytree(starter.folder() / "boards" / "monitor", folder)
    mirotwin.succeeds("run", folder / "overload.scenario.toml", "--out", folder / "both")
    return folder


def test_the_table_shows_characters_that_are_no_text_as_hex(mirotwin, monitor):
    out = mirotwin.succeeds("run", monitor / "overload.scenario.toml", "--out", monitor / "again")
    assert r"?\xe68\x00\x1e?\xe68\x00\x1e" in "".join(out.split())


def test_images_of_other_boards_that_differ_are_named_by_their_hash(mirotwin, monitor):
    board, _, code = (monitor / "panel.ihx").read_text().partition("\n")
    (monitor / "panel.ihx").write_text(f"{board}\n{code}\n")  # the same code, another file
    mirotwin.succeeds("run", monitor / "overload.scenario.toml", "--out", monitor / "other")
    out = mirotwin.succeeds("diff", monitor / "both", monitor / "other")
    assert re.search(r"others\.panel\.image +[0-9a-f]{64} +[0-9a-f]{64}\n", out)
