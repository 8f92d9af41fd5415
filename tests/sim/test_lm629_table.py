"""The `[lm629]` table of a scenario: what it says reaches the chips, and what it must not say is named."""

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.lm629.options import CHOICES
from miro_sim.scenario import file as scenario_file
from miro_sim.scenario.errors import ScenarioError
from miro_sim.world.world import World

SCENARIO = """name = "chips"
duration_s = 0.1

[lm629]
{options}

[[network]]
[[network.robot]]
reference.kind = "line"
"""


def loaded(tmp_path, options):
    path = tmp_path / "chips.toml"
    path.write_text(SCENARIO.format(options=options))
    return scenario_file.load(str(path)).scenario


@pytest.mark.parametrize(
    "name", [name for name, choices in CHOICES.items() if not isinstance(choices[0], bool)]
)
def test_every_choice_is_named_to_who_chooses_another(tmp_path, name):
    for wrong in ('"so"', "9", "true"):
        with pytest.raises(ScenarioError) as caught:
            loaded(tmp_path, f"{name} = {wrong}")
        named = str(caught.value).partition("; use ")[2].replace(" or ", ", ").split(", ")
        if "without quotes" not in str(caught.value):
            assert sorted(named) == sorted(map(str, CHOICES[name]))


def test_both_chips_of_a_robot_follow_it(tmp_path):
    world = World(loaded(tmp_path, 'busy_clocks = 240\ninterrupt = "level"'), 0, load_hex(image_path()))
    board = world.networks[0].robots[0].board
    for chip in (board.left, board.right):
        assert (chip.options.busy_clocks, chip.options.interrupt) == (240, "level")
        assert chip.port.busy_ticks == 960


def test_another_reading_gives_another_run_and_the_default_one_the_same(tmp_path):
    def digest(options):
        world = World(loaded(tmp_path, options), 0, load_hex(image_path()))
        while not world.finished:
            world.step()
        return world.digest

    assert digest("") == digest("busy_clocks = 120")
    assert digest("") != digest("busy_clocks = 240")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("busy_clock = 1", "busy_clocks"),
        ("busy_clocks = -1", "busy_clocks must be 0..1048576 clocks, not -1"),
        ('interrupt = "edge"', "lm629.interrupt: 'edge' is not one of the choices; use event or level"),
        ("interrupt = 1", "lm629.interrupt: expected a string, got a whole number (1); use event or level"),
        ('relative_base = "x"', "'x' is not one of the choices; use desired, real or target"),
        ("sign_of_negative = 2", "lm629.sign_of_negative: 2 is not one of the choices; use 0 or 1"),
        ("double_step = 1", "lm629.double_step: 1 is not one of the choices; use -2, 0 or 2"),
        ("pid_saturates = 1", "lm629.pid_saturates: expected true or false, got a whole number (1)"),
    ],
)
def test_what_is_no_reading_is_refused_in_one_line(tmp_path, options, said):
    with pytest.raises(ScenarioError) as caught:
        loaded(tmp_path, options)
    assert said in str(caught.value)
    assert "chips.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
