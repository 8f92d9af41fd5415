"""A scenario that names another one: its keys stand instead of the other's, and its text is that of the whole."""

import tempfile
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from miro_sim.scenario.file import ScenarioError, builtin_text, load, parse


def test_keys_stand_instead_of_those_of_the_scenario_that_is_named():
    silent = load("silent").scenario
    mine = parse(
        'scenario = "silent"\nname = "mine"\nduration_s = 0.5\nset = { network.robot.slot = 2 }', "mine"
    )
    assert (mine.name, mine.duration_s, mine.networks[0].robot[0].slot) == ("mine", 0.5, 2)
    assert mine.title == silent.title
    assert mine.networks[0].radio == silent.networks[0].radio


def test_a_table_stands_as_a_whole(tmp_path):
    (tmp_path / "late.toml").write_text(builtin_text("fig6").replace("delay_frames = 1", "delay_frames = 3"))
    (tmp_path / "mine.toml").write_text('scenario = "late.toml"\n[camera]\nkind = "geometric"\n')
    assert load(str(tmp_path / "late.toml")).scenario.camera.delay_frames == 3
    assert load(str(tmp_path / "mine.toml")).scenario.camera.delay_frames == 1


def test_a_file_is_named_from_the_folder_of_the_file_that_names_it(tmp_path):
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "five.toml").write_text(
        'name = "five"\nduration_s = 1.0\nnetwork = [{ robots = 5, robot = [{ slot = 4, reference.kind = "line" }] }]'
    )
    (tmp_path / "mine.toml").write_text('scenario = "bench/five.toml"\nduration_s = 0.1\n')
    loaded = load(str(tmp_path / "mine.toml"))
    assert (loaded.scenario.networks[0].robots, loaded.scenario.duration_s) == (5, 0.1)
    assert parse(loaded.text, "elsewhere") == loaded.scenario


def test_settings_of_the_command_line_win_over_those_of_the_file():
    text = 'scenario = "silent"\nset = { duration_s = 0.5, network.robot.slot = 2 }'
    assert parse(text, "mine", ["duration_s=0.25"]).duration_s == 0.25
    assert parse(text, "mine", ["duration_s=0.25"]).networks[0].robot[0].slot == 2


@given(
    st.fixed_dictionaries(
        {"scenario": st.sampled_from(["silent", "fig6", "fig7"])},
        optional={
            "duration_s": st.sampled_from([0.5, 2.0]),
            "stop_on_fault": st.booleans(),
            "expect": st.just({"no_fault": True}),
            "set": st.just({"network": {"radio": {"latency_s": 0.01}}}),
            "step": st.just([{"pause_ms": 3.0}]),
        },
    )
)
def test_the_text_that_is_kept_says_the_same_alone(tables):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mine.toml")
        path.write_text(tomli_w.dumps(tables))
        loaded = load(str(path))
    assert parse(loaded.text, "elsewhere") == loaded.scenario
    assert "scenario =" not in loaded.text


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("scenario = 3", "scenario: expected a name or a path, got 3"),
        ('scenario = ""', "scenario: expected a name or a path, got ''"),
        ('scenario = "silnt"', "scenario: silnt: no such scenario; did you mean silent?"),
        ('scenario = "none.toml"', "scenario: none.toml: no such file"),
        ('scenario = "silent"\nset = 3', "set: expected a table of keys"),
        (
            'scenario = "silent"\nset = { duration = 3 }',
            "set.duration=3: unknown key; use duration_s, in seconds",
        ),
        (
            'scenario = "silent"\nset = { network.robot.slot = 9 }',
            "set.network.robot.slot=9: 9 is out of range",
        ),
        (
            'scenario = "silent"\nset = { network.1.robots = 5 }',
            "set.network.1.robots=5: network has 1 entry",
        ),
        ('scenario = "silent"\nduration = 3', "duration: unknown key; use duration_s, in seconds"),
        ("set = { duration_s = 3 }", 'set: unknown key; it goes with scenario = "NAME"'),
        ('base = "fig6"', "base: unknown key; did you mean scenario?"),
        ('sceanrio = "fig6"', "sceanrio: unknown key; did you mean scenario?"),
    ],
)
def test_what_is_wrong_is_named_where_it_stands(text, what):
    with pytest.raises(ScenarioError) as caught:
        parse(text, "mine.toml")
    assert f"{caught.value}".startswith(f"mine.toml: {what}")


def test_the_keys_of_a_file_are_listed_with_those_of_a_scenario():
    with pytest.raises(ScenarioError, match=r"keys here: name, .*, network, scenario, set, variant;"):
        parse('qqq = "fig6"', "mine.toml")
    with pytest.raises(
        ScenarioError, match=r"--set scenario=fig7: unknown key; it goes at the top of a file$"
    ):
        load("fig6", ["scenario=fig7"])


@pytest.mark.parametrize(
    ("header", "key"),
    [
        ("[network.robot.controller]\nq1_per_s = 0.4", "network.robot.controller.q1_per_s = 0.4"),
        ("[[network.robot.controller]]\nq1_per_s = 0.4", "network.robot.controller.q1_per_s = 0.4"),
        (
            "[[network]]\n[network.robot.controller]\nq1_per_s = 0.4",
            "network.robot.controller.q1_per_s = 0.4",
        ),
        ('[network]\nradio.profile = "late"', 'network.radio.profile = "late"'),
        ("[network.robot.controller]", "network.robot.controller.q1_per_s = 0.3"),
    ],
)
def test_a_header_of_a_part_of_a_network_is_answered_with_the_setting_that_is_meant(header, key):
    with pytest.raises(ScenarioError) as caught:
        parse(f'scenario = "fig6"\n{header}\n', "mine.toml")
    what = "changes no single key of fig6; at the top of the file write"
    assert f"{caught.value}".endswith(f"{what} set = {{ {key} }} instead")
    parse(f'scenario = "fig6"\nset = {{ {key} }}', "mine.toml")


def test_a_scenario_that_names_itself_or_one_that_names_another_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('scenario = "mine.toml"')
    with pytest.raises(
        ScenarioError, match=r"scenario: mine.toml is itself another scenario with keys changed"
    ):
        load(str(path))


@pytest.mark.parametrize("place", ["network.robot.slot", "expect.inside_pitch", "duration_s"])
def test_an_integer_that_is_too_long_to_be_shown_is_refused(place):
    with pytest.raises(ScenarioError, match="an integer of 20000 bits; give a smaller one"):
        parse(f'scenario = "silent"\nset = {{ {place} = 0x{5000 * "f"} }}', "mine.toml")
    with pytest.raises(
        ScenarioError, match=r"mine.toml: step\[0\].seq: an integer of 20000 bits; give a smaller"
    ):
        parse(f'scenario = "silent"\nstep = [{{ send = "ping", seq = 0x{5000 * "f"} }}]', "mine.toml")
