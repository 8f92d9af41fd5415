"""What people write to say what runs: scenarios with steps and expectations, settings, cases, URLs."""

from tests.fuzz.target import Target, folder, refused
from tests.fuzz.targets.captures import STREAM_WORDS, stream_seeds

_ORIGIN = "fuzz.toml"


def _scenario():
    import tomli_w

    from miro_sim.scenario.errors import ScenarioError
    from miro_sim.scenario.file import decode, of_table, parse
    from miro_sim.scenario.keys import without_expectations
    from mirotwin.verify.cases.case import tables_of
    from mirotwin.verify.steps.reading import everything

    def run(data):
        try:
            found = parse(decode(data, _ORIGIN), _ORIGIN, (), everything)
        except ScenarioError as error:
            return refused(error)
        tables = tables_of(found)
        assert of_table(tables, "again") == without_expectations(found), (
            "of its own tables, the scenario differs"
        )
        assert parse(tomli_w.dumps(tables), "written") == without_expectations(found), (
            "written, the scenario differs"
        )
        return f"taken, {min(len(found.networks), 3)} networks, {min(len(found.step), 3)} steps"

    return run


def _settings():
    from miro_sim.scenario.errors import ScenarioError
    from miro_sim.scenario.file import parse
    from mirotwin.verify.steps.reading import everything
    from tests.mirotwin.conftest import SHORT

    def run(data):
        settings = data.decode("utf-8", "surrogateescape").split("\n")
        try:
            found = parse(SHORT, _ORIGIN, settings[:8], everything)
        except ScenarioError as error:
            return refused(error)
        assert parse(SHORT, _ORIGIN, settings[:8], everything) == found
        return "taken"

    return run


def _world():
    """A scenario that is accepted makes a world, which runs or says with which numbers nothing can be computed."""
    from miro_exact.bad_input import BadInput
    from miro_exact.domain import DomainError
    from miro_robot.firmware import image_path
    from miro_robot.image import load_hex
    from miro_sim.scenario.errors import ScenarioError
    from miro_sim.scenario.file import decode, parse
    from miro_sim.world.world import World

    image = load_hex(image_path())

    def run(data):
        try:
            found = parse(decode(data, _ORIGIN), _ORIGIN)
        except ScenarioError as error:
            return refused(error)
        if sum(len(network.robot) for network in found.networks) > 4:
            return "too many robots for here"
        try:
            world = World(found, 3, image)
            world.run_to(240_000)
            world.load(world.save())
        except (BadInput, DomainError) as error:
            return refused(error)
        return "ran"

    return run


def _case():
    """Stream files as `replay` takes them, up to the world that is to run."""
    import contextlib
    import io

    from miro_exact.bad_input import BadInput
    from miro_exact.domain import DomainError
    from mirotwin.rerun.job import load_job

    def run(data):
        path = folder() / "fuzz.stream"
        path.write_bytes(data)
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            try:
                job = load_job(str(path))
            except BadInput as error:
                return refused(error)
            assert all(line.isprintable() for line in said.getvalue().splitlines())
            if sum(len(network.robot) for network in job.scenario.networks) > 10:
                return "too many robots for here"
            try:
                job.world_of()
            except (BadInput, DomainError) as error:
                return refused(error)
        return f"taken, {min(len(job.script), 3)} in the script, case {bool(job.case.verdict)}"

    return run


def _url():
    from urllib.parse import quote

    from miro_exact.bad_input import BadInput
    from mirotwin.ports.url import parse_url

    def run(data):
        text = data.decode("utf-8", "replace")
        try:
            found = parse_url(text)
        except BadInput as error:
            return refused(error)
        words = [f"seed={found.seed}", f"network={found.network}", f"limit_s={found.limit_s!r}"]
        words += [f"{key}={quote(value)}" for key in ("firmware", "out") if (value := getattr(found, key))]
        words += [f"realtime={found.realtime!r}"] if found.realtime else []
        words += [f"set={quote(one)}" for one in found.settings]
        name = quote(found.scenario)
        assert parse_url(f"miro://{name}{'' if not words else '?'}{'&'.join(words)}") == found
        return f"taken, {min(len(words), 8)} options"

    return run


def scenario_seeds():
    from tests.mirotwin.conftest import SHORT
    from tests.mirotwin.mutated_files import STEPS

    expects = """name = "one"
duration_s = 0.5
stop_on_fault = true
variant = "realistic"
[expect]
inside_pitch = false
settles_within_s = { within_s = 0.4, position_cm = 2.0 }
[[network]]
robots = 5
host = "silent"
radio.profile = "shared"
[[network.robot]]
slot = 4
reference = { kind = "waypoints", points = [{ x_cm = 0, y_cm = 0 }, { x_cm = 20.0, y_cm = 10.0 }] }
law.kind = "pose"
estimator.kind = "predict"
expect.tracks_within_cm = 3.0
"""
    pixels = """name = "p"
duration_s = 1.0
camera = { kind = "pixels", lens = { k1 = -0.1 }, picture = { luma_noise = 1.0 } }
[[network]]
radio = { bit_error_rate = 1e-3, latency_s = 0.002, carrier = "on", squelch = true }
[[network.robot]]
slot = 0
reference.kind = "sine"
wheel_radius_mismatch = 0.01
"""
    return [
        SHORT.encode(),
        STEPS,
        expects.encode(),
        pixels.encode(),
        b'scenario = "fig6"\nduration_s = 0.1\n',
    ]


def _world_seeds():
    from miro_sim.scenario.file import builtin_names, builtin_text

    found = []
    for name in builtin_names():
        text = "\n".join(line for line in builtin_text(name).splitlines() if not line.startswith("#"))
        if len(text) < 1500:
            found.append(text.encode())
    return [*scenario_seeds(), *found]


def _settings_seeds():
    return [
        b"network.radio.latency_s=0.002\nduration_s=2",
        b"network[0].robot[0].reference={kind='line'}\nnetwork.robot.slot=1\ncamera.kind=pixels",
        b"expect.inside_pitch=false\nexpect.tracks_within_cm={position_cm=2}\nname=abc\nstep=[]",
    ]


def _url_seeds():
    return [
        b"miro://fig6?seed=7&set=network.radio.latency_s%3D0.002&realtime=1",
        b"MIRO:///tmp/my.toml?limit_s=6e1&out=x",
    ]


def _case_seeds():
    case = b"""# mirotwin stream 2
#: version = "0.1.0"
#: seed = 7
#: verdict = "no_fault: net0/robot0: tick 5"
#: end_tick = 6000000
#:
#: [expect]
#: no_fault = true
#:
#: [scenario]
#: name = "one"
#: duration_s = 1.0
#: [[scenario.network]]
#: host = "silent"
#: [[scenario.network.robot]]
#: slot = 1
#: reference.kind = "line"
1440120 > 55 55 ff!
1500000 *@0/1 reset 1
"""
    return [case, *stream_seeds()]


_KEYS = (
    b"[[network]]\n",
    b"[[network.robot]]\n",
    b"[[step]]\n",
    b"[expect]\n",
    b"slot = ",
    b"reference.kind = ",
)
_KEYS += (
    b'"line"',
    b'"eight"',
    b"law.kind = ",
    b"estimator.kind = ",
    b"camera.kind = ",
    b'"pixels"',
    b"drive.",
)
_KEYS += (
    b"radio.",
    b"radio.profile = ",
    b"variant = ",
    b"scenario = ",
    b"duration_s = ",
    b"wait_for = ",
    b"send = ",
)
_KEYS += (b"ball = ", b"obstacle", b"within_ms = ", b"check = {", b"= true", b"1e308", b"-1", b"0.0")

TARGETS = {
    "scenario": Target(
        "scenarios with steps and expectations, written again", _scenario, scenario_seeds, words=_KEYS
    ),
    "settings": Target("--set KEY=VALUE", _settings, _settings_seeds, most_bytes=512, words=_KEYS),
    "startup": Target(
        "an accepted scenario becomes a world that begins to run", _world, _world_seeds, words=_KEYS
    ),
    "case": Target("stream files as `replay` takes them", _case, _case_seeds, words=STREAM_WORDS + _KEYS),
    "url": Target(
        "miro:// URLs", _url, _url_seeds, most_bytes=256, words=(b"&set=", b"limit_s=", b"%26", b".toml")
    ),
}
