"""Files that name other files: only what lies in the folder of the file that names it, or below, is read."""

import msgspec
import pytest

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_sim.scenario.file import load, parse
from mirotwin import campaign
from mirotwin.recording.reader import read
from mirotwin.recording.recorder import Recorder
from mirotwin.runs.job import load_job
from tests.mirotwin.conftest import SHORT
from tests.mirotwin.program import mirotwin

OUTSIDE = [
    "{folder}/secret{suffix}", "../secret{suffix}", "up/secret{suffix}", "link{suffix}",
    "below/../../secret{suffix}", "a\0/x{suffix}",
]  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """A folder that a stranger packed, with links in it, and what is none of his business beside it."""
    folder = tmp_path / "theirs"
    (folder / "below").mkdir(parents=True)
    for suffix, content in ((".toml", SHORT), (".ihx", image_path().read_text())):
        (tmp_path / f"secret{suffix}").write_text(content)
        (folder / f"link{suffix}").symlink_to(tmp_path / f"secret{suffix}")
        (folder / "below" / f"mine{suffix}").write_text(content)
    (folder / "up").symlink_to(tmp_path)
    return folder


def refused(text, folder):
    with pytest.raises(BadInput, match="lies outside of the folder of the file that names it") as caught:
        campaign.parse(text, folder / "c.toml")
    return str(caught.value)


def quoted(name):
    return '"' + name.replace("\0", "\\u0000") + '"'


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_campaign_names_no_file_outside_of_its_folder(folder, name):
    scenario, image = (
        quoted(name.format(folder=folder.parent, suffix=suffix)) for suffix in (".toml", ".ihx")
    )
    assert "scenario: " in refused(f"scenario = {scenario}\n", folder)
    assert "firmware: " in refused(f'scenario = "fig6"\nfirmware = {image}\n', folder)
    assert "grid.scenario[1]: " in refused(
        f'scenario = "fig6"\n[grid]\nscenario = ["fig6", {scenario}]\n', folder
    )
    assert "grid.firmware[1]: " in refused(f'scenario = "fig6"\n[grid]\nfirmware = ["", {image}]\n', folder)


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_scenario_names_no_file_outside_of_its_folder(folder, name):
    path = folder / "s.toml"
    path.write_text(
        f"scenario = {quoted(name.format(folder=folder.parent, suffix='.toml'))}\nduration_s = 0.1\n"
    )
    with pytest.raises(BadInput, match=r"scenario: .* lies outside of the folder of the file that names it"):
        load(str(path))


@pytest.mark.parametrize("name", OUTSIDE)
def test_the_path_of_a_reference_lies_in_the_folder_of_its_scenario(folder, name):
    path = folder / "s.toml"
    (folder.parent / "secret.csv").write_text("t,x,y\n0,40,40\n1,50,40\n")
    (folder / "link.csv").symlink_to(folder.parent / "secret.csv")
    file = quoted(name.format(folder=folder.parent, suffix=".csv"))
    path.write_text(f'scenario = "below/mine.toml"\nset = {{ network.robot.0.reference.file = {file} }}\n')
    with pytest.raises(
        BadInput, match=r"reference.file: .* lies outside of the folder of the file that names it"
    ):
        load(str(path))


def test_what_lies_in_the_folder_or_below_is_read_from_wherever_the_program_runs(folder, monkeypatch):
    (folder / "s.toml").write_text('scenario = "below/mine.toml"\nduration_s = 0.1\n')
    text = 'scenario = "s.toml"\n[grid]\nfirmware = ["", "below/mine.ihx", "below/../below/mine.ihx"]\n'
    (folder / "c.toml").write_text(text)
    for place, path in (
        (folder, "c.toml"),
        (folder.parent, "theirs/c.toml"),
        (folder / "below", "../c.toml"),
    ):
        monkeypatch.chdir(place)
        assert campaign.load(path).runs == 3
    assert load(str(folder / "s.toml")).scenario.duration_s == 0.1


def test_a_recording_names_no_file_at_all(folder, tmp_path):
    """Ours hold whole scenarios."""
    (tmp_path / "short.toml").write_text(SHORT)
    mirotwin.succeeds("run", tmp_path / "short.toml", "--out", tmp_path / "run", "-q", "--no-figure")
    recording = read(tmp_path / "run" / "run.mcap")
    source = msgspec.structs.replace(recording.source, scenario_text='scenario = "below/mine.toml"\n')
    path = folder / "run.mcap"
    with path.open("wb") as stream, Recorder(stream, source) as recorder:
        for period in recording.periods:
            recorder.write(period)
    with pytest.raises(BadInput, match="scenario: stands in a file that depends on no other one"):
        load_job(str(path))
    said = mirotwin("export", path, "--as", "foxglove", "--out", tmp_path / "scene.mcap")[2]
    assert f"{path}: scenario: stands in a file that depends on no other one" in said


def test_a_text_in_python_may_name_a_file_beside_the_place_it_is_said_to_stand(folder):
    assert parse('scenario = "below/mine.toml"\n', str(folder / "not_there.toml")).name == "short"
