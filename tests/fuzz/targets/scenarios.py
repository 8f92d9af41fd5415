"""What people write to say what runs: scenarios with steps and expectations, settings, cases, URLs."""

from urllib.parse import quote

import tomli_w

from miro_exact.bad_input import BadInput
from miro_exact.domain import DomainError
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import decode, of_table, of_text, parse
from miro_sim.scenario.keys import without_expectations
from miro_sim.world.world import World
from mirotwin.ports.url import parse_url
from mirotwin.runs.job import load_job
from mirotwin.verify.cases.case import tables_of
from mirotwin.verify.checks.expect import expectations_in
from mirotwin.verify.steps.reading import steps_in
from tests.fuzz.target import Target, always, folder, refused
from tests.fuzz.targets.captures import STREAM_WORDS
from tests.mirotwin.conftest import SHORT

_ORIGIN = "fuzz.toml"


def _read(text, settings):
    """The scenario with what it expects and its steps, as `run` reads it."""
    found = of_text(text, _ORIGIN, settings)
    expectations_in(found)
    steps_in(found)
    return found.scenario


def _scenario(data):
    try:
        found = _read(decode(data, _ORIGIN), ())
    except ScenarioError as error:
        return refused(error)
    tables = tables_of(found)
    assert of_table(tables, "again") == without_expectations(found), "of its own tables, the scenario differs"
    assert parse(tomli_w.dumps(tables), "written") == without_expectations(found), (
        "written, the scenario differs"
    )
    return f"taken, {min(len(found.networks), 3)} networks, {min(len(found.step), 3)} steps"


def _settings(data):
    settings = data.decode("utf-8", "surrogateescape").split("\n")
    try:
        found = _read(SHORT, settings[:8])
    except ScenarioError as error:
        return refused(error)
    assert _read(SHORT, settings[:8]) == found
    return "taken"


def _world():
    """A scenario that is accepted makes a world, which runs or says with which numbers nothing can be computed."""
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


def _case(data):
    """Stream files as `replay` takes them, up to the world that is to run."""
    path = folder() / "fuzz.stream"
    path.write_bytes(data)
    try:
        job = load_job(str(path))
    except BadInput as error:
        return refused(error)
    if sum(len(network.robot) for network in job.spec.scenario.networks) > 10:
        return "too many robots for here"
    try:
        job.spec.world()
    except (BadInput, DomainError) as error:
        return refused(error)
    return f"taken, {min(len(job.spec.script), 3)} in the script, case {bool(job.case.verdict)}"


def _url(data):
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


_KEYS = (
    b'[[network]]\n|[[network.robot]]\n|[[step]]\n|[expect]\n|slot = |reference.kind = |"line"|"eight"|'
    b'law.kind = |estimator.kind = |camera.kind = |"pixels"|drive.|radio.|radio.profile = |variant = |scenario = |'
    b"duration_s = |wait_for = |send = |ball = |obstacle|within_ms = |check = {|= true|1e308|-1|0.0"
).split(b"|")

TARGETS = {
    "scenario": Target(
        "scenarios with steps and expectations, written again", always(_scenario), words=_KEYS
    ),
    "settings": Target("--set KEY=VALUE", always(_settings), most_bytes=512, words=_KEYS),
    "startup": Target("an accepted scenario becomes a world that begins to run", _world, words=_KEYS),
    "case": Target("stream files as `replay` takes them", always(_case), words=STREAM_WORDS + _KEYS),
    "url": Target("miro:// URLs", always(_url), most_bytes=256, words=b"&set= limit_s= %26 .toml".split()),
}
