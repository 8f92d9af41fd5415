"""`examples/foxglove.json`: every topic and field in it is in an export, and every setting is one that Foxglove has."""

import re
from pathlib import Path

import msgspec
import pytest

layouts = pytest.importorskip("foxglove.layouts", reason="needs the extra develop")
pytestmark = pytest.mark.develop

LAYOUT = msgspec.json.decode((Path(__file__).parents[4] / "examples" / "foxglove.json").read_bytes())
PANELS = LAYOUT["configById"]
CONFIGS = {
    "3D": layouts.ThreeDeeConfig,
    "Image": layouts.ImageConfig,
    "RosOut": layouts.LogConfig,
    "RawMessages": layouts.RawMessagesConfig,
    "Plot": layouts.PlotConfig,
}
TITLE = {"foxglovePanelTitle"}
TOPIC = re.compile(r"(/[a-z0-9_/]+)((?:\.[a-z0-9_]+)*)")


def topics(node):
    """Every text and every key that begins like a topic."""
    if isinstance(node, str) and node.startswith("/"):
        yield node
    for part in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        for one in part:
            yield from topics(one)


def placed(node):
    """The panels in a tree of splits, and in the tabs of these."""
    if isinstance(node, dict):
        for place in ("first", "second"):
            yield from placed(node[place])
    else:
        yield node
        for tab in PANELS[node].get("tabs", ()):
            yield from placed(tab["layout"])


def test_everything_that_is_shown_is_in_an_export(shown):
    found = sorted(set(topics(PANELS)))
    assert len(found) > 12
    for path in found:
        matched = TOPIC.fullmatch(path)
        assert matched, path
        messages = [one.content for one in shown if one.topic == matched[1]]
        assert messages, path
        value = messages[-1]
        for name in matched[2].split(".")[1:]:
            value = value[name]
        assert isinstance(value, (int, float)) is bool(matched[2]), path


def test_each_panel_stands_somewhere_once():
    assert sorted(placed(LAYOUT["layout"])) == sorted(PANELS)


@pytest.mark.parametrize("panel", [name for name in PANELS if not name.startswith("Tab!")])
def test_each_setting_of_a_panel_is_one_that_foxglove_has(panel):
    config = dict(PANELS[panel])
    known = CONFIGS[panel.split("!")[0]]()._to_dict()
    assert set(config) <= set(known) | TITLE
    parts = {
        "cameraState": layouts.ThreeDeeCameraState,
        "scene": layouts.BaseRendererSceneSettings,
        "imageMode": layouts.ImageModeConfig,
    }
    for name, kind in parts.items():
        assert set(config.get(name, {})) <= set(kind()._to_dict())
    for series in config.get("paths", ()):
        assert set(series) <= set(layouts.PlotSeries()._to_dict())


def test_the_tree_is_shown_in_its_root_frame(shown):
    parents = {
        part["parent_frame_id"]
        for one in shown
        if one.name == "foxglove.FrameTransforms"
        for part in one.content["transforms"]
    }
    assert {PANELS["3D!pitch"]["fixedFrame"]} == parents
