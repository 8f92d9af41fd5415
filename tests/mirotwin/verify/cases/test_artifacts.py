"""What a failure leaves in its folder: the copy of an image has every name that the image has."""

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.image.debug_info import DebugInfo
from miro_robot.image.variables import variables_of
from mirotwin.shell.outputs import OutputError
from mirotwin.verify.cases.artifacts import FIRMWARE, clear, leave, leave_image, nothing_left, stream_files


def copied(folder, listing):
    """The robot's own image as a user has it, `mine.ihx`, with its listing under that name."""
    folder.mkdir()
    for suffix in (".ihx", ".map", ".cdb"):
        (folder / f"mine{suffix}").write_bytes(image_path().with_suffix(suffix).read_bytes())
    (folder / listing).write_bytes(image_path().with_suffix(".rst").read_bytes())
    return load_hex(folder / "mine.ihx")


def named(image):
    variables = variables_of(image)
    assert not variables.unplaced
    places = {name: [one.address for one in found] for name, found in variables.by_name.items()}
    return image.symbols.names, places, DebugInfo.of(image).lines


@pytest.mark.parametrize("listing", ["mine.rst", "uart.rst"], ids=["of the image", "of a module"])
def test_whatever_names_things_in_an_image_is_left_with_it(tmp_path, listing):
    image = copied(tmp_path / "own", listing)
    (tmp_path / "left").mkdir()
    leave_image(tmp_path / "left", image)
    assert named(load_hex(tmp_path / "left" / FIRMWARE)) == named(image)


def test_a_listing_of_an_earlier_image_does_not_stay_beside_another_one(tmp_path):
    (tmp_path / "left").mkdir()
    leave_image(tmp_path / "left", copied(tmp_path / "own", "uart.rst"))
    (tmp_path / "left" / "other.rst").write_text("of another tool")
    clear(tmp_path / "left")
    assert [path.name for path in (tmp_path / "left").iterdir()] == ["other.rst"]


def test_where_the_image_cannot_be_left_its_case_is_not_either(tmp_path):
    folder = tmp_path / "left"
    (folder / FIRMWARE).mkdir(parents=True)
    image = copied(tmp_path / "own", "mine.rst")
    with pytest.raises(OutputError) as caught:
        leave(folder, "report", {"scenario.toml": b"a scenario", **stream_files("case", "", image)})
    assert [path.name for path in folder.iterdir()] == [FIRMWARE]
    assert nothing_left(folder, caught.value) == (
        f"nothing could be left in {folder}: {folder / FIRMWARE}: is a folder where a file is to be written;"
        " remove it, or choose another folder"
    )
