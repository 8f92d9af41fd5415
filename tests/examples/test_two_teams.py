"""The example with two teams: each PC's camera sees all robots, and its tracker finds its own."""

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.file import load
from miro_sim.world.world import World
from mirotwin.camera.view import views_of
from tests.examples.rig import EXAMPLES


def test_all_robots_of_both_teams_are_found_for_the_first_second():
    world = World(load(str(EXAMPLES / "two_teams.toml")).scenario, 0, load_hex(image_path()))
    lost = []
    for view in views_of(world, "example"):
        view.shows.append(lambda view: lost.append(view.notes.pairs.count(None)))
    while world.index < 30:
        world.step()
    assert lost == [0] * 60
    assert [view.sight.tracker.team for view in views_of(world, "example")] == ["yellow", "blue"]
