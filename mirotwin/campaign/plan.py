"""The plan of a campaign: every run as a job that any worker can do, checked before anything runs.

Each level of each factor, and both ends of each drawn range, are checked once with the first level of the other
factors, so an unknown key is reported before the first run. A combination that cannot be run is a row with its error.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import replace

from miro_exact import engine
from miro_exact.bad_input import BadInput
from miro_sim.scenario.board_scenario import FIRMWARE, AnyText, BoardText, is_board, load_any
from miro_sim.scenario.file import builtin_names
from miro_sim.scenario.plugins import plugins_used
from miro_sim.scenario.settings import OPTION, option_words
from mirotwin.campaign.columns import BOARD_FIGURES, CHECK, FIGURES, OWN, place_of, step_column
from mirotwin.campaign.design import Design, DesignPoint, Factor, Level, Value, as_kind, kind_of
from mirotwin.campaign.single import image_of, prepared
from mirotwin.campaign.versions import Versions, versions
from mirotwin.campaign.worker import ImageCopy, Work
from mirotwin.runs.spec import RunSpec
from mirotwin.shell.firmware_image import image_for
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.options import plain_parameters
from mirotwin.shell.plugin_files import PluginFiles
from mirotwin.verify.steps.keys import CheckStep, Step, WaitStep
from mirotwin.verify.steps.player import check_symbols

if TYPE_CHECKING:
    from miro_sim.world.world import World

OWN_IMAGE = "own"
FORM = 1


class Head(msgspec.Struct, frozen=True):
    """Which campaign outcomes and results belong to. `mirotwin_campaign`: the form of such files."""

    mirotwin_campaign: int
    hash: str
    versions: Versions
    runs: int

    def difference(self, other: Head) -> str:
        """The difference to another campaign in words; "" where there is none."""
        if self.mirotwin_campaign != other.mirotwin_campaign:
            return f"form {other.mirotwin_campaign} of such files instead of {self.mirotwin_campaign}"
        return self.versions.difference(other.versions) or (
            "other runs: scenario, keys, seeds, checks or firmware differ" if self.hash != other.hash else ""
        )


class Plan(msgspec.Struct, frozen=True):
    """A campaign. From its file: `path`, for errors; `settings` of all runs, each with its place in the file; `values`:
    the values of a board's parts in the rows, by PART.KEY. `plugins`: from the command line.

    Added by `checked`: `scenarios` (whole texts) and `images`, by the names and paths in the file, a board's image by
    its scenario; `checks`: names of all checks, in order of appearance; `figures`: columns of the rows and their types;
    `notes`: keys that settings left out, a line each.
    """

    path: str
    scenario: str
    design: Design
    firmware: str = ""
    settings: tuple[tuple[str, str], ...] = ()
    allowed_failed_share: float = 0.0
    values: tuple[str, ...] = ()
    plugins: PluginFiles = PluginFiles()
    scenarios: Mapping[str, str] = {}
    images: Mapping[str, ImageCopy] = {}
    checks: tuple[str, ...] = ()
    figures: Mapping[str, type] = {}
    versions: Versions = msgspec.field(default_factory=versions)
    notes: tuple[str, ...] = ()

    @property
    def runs(self) -> int:
        return self.design.runs

    @property
    def hash(self) -> str:
        """The hash of everything that decides the campaign's rows, but for the versions."""
        design = self.design
        content = (
            self.scenarios[self.scenario],
            [text for _, text in sorted(self.scenarios.items())],
            [image.sha256 for _, image in sorted(self.images.items())],
            self.settings,
            replace(design, factors=()),
            [
                (factor.name, [(level.value, level.settings) for level in factor.levels])
                for factor in design.factors
            ],
            self.checks,
            *([self.values] if self.values else []),
        )
        return hashlib.sha256(json_bytes(content)).hexdigest()

    @property
    def head(self) -> Head:
        return Head(FORM, self.hash, self.versions, self.runs)

    def work(self, run: int) -> Work:
        """The job of run number `run`."""
        return self.work_at(run, self.design.point(run))

    def work_at(self, run: int, point: DesignPoint) -> Work:
        scenario, image = self.scenario, self.firmware
        for level in point.levels:
            scenario = level.scenario or scenario
            image = level.firmware or image
        if image in ("", OWN_IMAGE) and scenario in self.images:
            image = scenario
        settings = [setting for setting, _ in self.settings]
        return Work(
            run=run,
            origin=scenario,
            text=self.scenarios[scenario],
            settings=(*settings, *self.design.settings(point)),
            seed=point.seed,
            firmware=self.images[image],
            engine=engine.active(),
            versions=self.versions,
            values={path: self.figures[path] for path in self.values if path in self.figures},
            brought=msgspec.structs.asdict(self.plugins),
        )

    def varied(self, run: int) -> dict[str, Value]:
        """The columns of a run that its plan gives: factors, drawn keys, number of the draw, and seed."""
        point = self.design.point(run)
        levels: dict[str, Value] = {
            factor.name: level.value for factor, level in zip(self.design.factors, point.levels, strict=True)
        }
        for draw, value in zip(self.design.draws, point.drawn, strict=True):
            levels[draw.name] = as_kind(value, kind_of(draw.ends()))
        if self.design.draws:
            levels["draw"] = point.draw
        return {**levels, "seed": point.seed}


def plan_of_levels(name: str, levels: Sequence[Level], seeds: range, settings: Sequence[str] = ()) -> Plan:
    """A plan without a file: each level with each seed. `name` is used in errors. Each level has its scenario."""
    design = Design(seeds[0], len(seeds), (Factor("case", tuple(levels)),))
    return checked(Plan(name, levels[0].scenario, design), settings)


def checked(plan: Plan, settings: Sequence[str] = ()) -> Plan:
    """The plan with more `settings` for all runs, and with all that they need. Raises BadInput with the place."""
    made = tuple((text, " ".join(option_words(text))) for text in settings)
    plan = replace(plan, settings=(*plan.settings, *made))
    for setting, place in plan.settings:
        key = setting.partition("=")[0].strip()
        if key in plan.design.names:
            reason = f"the campaign varies {key}, this would have no effect"
            raise BadInput(plan.path, place, reason, "leave it out, or the key in the campaign's file")
    texts = _scenarios(plan)
    named = replace(plan, scenarios={name: text.text for name, text in texts.items()})
    made_plan = _tried(replace(named, images=_images(plan, texts)))
    for name in plan.design.names:
        if name in OWN or name in made_plan.figures or name.startswith(CHECK):
            raise BadInput(plan.path, name, "is the name of a column of the results", "choose another name")
    return made_plan


def _tried(plan: Plan) -> Plan:
    """The plan with the names of all checks and the notes of settings. Raises BadInput with the place in the file."""
    checks: dict[str, None] = {}
    plugins: set[str] = set()
    notes: dict[str, None] = {}
    figures: dict[str, type] = {}
    for point in _tried_points(plan.design):
        places = _places(plan, point)
        job = plan.work_at(0, point)
        try:
            text, expected, steps = prepared(job.origin, job.text, job.settings)
            if isinstance(text, BoardText) and text.firmware:
                remedy = "write firmware = .. at the top of the campaign's file, or in its [grid]"
                raise BadInput(job.origin, FIRMWARE, "is no key that is set", remedy)
            check_symbols(steps, image_of(job.firmware), job.origin)
        except BadInput as error:
            raise _placed(plan, places, error) from error.__cause__
        figures |= _figures(plan, text, steps, job)
        plugins.update(plugins_used(text.scenario))
        of_steps = [step.checks for step in steps if isinstance(step, CheckStep)]
        checks |= {check.name: None for group in (*expected.values(), *of_steps) for check in group}
        notes |= {_placed_note(plan, places, note): None for note in text.notes}
    used = replace(plan.versions, parts=tuple(sorted(plugins)))
    ordered = {name: figures[name] for name in sorted(figures, key=place_of)}
    return replace(plan, checks=tuple(checks), figures=ordered, notes=tuple(notes), versions=used)


def _figures(plan: Plan, text: AnyText, steps: Sequence[Step], job: Work) -> dict[str, type]:
    """The columns of a run and their types. Raises BadInput for values that its board does not have."""
    figures = dict(BOARD_FIGURES if isinstance(text, BoardText) else FIGURES)
    if isinstance(text, BoardText):
        figures |= {step_column(step.number): float for step in steps if isinstance(step, WaitStep)}
    if plan.values:
        if not isinstance(text, BoardText):
            problem = f"are of a board's parts, and {text.origin} is for robots"
            raise BadInput(plan.path, "values", problem, "leave them out")
        with BadInput.at(plan.path, "values"), plain_parameters(text.origin):
            figures |= _kinds_of_values(RunSpec.of(text, image_of(job.firmware)).world(), plan.values)
    return figures


def _kinds_of_values(world: World, paths: Sequence[str]) -> dict[str, type]:
    """The types of columns for these values of parts, by those at power-on: all numbers share one. Raises BadInput."""
    board = world.device(0, 0)
    kinds: dict[str, type] = {}
    for path in paths:
        try:
            kind = type(board.value(path))
        except ValueError as error:
            reason, _, remedy = f"{error}".partition("; ")
            raise BadInput("", "", reason, remedy) from None
        kinds[path] = kind if kind in (bool, str) else float
    return kinds


def _tried_points(design: Design) -> Iterator[DesignPoint]:
    """Design points to check: the first level of all factors, then each other level and range end with the others'
    first.
    """
    tried: list[Sequence[Any]] = [factor.levels for factor in design.factors]
    tried += [draw.ends() for draw in design.draws]
    points = [[trial[0] for trial in tried]]
    for index, others in enumerate(tried):
        points += [[*points[0][:index], other, *points[0][index + 1 :]] for other in others[1:]]
    for point in points:
        levels, drawn = point[: len(design.factors)], point[len(design.factors) :]
        yield DesignPoint(tuple(levels), tuple(drawn), 0, design.first_seed)


def _scenarios(plan: Plan) -> dict[str, AnyText]:
    """The scenarios by their names: all of robots, or all of boards."""
    texts: dict[str, AnyText] = {}
    for name, place in _named(plan, plan.scenario, "scenario"):
        with BadInput.at(plan.path, place):
            if is_board(name):
                remedy = f'write a NAME.scenario.toml with board = "{Path(name).name}" and duration_s'
                raise BadInput("", "", f"{name} is a board, which has no duration", remedy)
        try:
            own = ("expect={}",) if name in builtin_names() else ()  # a campaign varies what it presupposes
            text = load_any(name, own)
            # whole, so the text need not say where its file is: the same campaign elsewhere has the same
            texts[name] = replace(text, origin=Path(name).name) if isinstance(text, BoardText) else text
        except BadInput as error:
            raise BadInput(plan.path, place, f"{error}") from None
        if type(texts[name]) is not type(texts[plan.scenario]):
            problem = (
                f"of {name} and {plan.scenario} one is for a board and one for robots, whose columns differ"
            )
            raise BadInput(plan.path, place, problem, "make a campaign of each")
    return texts


def _images(plan: Plan, texts: Mapping[str, AnyText]) -> dict[str, ImageCopy]:
    """The images by their names, that of a board by its scenario: which images fit depends on the chip."""
    copies = {}
    for name, place in _named(plan, plan.firmware, "firmware"):
        path = None if name in ("", OWN_IMAGE) else name
        for scenario, text in texts.items():
            try:
                image = image_for(text, path)
            except BadInput as error:
                raise BadInput(plan.path, place, f"{error}") from None
            names = {name: (at.address, at.space) for name, at in image.symbols.names.items()}
            copy = ImageCopy(f"{image.path}", image.sha256, image.content, json_bytes(names))
            copies[scenario if path is None and isinstance(text, BoardText) else name] = copy
    return copies


def _named(plan: Plan, default: str, kind: str) -> Iterator[tuple[str, str]]:
    """Yields scenario or image (name or path) and its place in the file."""
    yield default, kind
    for factor in plan.design.factors:
        for level in factor.levels:
            name = level.scenario if kind == "scenario" else level.firmware
            if name:
                yield name, level.place


def _places(plan: Plan, point: DesignPoint) -> dict[str, str]:
    """The origin of each setting of a run: a place in the campaign's file, or an option."""
    places = dict(plan.settings)
    places |= {setting: level.place for level in point.levels for setting in level.settings}
    for draw, value in zip(plan.design.draws, point.drawn, strict=True):
        places[draw.setting(value)] = f"random.range.{draw.name}"
    return places


def _placed_note(plan: Plan, places: dict[str, str], note: str) -> str:
    """`note`, with the place in the campaign's file that made the setting which it names."""
    for setting, place in places.items():
        head = f"{OPTION} {setting} "
        if note.startswith(head) and not place.startswith(OPTION):
            return f"{plan.path}: {place}: {setting} {note.removeprefix(head)}"
    return note


def _placed(plan: Plan, places: dict[str, str], error: BadInput) -> BadInput:
    """`error`, at the place of the campaign's file that made it; with its whole line where no single place did."""
    key = f"{error.place}"
    for setting, place in places.items():
        if key in (" ".join(option_words(setting)), setting.partition("=")[0]):
            return BadInput(plan.path, place, f"{setting} in {error.path}: {error.what}", error.remedy)
    return BadInput(plan.path, "", f"{error}")
