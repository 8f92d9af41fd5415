"""The plan of a campaign: every run as a job that any worker can do, checked before anything runs.

Each level of each factor, and both ends of each drawn range, are tried once, with the first level of the others: so a
key that does not exist is found before the first run. A combination that cannot be run is a row with its error.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from miro_exact import engine
from miro_exact.bad_input import BadInput
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import builtin_names, load
from miro_sim.scenario.settings import EXPECT, OPTION, option_words
from mirotwin.campaign.columns import CHECK, FIGURES, OWN
from mirotwin.campaign.design import Design, DesignPoint, Factor, Level, Value
from mirotwin.campaign.file import CampaignFile, parse, read
from mirotwin.campaign.single import prepared
from mirotwin.campaign.versions import Versions, versions
from mirotwin.campaign.worker import ImageFile, Work
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.steps.keys import CheckStep
from mirotwin.verify.steps.player import check_symbols

OWN_IMAGE = "own"


class Plan(msgspec.Struct, frozen=True):
    """A campaign that can be run. `scenarios` (whole texts), `images`: by the names and paths that the file uses.

    `checks`: names of all checks, in the order in which they are met. `notes`: what settings left out, a line each.
    """

    file: CampaignFile
    scenarios: Mapping[str, str]
    images: Mapping[str, ImageFile]
    checks: tuple[str, ...]
    versions: Versions
    notes: tuple[str, ...] = ()

    @property
    def design(self) -> Design:
        return self.file.design

    @property
    def runs(self) -> int:
        return self.design.runs

    @property
    def hash(self) -> str:
        """What two campaigns with the same rows have in common, but for the versions."""
        content = (
            self.scenarios[self.file.scenario],
            [text for _, text in sorted(self.scenarios.items())],
            [image.sha256 for _, image in sorted(self.images.items())],
            self.file.settings,
            _nameless(self.design),
            self.checks,
        )
        return hashlib.sha256(msgspec.json.encode(content)).hexdigest()

    def work(self, run: int) -> Work:
        """The job of run number `run`."""
        return self.work_at(run, self.design.point(run))

    def work_at(self, run: int, point: DesignPoint) -> Work:
        scenario, image = self.file.scenario, self.file.firmware
        for level in point.levels:
            scenario = level.scenario or scenario
            image = level.firmware or image
        settings = [setting for setting, _ in self.file.settings]
        return Work(
            run=run,
            origin=scenario,
            text=self.scenarios[scenario],
            settings=(*settings, *self.design.settings(point)),
            seed=point.seed,
            firmware=self.images[image],
            engine=engine.active(),
            versions=self.versions,
        )

    def varied(self, run: int) -> dict[str, Value]:
        """The columns of a run that its plan says."""
        point = self.design.point(run)
        found: dict[str, Value] = {
            factor.name: level.value for factor, level in zip(self.design.factors, point.levels, strict=True)
        }
        found |= {draw.name: value for draw, value in zip(self.design.draws, point.drawn, strict=True)}
        if self.design.draws:
            found["draw"] = point.draw
        return {**found, "seed": point.seed}


def load_plan(path: str | Path, settings: Sequence[str] = ()) -> Plan:
    """The campaign of a file, with more `settings` (KEY=VALUE) for all runs. Raises BadInput with file and place."""
    return plan_of(read(Path(path)), settings)


def parse_plan(text: str, path: str | Path, settings: Sequence[str] = ()) -> Plan:
    """The campaign of a text, as if it stood at `path`. Raises BadInput with the place."""
    return plan_of(parse(text, Path(path)), settings)


def plan_of_levels(name: str, levels: Sequence[Level], seeds: range, settings: Sequence[str] = ()) -> Plan:
    """Each level with each seed, outside of any file: `name` stands for it in errors. Each has its scenario."""
    design = Design(seeds[0], len(seeds), (Factor("case", tuple(levels)),))
    return plan_of(CampaignFile(name, levels[0].scenario, "", (), 0.0, design), settings)


def plan_of(file: CampaignFile, settings: Sequence[str] = ()) -> Plan:
    """Looks at everything that the runs need. Raises BadInput with the place in the file."""
    made = tuple((text, " ".join(option_words(text))) for text in settings)
    file = msgspec.structs.replace(file, settings=(*file.settings, *made))
    for name in file.design.names:
        if name in OWN or name in FIGURES or name.startswith(CHECK):
            raise BadInput(file.path, name, "is the name of a column of the results", "choose another name")
    for setting, place in file.settings:
        key = setting.partition("=")[0].strip()
        if key in file.design.names:
            what = f"the campaign varies {key}, this would have no effect"
            raise BadInput(file.path, place, what, "leave it out, or the key in the campaign's file")
    plan = Plan(file, _scenarios(file), _images(file), (), versions())
    tried = _Tried(plan)
    return msgspec.structs.replace(plan, checks=tuple(tried.checks), notes=tuple(tried.notes))


def _scenarios(file: CampaignFile) -> dict[str, str]:
    found = {}
    for name, place in _named(file, file.scenario, "scenario"):
        try:
            own = ("expect={}",) if name in builtin_names() else ()  # a campaign varies what it presupposes
            found[name] = load(name, own).text
        except ScenarioError as error:
            raise BadInput(file.path, place, f"{error}") from None
    return found


def _images(file: CampaignFile) -> dict[str, ImageFile]:
    found = {}
    for name, place in _named(file, file.firmware, "firmware"):
        path = "" if name == OWN_IMAGE else name
        try:
            found[name] = ImageFile(path, load_firmware(path).sha256 or "")
        except BadInput as error:
            raise BadInput(file.path, place, f"{error}") from None
    return found


def _named(file: CampaignFile, default: str, kind: str) -> Iterator[tuple[str, str]]:
    """Names or paths of scenarios or images, and the place that says each."""
    yield default, kind
    for factor in file.design.factors:
        for level in factor.levels:
            name = level.scenario if kind == "scenario" else level.firmware
            if name:
                yield name, level.place


class _Tried:
    """Each level, tried once: the names of all `checks`, and what settings left out. Raises BadInput with the place."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.checks: dict[str, None] = {}
        self.notes: dict[str, None] = {}
        design = plan.design
        first = [factor.levels[0] for factor in design.factors]
        drawn = [draw.ends()[0] for draw in design.draws]
        self._try(first, drawn)
        for at, factor in enumerate(design.factors):
            for level in factor.levels[1:]:
                self._try([*first[:at], level, *first[at + 1 :]], drawn)
        for at, draw in enumerate(design.draws):
            for value in draw.ends()[1:]:
                self._try(first, [*drawn[:at], value, *drawn[at + 1 :]])

    def _try(self, levels: Sequence[Level], drawn: Sequence[Value]) -> None:
        point = DesignPoint(tuple(levels), tuple(drawn), 0, self.plan.design.first_seed)
        job = self.plan.work_at(0, point)
        try:
            text, expected, steps = prepared(job.origin, job.text, job.settings)
            check_symbols(steps, load_firmware(job.firmware.path), job.origin)
        except BadInput as error:
            raise _placed(self.plan, point, error) from error.__cause__
        for checks in expected.values():
            self.checks |= dict.fromkeys(check.name for check in checks)
        for step in steps:
            if isinstance(step, CheckStep):
                self.checks |= dict.fromkeys(check.name for check in step.checks)
        places = _places(self.plan, point)
        self.notes |= dict.fromkeys(_placed_note(self.plan, places, note) for note in text.notes)


def _places(plan: Plan, point: DesignPoint) -> dict[str, str]:
    """What says each setting of a run: a place in the campaign's file, or an option."""
    places = dict(plan.file.settings)
    places |= {setting: level.place for level in point.levels for setting in level.settings}
    for draw, value in zip(plan.design.draws, point.drawn, strict=True):
        places[draw.setting(value)] = f"random.range.{draw.name}"
    return places


def _placed_note(plan: Plan, places: dict[str, str], note: str) -> str:
    """The same note at the place of the campaign's file that made the setting."""
    for setting, place in places.items():
        head = f"{OPTION} {setting} "
        if note.startswith(head) and not place.startswith(OPTION):
            return f"{plan.file.path}: {place}: {setting} {note.removeprefix(head)}"
    return note


def _placed(plan: Plan, point: DesignPoint, error: BadInput) -> BadInput:
    """The same error at the place of the campaign file that made it; the whole line where no single place did."""
    places = _places(plan, point)
    text = f"{error.place}".removeprefix(f"{OPTION} ")
    if f"{error.place}".startswith("--expect "):
        text = EXPECT + f"{error.place}".removeprefix("--expect ")
    for setting in (text, *places):
        if setting not in places:
            continue
        key = setting.partition("=")[0]
        if setting == text or f"{error.place}" == key:
            what = f"{setting} in {error.path}: {error.what}"
            return BadInput(plan.file.path, places[setting], what, error.remedy)
    return BadInput(plan.file.path, "", f"{error}")


def _nameless(design: Design) -> Design:
    """The design without what has no influence on a run: where the file says something, and where an image stands."""
    factors = tuple(
        msgspec.structs.replace(
            factor,
            levels=tuple(
                msgspec.structs.replace(level, place="", scenario="", firmware="") for level in factor.levels
            ),
        )
        for factor in design.factors
    )
    return msgspec.structs.replace(design, factors=factors)
