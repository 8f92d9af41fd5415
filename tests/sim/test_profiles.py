"""Radio profiles in scenarios: which key wins, what is refused and how, and what a run makes of them."""

import re
from pathlib import Path

import msgspec
import pytest
from click.testing import CliRunner

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_sim.radio.params import Bursts
from miro_sim.scenario import profiles
from miro_sim.scenario.file import ScenarioError, parse
from mirotwin.commands import main
from tests.sim.world.rig import world_of
from tests.states import snapshot

README = Path(__file__).parents[2] / "sim/miro_sim/radio/README.md"
NETWORK = """
[[network]]
[network.radio]
{}
[[network.robot]]
slot = 0
reference.kind = "line"
"""


def text(*radios):
    head = 'name = "air"\nduration_s = 0.5\ncamera.kind = "gaussian"\n'
    return head + "".join(NETWORK.format(radio) for radio in radios)


def radio(lines):
    return parse(text(lines), "air.toml").networks[0].radio


def refusal(lines):
    with pytest.raises(ScenarioError) as caught:
        radio(lines)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix("air.toml: network[0].radio")


def test_everything_is_off_unless_asked_for():
    """Only what every scenario has had: errors of 1e-4, a key-up, noise between frames."""
    params = msgspec.structs.asdict(radio(""))
    names = ("jitter_s", "baud_offset_ppm", "crystal_offset_ppm", "false_starts_hz", "lost_character_rate")
    assert [params[name] for name in names] == [0] * len(names)
    assert (params["bursts"], params["dropouts"], params["slicer"]) == (None, None, None)


def test_a_profile_sets_its_keys():
    found = radio('profile = "fade15"')
    assert found.bursts == Bursts(good_to_bad=9.8e-5, bad_to_good=3.1e-3, bit_error_rate=0.5)
    assert found.bit_error_rate == 1e-5


def test_a_key_of_the_scenario_wins_over_the_profiles_also_inside_a_table():
    found = radio('profile = "fade15"\nbit_error_rate = 0.0\nbursts.bad_to_good = 0.5')
    assert found.bit_error_rate == 0.0
    assert found.bursts == Bursts(good_to_bad=9.8e-5, bad_to_good=0.5, bit_error_rate=0.5)


def test_of_several_profiles_the_later_one_wins():
    found = radio('profile = ["fade15", "late", "weak"]')
    assert (found.jitter_s, found.eb_n0_db, found.bit_error_rate) == (0.003, 10.94, None)
    assert found.bursts is not None
    assert radio('profile = ["weak", "fade15"]').eb_n0_db is None


def test_a_bit_error_rate_takes_the_place_of_a_profiles_signal_to_noise_ratio():
    assert radio('profile = "weak"\nbit_error_rate = 0.01').eb_n0_db is None


@pytest.mark.parametrize("name", profiles.tables_of("profile"))
def test_every_profile_is_a_good_radio_that_says_what_it_does(name):
    radio(f'profile = "{name}"')
    assert profiles.tables_of("profile")[name]["about"]
    assert f"`{name}`" in README.read_text()


CRYSTAL = ".crystal_offset_ppm:"
TOO_SHORT = "every_s = 0.000105, length_s = 0.000105", "every_s = 0.0002, length_s = 0.000106"


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ('profile = "fade16"', ".profile: 'fade16' is no profile; did you mean fade15?"),
        ('profile = ["late", "nothing"]', ".profile: 'nothing' is no profile; profiles: wire, late,"),
        (
            "profile = 3",
            ".profile: expected a name or a list of names, got 3; see `mirotwin scenarios profiles",
        ),
        ("eb_n0_db = 11.0\nbit_error_rate = 0.0", ".eb_n0_db: sets the same as bit_error_rate; give one of"),
        ("eb_n0 = 11.0", ".eb_n0: unknown key; use eb_n0_db, in decibels"),
        ("jitter_ms = 1", ".jitter_ms: unknown key; use jitter_s, in seconds"),
        ("baud_offset_hz = 3", ".baud_offset_hz: unknown key; use baud_offset_ppm, in parts per million"),
        (
            "crystal_offset_ppm = 60000",
            f"{CRYSTAL} 60000 is out of range; must be -50000 to 50000 in parts per",
        ),
        ("crystal_offset_ppm = 0.5", f"{CRYSTAL} expected a whole number in parts per million, got"),
        ("eb_n0_db = '11 dB'", ".eb_n0_db: expected a number in decibels, got a string ('11 dB')"),
        ("false_starts_hz = -1.0", ".false_starts_hz: -1.0 is out of range; must be 0 to 9600 in hertz"),
        (
            "slicer.offset = 0.5",
            ".slicer: its bit errors follow from Eb/N0; give eb_n0_db, not bit_error_rate",
        ),
        ("slicer.settle_ms = 4", ".slicer.settle_ms: unknown key; use settle_s, in seconds"),
        ("bursts.good_to_bad = 0.1", ".bursts.bad_to_good: this key is missing; add it"),
        (
            "bursts = { good_to_bad = -1e-9, bad_to_good = 0.5 }",
            ".bursts.good_to_bad: -1e-09 is out of range; must be 0 to 1",
        ),
        (
            "bursts = { good_to_bad = 0.7, bad_to_good = 0.7 }",
            ".bursts.bad_to_good: 0.7 and good_to_bad 0.7 make more than 1; a state must last",
        ),
        (
            "dropouts = { every_s = 1, length_s = 0 }",
            ".dropouts.length_s: 0.0 is out of range; must be 0.000105 to",
        ),
        *((f"dropouts = {{ {pair} }}", ".dropouts") for pair in TOO_SHORT),
        ("lost_character_rate = 1.5", ".lost_character_rate: 1.5 is out of range; must be 0 to 1"),
        ("latency_s = -1e-9", ".latency_s: -1e-09 is out of range; must be 0 to 0.03 in seconds"),
        ("keyup_s = 1.0", ".keyup_s: 1.0 is out of range; must be 0 to 0.03 in seconds"),
        ("bit_error_rate = 0.6", ".bit_error_rate: 0.6 is out of range; must be 0 to 0.5"),
        ("slicer.settle_s = 0.0001", ".slicer.settle_s: 0.0001 is out of range; must be 0.000105 to 1"),
        ("slicer.offset = 1.1", ".slicer.offset: 1.1 is out of range; must be -1 to 1"),
        ("channel = -1", ".channel: -1 is out of range; must be 0 to 999"),
    ],
)
def test_a_bad_radio_is_named_with_its_place_and_its_remedy(lines, expected):
    assert refusal(lines).startswith(expected)


def test_profiles_that_contradict_are_named_with_the_key_and_the_ways_out():
    needed = ".profile: slicer needs eb_n0_db, and fade15 sets bit_error_rate in its place;"
    remedy = " leave one of them out, name slicer after fade15, or give eb_n0_db"
    assert refusal('profile = ["slicer", "fade15"]') == needed + remedy
    assert radio('profile = ["fade15", "slicer"]').eb_n0_db == 13.35
    assert radio('profile = ["slicer", "fade15"]\neb_n0_db = 12.0').eb_n0_db == 12.0


def test_a_key_that_contradicts_a_profile_is_named_with_it():
    needed = ".profile: slicer needs eb_n0_db, and bit_error_rate is given in its place;"
    remedy = " leave one of them out, or give eb_n0_db instead"
    assert refusal('profile = "slicer"\nbit_error_rate = 0.01') == needed + remedy


@pytest.mark.parametrize("first", profiles.tables_of("profile"))
def test_two_profiles_go_together_or_are_both_named(first):
    for second in profiles.tables_of("profile"):
        try:
            radio(f'profile = ["{first}", "{second}"]')
        except ScenarioError as error:
            said = str(error).removeprefix("air.toml: network[0].radio.profile: ")
            assert {first, second} <= set(re.findall(r"\w+", said))


def test_a_pc_so_slow_that_its_frame_outlasts_the_period_is_refused():
    for ppm, expected in ((-40000, "baud_offset_ppm: -40000 makes"), (-3000, "keyup_s: 0.001 s and")):
        slow = text(f"baud_offset_ppm = {ppm}").replace("[[network]]", "[[network]]\nrobots = 5", 1)
        with pytest.raises(ScenarioError, match=rf"network\[0\]\.radio\.{expected} a frame of 31"):
            parse(slow, "air.toml")


def test_the_command_line_lists_the_profiles_with_their_keys():
    result = CliRunner().invoke(main, ["scenarios", "profiles"])
    assert result.exit_code == 0
    listed = re.sub(r"\s+", " ", result.stdout)
    assert "fade15 fading with 15 dB" in listed
    for name in profiles.tables_of("profile"):
        assert name in result.stdout


def world(*radios):
    return world_of(text(*radios))


def ran(world, periods=6):
    for _ in range(periods):
        world.step()
    return world


ALL = 'profile = ["late", "slicer", "dropouts", "offset", "clicks", "lossy"]\neb_n0_db = 12.0'
BURSTS = "bursts = { good_to_bad = 0.002, bad_to_good = 0.01 }"


def test_a_run_with_everything_on_is_the_same_however_it_is_cut_saved_and_loaded():
    radios = ALL, f"{ALL}\nchannel = 1\n{BURSTS}", "channel = 1\nlatency_s = 0.01"
    whole, cut = ran(world(*radios)), world(*radios)
    for tick in range(0, 6 * CONTROL_PERIOD_TICKS, 333_333):
        cut.run_to(tick)
        again = world(*radios)
        again.load(cut.save())
        cut = again
    cut.run_to(6 * CONTROL_PERIOD_TICKS)
    assert cut.digest == whole.digest
    assert cut.state.save() == whole.state.save()


def accepted(world):
    return [network.robots[0].counter(0) for network in world.networks]


def test_networks_side_by_side_do_not_know_of_each_other():
    """A network's robots have the same bits whether there is another one or not."""
    alone, beside = ran(world(BURSTS)), ran(world(BURSTS, ALL))
    assert snapshot(beside.networks[0]) == snapshot(alone.networks[0])


def test_networks_on_one_channel_spoil_each_others_frames():
    wire = 'profile = "wire"\nkeyup_s = 0.001'
    assert accepted(ran(world(wire, wire))) == [6, 6]
    assert accepted(ran(world(wire + "\nchannel = 1", wire + "\nchannel = 2"))) == [6, 6]
    shared = ran(world(wire + "\nchannel = 1", wire + "\nchannel = 1\nlatency_s = 0.007"))
    assert accepted(shared) == [0, 0]


def test_what_is_off_is_not_in_the_state():
    """Parts that a scenario does not have are not in its state."""
    plain = world("").state.decode(world("").state.save())
    assert not [path for path in plain if "slicer" in path or "overheard" in path]
    everything = world(ALL + "\nchannel = 1", "channel = 1")
    paths = set(everything.state.decode(everything.state.save()))
    assert "lines[0].downlink.listeners[0].slicer.mean" in paths
    assert "lines[0].downlink.overheard[0].transmissions" in paths
