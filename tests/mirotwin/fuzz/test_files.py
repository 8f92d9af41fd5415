"""The folder of a campaign: one campaign at a time writes there."""

import pytest

from mirotwin.fuzz.files import CampaignFolder
from mirotwin.shell.outputs import OutputError
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.firmwares import SLEEPS
from tests.robot.mcs51.asm import assemble

REFUSAL = "another process is writing into the folder; wait until it has finished, or choose another folder"


def test_the_folder_of_a_running_campaign_is_refused_even_with_force_and_free_after_it(tmp_path):
    early = CampaignFolder(tmp_path / "out", force=True)
    with CampaignFolder(tmp_path / "out").filled():
        (tmp_path / "out" / "dictionary").write_text("words")
        with pytest.raises(OutputError, match=REFUSAL):
            CampaignFolder(tmp_path / "out", force=True)
        with pytest.raises(OutputError, match=REFUSAL), early.filled():
            pass
    assert (tmp_path / "out" / "dictionary").read_text() == "words"
    with early.filled():
        assert list((tmp_path / "out").iterdir()) == []


def test_a_folder_that_another_campaign_filled_since_it_was_checked_is_refused_without_force(tmp_path):
    early = CampaignFolder(tmp_path / "out")
    with CampaignFolder(tmp_path / "out").filled():
        (tmp_path / "out" / "dictionary").write_text("words")
    with pytest.raises(OutputError, match=r"the folder is not empty \(dictionary\)"), early.filled():
        pass
    assert (tmp_path / "out" / "dictionary").read_text() == "words"


def test_the_command_does_not_touch_a_running_campaign(mirotwin, engines, tmp_path):
    image = hex_file(tmp_path / "sleeps.ihx", assemble(SLEEPS))
    with CampaignFolder(tmp_path / "out").filled():
        (tmp_path / "out" / "dictionary").write_text("words")
        err = mirotwin.ends(2, "fuzz", image, "--bare", "--time", "1s", "--force", "--out", tmp_path / "out")
    assert REFUSAL in err
    assert not engines
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["dictionary"]
