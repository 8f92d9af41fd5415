"""Keys that stand instead of a scenario's own: `--set KEY=VALUE`, a variant's, those of a file that names it."""

import json
import re
import tempfile
import tomllib
from pathlib import Path

import msgspec
import pytest
import tomli_w
from click.testing import CliRunner
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from miro_host.registries import LAWS
from miro_sim.plant.drive import is_rough
from miro_sim.scenario.camera_keys import GaussianCamera, PixelCamera
from miro_sim.scenario.file import ScenarioError, builtin_text, changed, load, parse, written
from miro_sim.scenario.keys import HostSpec
from mirotwin.commands import main
from tests.naive.tables import scalar_places

TWO_TEAMS = Path(__file__).parents[2] / "examples" / "two_teams.toml"
FIG6 = load("fig6").scenario
TABLES = {name: tomllib.loads(builtin_text(name)) for name in ("fig6", "fig8")}
SCALARS = [(name, *place) for name, table in TABLES.items() for place in scalar_places(table)]


def refusal(*settings, source="fig6"):
    with pytest.raises(ScenarioError) as caught:
        load(source, settings)
    message = str(caught.value)
    assert "\n" not in message
    return message


@given(st.sampled_from(SCALARS), st.booleans())
def test_a_key_set_to_its_own_value_changes_nothing(place, with_indices):
    name, path, value = place
    key = path if with_indices else path.replace(".0.", ".")
    assert load(name, [f"{key}={json.dumps(value)}"]).scenario == load(name).scenario


EDITS = [
    ("duration_s = 6.0", "duration_s = 1.5", "duration_s=1.5"),
    ("stop_on_fault = true", "stop_on_fault = false", "stop_on_fault=false"),
    ("latency_s = 0.0", "latency_s = 0.01", "network.radio.latency_s=0.01"),
    ('carrier = "keyed"', 'carrier = "on"', "network.0.radio.carrier=on"),
    ("bit_error_rate = 1e-4", "eb_n0_db = 12", "network.radio.eb_n0_db=12"),
    ("slot = 0", "slot = 2", "network[0].robot[0].slot=2"),
    ("slot = 0", "slot = 2", "network.0.robot.slot = 2"),
    ('# profile = "fade15"', 'profile = ["fade15"]', 'network.radio.profile=["fade15"]'),
    ("gamma1_per_s = 2.05", "gamma1_per_s = 2", "network.robot.controller.gamma1_per_s=2"),
    ('name = "fig6"', 'name = "fast"', "name=fast"),
    ("[host]\ncompute_s = 0.003 ", "[host]\ncompute_s = 0.004 ", "host={compute_s = 0.004}"),
    ('title = "Straight line, initial errors (7.09 cm, 1.72 cm, -0.38 rad)"', 'title = "a = b"', "title=a = b"),
]  # fmt: skip


@pytest.mark.slow
@given(st.lists(st.sampled_from(EDITS), unique_by=lambda edit: edit[0], max_size=6))
def test_settings_do_what_an_editor_does(edits):
    text = builtin_text("fig6")
    for old, new, _ in edits:
        assert old in text
        text = text.replace(old, new, 1)
    loaded = load("fig6", [setting for _, _, setting in edits])
    assert loaded.scenario == parse(text, "edited")
    assert parse(loaded.text, "written") == loaded.scenario


def test_without_settings_the_text_is_the_file():
    assert load("fig6").text == builtin_text("fig6")


def test_the_text_says_which_keys_were_set():
    text = load("fig6", ["duration_s=2", "title=a\nb"]).text
    assert text.startswith("# fig6 with these keys set:\n#   duration_s=2\n#   title=a\\nb\n\n")


def test_of_two_settings_of_a_key_the_later_one_holds():
    assert load("fig6", ["duration_s=2", "duration_s=3"]).scenario.duration_s == 3.0
    host = load("fig6", ["host.compute_s=0.001", "host={}"]).scenario.host
    assert host.compute_s == 0.003
    settings = ["network.radio.eb_n0_db=12", "network.radio.bit_error_rate=0"]
    radio = load("fig6", settings).scenario.networks[0].radio
    assert (radio.eb_n0_db, radio.bit_error_rate) == (None, 0.0)


@pytest.mark.parametrize("wrong", ["-1", "nan", "inf", "0x" + "f" * 5000, '"6"'])
def test_a_file_that_is_wrong_without_its_settings_is_read_with_them(wrong):
    text = builtin_text("fig6").replace("duration_s = 6.0", f"duration_s = {wrong}")
    assert parse(text, "my.toml", ["duration_s=6"]) == FIG6


def test_several_robots_are_told_apart_by_index():
    robots = builtin_text("fig6") + "\n[[network.robot]]\nslot = 1\nreference.kind = 'line'\n"
    read = parse(robots, "my.toml", ["network.robot.1.slot=2"])
    assert [robot.slot for robot in read.networks[0].robot] == [0, 2]
    with pytest.raises(ScenarioError, match=r"network\[0\].robot has 2 entries; name one of them: network"):
        parse(robots, "my.toml", ["network.robot.slot=2"])


def test_a_scenario_that_stands_in_no_file_takes_settings_too():
    assert changed(FIG6, "x", []).scenario is FIG6
    assert changed(FIG6, "x", ["duration_s=2"]).scenario == msgspec.structs.replace(FIG6, duration_s=2.0)
    with pytest.raises(ScenarioError, match=r"x: --set duration_s=0: 0 is out of range; must be > 0"):
        changed(FIG6, "x", ["duration_s=0"])


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("duration_s", "is no setting; write KEY=VALUE"),
        ("=6", "is no setting; write KEY=VALUE"),
        ("network..slot=1", "is no setting; write KEY=VALUE"),
        ("duration=6", "unknown key; use duration_s, in seconds"),
        ("netwrok.robot.slot=1", "netwrok: unknown key; did you mean network?"),
        ("network.robot.controler.q1_per_s=1", "network[0].robot[0].controler: unknown key; did you mean controller?"),
        ("network.robot.controller.q1_per_second=1", "unknown key; did you mean q1_per_s?"),
        ("network.robot.slot=9", "9 is out of range; must be <= 4"),
        ("network.robot.slot=4", "network[0].robot[0]: slot 4 does not exist on a network of 3 robots"),
        ("network.robot.slot=one", "expected a whole number, got a string ('one')"),
        ("network.robot.3.slot=0", "network[0].robot has 1 entry, numbered from 0; give the whole list"),
        ("network.robot.1.slot=1", "or add it to the file that `mirotwin scenarios show NAME` prints"),
        ("network.robot={slot=1}", "reference: this key is missing; add it, as in `mirotwin scenarios show fig6`"),
        ("gain=0.3", "variant; `mirotwin scenarios show fig6` has those of their tables, too"),
        ("network.robot=[]", "expected a list of length >= 1"),
        ("duration_s=6s", "expected a number in seconds, got a string ('6s'); write the number without"),
        ("duration_s=nan", "nan is not a number that can be used; give a finite number"),
        ("duration_s=" + "9" * 5000, "expected a number in seconds, got a string"),
        ("duration_s.x=1", "duration_s is a value and has no keys; end KEY with duration_s"),
        ("name=2", "expected a string, got a whole number (2); to give text, write --set 'name=\"..\"'"),
        ("name=1979-05-27", "expected a string, got a date; to give text, write"),
        ("network.radio.profile=fade99", "'fade99' is no profile; did you mean fade5?"),
        ("network.radio.bursts.good_to_bad=0.1", "network[0].radio.bursts.bad_to_good: this key is missing"),
        ("camera.kind=pixel", "'pixel' is not one of the choices; use pixels, geometric or gaussian"),
        ("network.robot.controller.law=nolaw", "'nolaw' is not one of the choices; use yang_kim"),
        ("network.robot.reference.curvature_per_m=1", "unknown key; it belongs to the reference 'arc', which kind"),
        (".".join("abcdefghijklmnopqrstuvwxyz") + "=1", "a key of more than 16 parts; remove it"),
        ("network=" + "[" * 100_000, "nested too deeply"),
        ("network.control_noise.v_cm_s=5", "unknown key; use v_m_s, in metres per second"),
        ("network.control_noise.w_rad_s=-1", "-1 is out of range; must be >= 0.0 in rad"),
        ("title=" + "x" * (513 << 10), "holds more than 512 KiB"),
        ("x\ny\x1b[2J=1", "unknown key"),
    ],
)  # fmt: skip
def test_a_setting_that_cannot_be_is_refused_and_named(setting, said):
    message = refusal(setting)
    assert message.startswith(f"fig6: --set {setting[:20].encode('unicode_escape').decode()}")
    assert said in message
    assert len(message) < 1500


@pytest.mark.parametrize(
    "setting", ["na\udca9me=x", "name=\udca9", "expect.\udca9=true", "network.radio={a='\udcff'}"]
)
def test_bytes_of_a_command_line_that_are_no_text_are_refused(setting):
    assert "is not UTF-8 text" in refusal(setting)


def test_an_error_that_no_setting_made_alone_names_them_all():
    message = refusal("duration_s=60", "stop_on_fault=false")
    assert message.startswith(
        "fig6 with --set duration_s=60 --set stop_on_fault=false: network[0].robot[0].reference: leaves the pitch"
    )


def test_of_several_settings_the_one_that_is_wrong_is_named():
    message = refusal("duration_s=2", "network.robot.slot=9", "stop_on_fault=false")
    assert message.startswith("fig6: --set network.robot.slot=9: 9 is out of range")


@pytest.mark.parametrize(
    ("setting", "left_out"),
    [
        ("camera.kind=gaussian", "calibration, pattern, centroid, window_px, self_calibration"),
        ("camera.kind=geometric", "centroid, window_px, self_calibration"),
        ("camera.kind=pixels", ""),
        (
            "network.robot.controller.law=kanayama",
            "gamma1_per_s, gamma2_per_s, q1_per_s, q2_per_s, p1_m_s2, p2_rad_s2, switching, layer_s1_m_s, "
            "layer_s2_rad_s, layer_theta_rad, layer_derivative, cosine_guard, rho_floor_m",
        ),
    ],
)
def test_another_kind_drops_the_keys_of_the_old_one_with_a_note(setting, left_out):
    found = load("fig6", [setting])
    assert found.notes == ((f"--set {setting} leaves out {left_out}",) if left_out else ())
    assert not [key for key in left_out.split(", ") if key and f"\n{key} =" in found.text]


def test_a_key_of_the_old_kind_that_is_set_after_it_is_refused():
    message = refusal("network.robot.controller.law=body_frame", "network.robot.controller.switching=sign")
    assert message.startswith("fig6: --set network.robot.controller.switching=sign: unknown key")


def test_a_file_with_another_law_is_two_lines(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text('scenario = "fig6"\nset = { network.robot.controller.law = "body_frame" }\n')
    assert type(load(str(mine)).scenario.networks[0].robot[0].controller).__name__ == "BodyFrameParameters"


def test_a_key_of_a_robot_at_the_top_is_shown_its_place():
    message = refusal("controller.law=body_frame")
    assert message.endswith("controller: unknown key; write --set network.robot.controller.law=body_frame")


def test_another_kind_needs_the_keys_that_it_has():
    whole = "network.robot.reference={kind = 'line', drive_s = 1}"
    assert load("fig8", [whole]).scenario.networks[0].robot[0].reference.name() == "line"


TEXT = st.text(st.characters(codec="utf-8"), max_size=8)
SCALAR = st.booleans() | st.integers(-(1 << 63), (1 << 63) - 1) | st.floats(allow_nan=False) | TEXT
VALUES = st.recursive(
    SCALAR,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(TEXT, VALUES, max_size=4), st.text())
def test_what_is_written_is_read_as_it_was(tables, setting):
    assert tomllib.loads(written(tables, "origin", [setting])) == tables


@hypothesis_settings(deadline=None)
@given(
    st.from_regex(
        r"(network|robot|radio|camera|\[0\]|0|1|x|\.){0,6}=[a-z0-9\[\]{}=\", .]{0,12}", fullmatch=True
    )
    | st.text(st.characters(codec="utf-8"), max_size=40)
)
def test_any_setting_is_made_or_refused_in_one_line(setting):
    refused = None
    try:
        loaded = load("fig6", [setting])
    except ScenarioError as error:
        refused = f"{error}"
    if refused is None:
        assert parse(loaded.text, "written") == loaded.scenario
    else:
        assert "--set " in refused
        assert refused.isprintable()


LAWS_OF_OURS = LAWS.names()


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS_OF_OURS)
def test_any_law_takes_the_place_of_any_other(law):
    key = "network.robot.controller.law"
    text = load("fig6", [f"{key}={law}", "duration_s=0.1"]).text
    unnamed = text.replace('law = "yang_kim"\n', "")  # the default need not be named
    for other in LAWS_OF_OURS:
        for form in {text, unnamed}:
            settled = parse(form, "written.toml", [f"{key}={other}"])
            assert settled.networks[0].robot[0].controller.name() == other


@pytest.mark.parametrize("source", ["fig6", str(TWO_TEAMS)])
@pytest.mark.parametrize(
    "setting",
    [
        "controller.law=body_frame",
        "controller=body_frame",
        "robot.controller.law=body_frame",
        "estimator.kind=ekf",
        "camera=gaussian",
        "network.0.controller.law=kanayama",
        "network.0.robot.0.law=kanayama",
        "network.0.robot.0.controller=kanayama",
    ],
)
def test_what_an_error_advises_to_write_is_accepted(source, setting):
    with pytest.raises(ScenarioError) as caught:
        load(source, [setting])
    advised = caught.value.remedy.removeprefix("write --set ")
    assert advised != caught.value.remedy
    load(source, [advised])


@pytest.mark.parametrize("source", ["fig6", str(TWO_TEAMS)])
def test_a_law_and_an_estimator_may_be_those_of_all_robots(source):
    made = load(source, ['law="kanayama"', "estimator=predict"]).scenario
    robots = [robot for network in made.networks for robot in network.robot]
    assert {robot.controller.name() for robot in robots} == {"kanayama"}
    assert {robot.estimator.name() for robot in robots} == {"predict"}


def test_a_law_of_all_robots_leaves_those_alone_where_one_has_it():
    first = "network.0.robot.0.controller.law=kanayama"
    made = load(str(TWO_TEAMS), [first, "law=kanayama"]).scenario
    assert made == load(str(TWO_TEAMS), [first]).scenario
    assert made != load(str(TWO_TEAMS), ["law=kanayama"]).scenario


def test_a_law_of_all_robots_that_there_is_not_names_the_setting():
    said = refusal("law=nolaw", source=str(TWO_TEAMS))
    assert "--set law=nolaw: " in said
    assert "'nolaw' is not one of the choices" in said


def test_the_advice_keeps_the_network_and_the_robot_that_were_named():
    said = refusal("network.1.robot.1.law=kanayama", source=str(TWO_TEAMS))
    assert said.endswith("write --set network.1.robot.1.controller.law=kanayama")


def test_a_setting_does_not_leave_out_its_own_key():
    assert "kind=gaussian: unknown key; keys here: name," in refusal("kind=gaussian")
    assert "controller.kind=gaussian: unknown key; keys here: law," in refusal(
        "network.robot.controller.kind=gaussian"
    )


SILENT = 'scenario = "silent"\n'
CONTROLLER = "[network.robot.controller]"


def test_keys_stand_instead_of_those_of_the_scenario_that_is_named():
    silent = load("silent").scenario
    mine = parse(
        'scenario = "silent"\nname = "mine"\nduration_s = 0.5\nset = { network.robot.slot = 2 }', "mine"
    )
    assert (mine.name, mine.duration_s, mine.networks[0].robot[0].slot) == ("mine", 0.5, 2)
    assert mine.title == silent.title
    assert mine.networks[0].radio == silent.networks[0].radio


def refused(text):
    with pytest.raises(ScenarioError) as caught:
        parse(text, "mine.toml")
    return f"{caught.value}"


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
        (f"{SILENT}set = {{ duration = 3 }}", "set.duration=3: unknown key; use duration_s, in seconds"),
        (f"{SILENT}set = {{ network.robot.slot = 9 }}", "set.network.robot.slot=9: 9 is out of range"),
        (f"{SILENT}set = {{ network.1.robots = 5 }}", "set.network.1.robots=5: network has 1 entry"),
        (f"{SILENT}duration = 3", "duration: unknown key; use duration_s, in seconds"),
        ("set = { duration_s = 3 }", 'set: unknown key; it goes with scenario = "NAME"'),
        ('base = "fig6"', "base: unknown key; did you mean scenario?"),
        ('sceanrio = "fig6"', "sceanrio: unknown key; did you mean scenario?"),
    ],
)
def test_what_is_wrong_is_named_where_it_stands(text, what):
    assert refused(text).startswith(f"mine.toml: {what}")


def test_the_keys_of_a_file_are_listed_with_those_of_a_scenario():
    assert re.search("keys here: name, .*, network, scenario, set, variant;", refused('qqq = "fig6"'))
    assert refusal("scenario=fig7").endswith("scenario=fig7: unknown key; it goes at the top of a file")


@pytest.mark.parametrize(
    ("header", "key"),
    [
        *(
            (f"{header}\nq1_per_s = 0.4", "network.robot.controller.q1_per_s = 0.4")
            for header in (CONTROLLER, f"[{CONTROLLER}]", f"[[network]]\n{CONTROLLER}")
        ),
        ('[network]\nradio.profile = "late"', 'network.radio.profile = "late"'),
        (CONTROLLER, "network.robot.controller.q1_per_s = 0.3"),
    ],
)
def test_a_header_of_a_part_of_a_network_is_answered_with_the_setting_that_is_meant(header, key):
    what = "changes no single key of fig6; at the top of the file write"
    assert refused(f'scenario = "fig6"\n{header}\n').endswith(f"{what} set = {{ {key} }} instead")
    parse(f'scenario = "fig6"\nset = {{ {key} }}', "mine.toml")


def test_a_scenario_that_names_itself_or_one_that_names_another_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('scenario = "mine.toml"')
    assert "mine.toml is itself another scenario with keys changed" in refusal(source=str(path))


@pytest.mark.parametrize("place", ["network.robot.slot", "expect.inside_pitch", "duration_s"])
def test_an_integer_that_is_too_long_to_be_shown_is_refused(place):
    too_long, long = "an integer of 20000 bits; give a smaller one", f"0x{5000 * 'f'}"
    assert too_long in refused(f"{SILENT}set = {{ {place} = {long} }}")
    step = f'{SILENT}step = [{{ send = "ping", seq = {long} }}]'
    assert refused(step).startswith(f"mine.toml: step[0].seq: {too_long}")


SMALL = """
name = "small"
duration_s = 0.5
{}
[[network]]
[network.radio]
{}
[[network.robot]]
reference.kind = "line"
{}
"""


def small(top, radio="", robot="", settings=()):
    return parse(SMALL.format(top, radio, robot), "small", settings)


EXACT = GaussianCamera(position_error_cm=0.0, heading_error_deg=0.0, pixel_cm=0.0, delay_frames=0)
DISTURBED = [
    "network.control_noise.v_m_s=0.1",
    "network.radio.lost_frames=0.5",
    "network.radio.profile=fade5",
    "network.robot.drive.tyre.grip=0.2",
    "network.robot.drive.ball.friction=0.2",
    "network.robot.drive.disturbance.force_n=1",
    "network.robot.drive.chassis.left_radius_factor=1.1",
    "network.robot.drive.chassis.stiction_ratio=3",
    "network.robot.drive.chassis.mass_kg=0.6",
    "camera.dropped_frames=0.5",
    "host.word_bits=8",
    "host.integration=adams_bashforth",
]


@pytest.mark.parametrize("disturbed", [[], DISTURBED])
@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_ideal_on_the_command_line_wins_over_the_file_and_what_is_set_before_it(name, disturbed):
    scenario = load(name, [*disturbed, "variant=ideal"]).scenario
    network = scenario.networks[0]
    robot = network.robot[0]
    assert scenario.camera == EXACT
    assert scenario.host == HostSpec(compute_s=0.00001)
    assert (network.radio.bit_error_rate, network.radio.eb_n0_db, network.radio.bursts) == (0.0, None, None)
    assert (network.radio.lost_frames, network.radio.squelch) == (0.0, True)
    assert (network.control_noise.v_m_s, robot.wheel_radius_mismatch) == (0.0, 0.0)
    assert not is_rough(robot.drive)
    assert robot.drive.chassis.left_radius_factor == 1.0
    plain = load(name).scenario.networks[0].robot[0]
    assert (robot.reference, robot.controller, robot.start_error_x_cm) == (
        plain.reference,
        plain.controller,
        plain.start_error_x_cm,
    )
    assert robot.drive.chassis.mass_kg == (0.6 if disturbed else 0.5)  # a robot, not a disturbance


@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_realistic_is_the_defaults_and_so_the_built_in_scenarios(name):
    mass = ["network.robot.drive.chassis.mass_kg=0.6"]
    assert load(name, [*DISTURBED, "variant=realistic"]).scenario == load(name, mass).scenario
    assert load(name, ["variant=ideal", "variant=realistic"]).scenario == load(name).scenario


def test_a_setting_after_the_variant_wins():
    scenario = load("fig6", ["variant=ideal", "camera.delay_frames=2", "network.radio.eb_n0_db=9"]).scenario
    assert scenario.camera == msgspec.structs.replace(EXACT, delay_frames=2)
    radio = scenario.networks[0].radio
    assert (radio.eb_n0_db, radio.bit_error_rate) == (9.0, None)


def test_what_is_no_disturbance_stays():
    kept = ["camera.window_px=40", "network.radio.channel=3", "network.radio.telemetry=false"]
    scenario = load("fig6", [*kept, "camera.calibration=exact", "variant=realistic"]).scenario
    assert scenario.camera == PixelCamera(window_px=40)
    assert (scenario.networks[0].radio.channel, scenario.networks[0].radio.telemetry) == (3, False)


def test_in_a_file_the_variant_fills_in_what_the_file_does_not_say():
    assert small('variant = "ideal"') == small("", settings=["variant=ideal"])
    found = small(
        'variant = "ideal"\ncamera = { kind = "gaussian", delay_frames = 1 }\nhost.compute_s = 0.002',
        "eb_n0_db = 9.0",
        "wheel_radius_mismatch = 0.02",
    )
    assert found.camera == msgspec.structs.replace(EXACT, delay_frames=1)
    assert found.host.compute_s == 0.002
    radio = found.networks[0].radio
    assert (radio.eb_n0_db, radio.bit_error_rate, radio.squelch) == (9.0, None, True)
    assert found.networks[0].robot[0].wheel_radius_mismatch == 0.02


def test_a_camera_of_another_kind_and_a_profile_in_a_file_are_what_the_file_says():
    pixels = 'variant = "ideal"\ncamera = { kind = "pixels", window_px = 40 }'
    found = small(pixels, 'profile = "fade15"')
    assert found.camera == PixelCamera(window_px=40)
    assert found.networks[0].radio.bit_error_rate == 1e-5


def test_on_the_command_line_a_variant_replaces_that_of_the_file():
    assert small('variant = "ideal"', settings=["variant=realistic"]) == small("")


@pytest.mark.parametrize(
    "settings",
    [["variant=ideal"], ["variant=ideal", "camera.delay_frames=1"], [*DISTURBED, "variant=ideal"]],
    ids=len,
)
def test_the_text_that_a_recording_keeps_of_a_variant_says_the_same(settings):
    loaded = load("fig8", settings)
    assert parse(loaded.text, "kept") == loaded.scenario


def test_another_name_is_refused_in_one_line():
    unknown = "'idael' is no variant; did you mean ideal? variants: ideal, realistic"
    assert refusal("variant=idael") == f"fig6: --set variant=idael: {unknown}"
    assert "--set variant=3: 3 is no variant; variants: ideal, realistic" in refusal("variant=3")
    with pytest.raises(ScenarioError, match=r"small: variant: 'x' is no variant"):
        small('variant = "x"')
    with pytest.raises(ScenarioError, match=r"network"):
        parse('name = "a"\nduration_s = 1.0\nnetwork = 3', "odd", ["variant=ideal"])


def test_the_command_line_lists_them():
    done = CliRunner().invoke(main, ["scenarios", "variants"], env={"COLUMNS": "300"})
    assert done.exit_code == 0
    assert "ideal" in done.output
    assert "realistic" in done.output
    assert "wheel_radius_mismatch = 0.0" in done.output
