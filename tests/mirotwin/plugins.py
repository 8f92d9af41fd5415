"""Plug-ins that tests install: one of each kind that goes wrong in one way, and checks that do what they should."""

from tests.host.distribution import install

CHECKS = '''
from mirotwin.verify.checks.interface import Check, Monitor


class Raises(Check, frozen=True, kw_only=True, tag="raises"):
    KIND = "safety"

    def monitor(self, subject):
        return RaisesMonitor(self, subject)


class RaisesMonitor(Monitor):
    def period(self, record, tick):
        self.helper()

    def helper(self):
        raise RuntimeError("oh")


class GivesNone(Check, frozen=True, kw_only=True, tag="gives_none"):
    KIND = "safety"

    def monitor(self, subject):
        RaisesMonitor(self, subject)


class Hears(Check, frozen=True, kw_only=True, tag="hears_wrong"):
    KIND = "safety"

    def monitor(self, subject):
        return HearsMonitor(self, subject)


class HearsMonitor(Monitor):
    EVENTS = ("comand",)


class HearsText(Check, frozen=True, kw_only=True, tag="hears_text"):
    KIND = "safety"

    def monitor(self, subject):
        return HearsTextMonitor(self, subject)


class HearsTextMonitor(Monitor):
    EVENTS = "command"


class NoSuper(Check, frozen=True, kw_only=True, tag="no_super"):
    KIND = "safety"

    def monitor(self, subject):
        return NoSuperMonitor(self, subject)


class NoSuperMonitor(Monitor):
    def __init__(self, check, subject):
        pass


class NoKind(Check, frozen=True, kw_only=True, tag="no_kind"):
    def monitor(self, subject):
        return RaisesMonitor(self, subject)


class Objects(Check, frozen=True, kw_only=True, tag="objects"):
    KIND = "safety"

    def problem(self, end_tick):
        return 1 // 0

    def monitor(self, subject):
        return RaisesMonitor(self, subject)


class Leaves(Check, frozen=True, kw_only=True, tag="leaves"):
    KIND = "safety"

    def __post_init__(self):
        raise SystemExit(0)

    def monitor(self, subject):
        return RaisesMonitor(self, subject)


class FloatTick(Check, frozen=True, kw_only=True, tag="float_tick"):
    KIND = "safety"

    def monitor(self, subject):
        return FloatTickMonitor(self, subject)


class FloatTickMonitor(Monitor):
    def period(self, record, tick):
        self.fail(tick / 2, "one thing", "another")


class Still(Check, frozen=True, kw_only=True, tag="stands_still"):
    """The wheels are told nothing but to stop."""

    KIND = "safety"

    def monitor(self, subject):
        return StillMonitor(self, subject)


class StillMonitor(Monitor):
    EVENTS = ("frame",)

    def event(self, event):
        self.judged += 1
        self.fail(event.tick, "no frame", "one")
'''
LAWS = """
from miro_host.laws.interface import Law, LawParameters, Velocities


class Raises(LawParameters, frozen=True, tag="law_raises"):
    def law(self):
        return RaisesLaw(self)


class RaisesLaw(Law):
    def step(self, given):
        return {}["speed"]


class Nothing(LawParameters, frozen=True, tag="law_none"):
    def law(self):
        return None


class NoNumber(LawParameters, frozen=True, tag="law_nan"):
    def law(self):
        return NoNumberLaw(self)


class NoNumberLaw(Law):
    def step(self, given):
        return Velocities(float("nan"), 0.0)


class Breaks(LawParameters, frozen=True, tag="law_breaks"):
    def law(self):
        raise RuntimeError("no model file")


class Says(LawParameters, frozen=True, tag="law_says"):
    def __post_init__(self):
        raise ValueError("how: is refused")


class Refuses(LawParameters, frozen=True, tag="law_refuses"):
    def __post_init__(self):
        raise KeyError("x")
"""
REFERENCES = """
from miro_host.references.interface import ReferenceParameters


class Raises(ReferenceParameters, frozen=True, tag="reference_raises"):
    def trajectory(self, duration_s):
        return RaisesPath()


class RaisesPath:
    def at(self, t_s):
        return 1 / 0


class Nothing(ReferenceParameters, frozen=True, tag="reference_none"):
    def trajectory(self, duration_s):
        return None
"""
ESTIMATORS = """
from miro_host.estimators.interface import Estimator, EstimatorParameters


class Raises(EstimatorParameters, frozen=True, tag="estimator_raises"):
    def estimator(self):
        return RaisesEstimator(self)


class RaisesEstimator(Estimator):
    def step(self, given):
        return given.nothing
"""
SYNTAX = "def f(:\n"
_CHECKS = {
    "raises": "Raises", "gives_none": "GivesNone", "hears_wrong": "Hears", "hears_text": "HearsText",
    "no_super": "NoSuper", "no_kind": "NoKind", "objects": "Objects", "leaves": "Leaves",
    "float_tick": "FloatTick", "stands_still": "Still", "absent": "Absent",
}  # fmt: skip
_LAWS = {
    "law_raises": "Raises", "law_none": "Nothing", "law_nan": "NoNumber", "law_refuses": "Refuses",
    "law_breaks": "Breaks", "law_says": "Says",
}  # fmt: skip
_REFERENCES = {"reference_raises": "Raises", "reference_none": "Nothing"}


def install_all(site):
    """All of them in a folder, which then has to be on the path."""
    checks = {name: f"plugged_checks:{value}" for name, value in _CHECKS.items()}
    checks["syntax"] = "plugged_syntax:Anything"
    install(site, "plugged-checks", "1.0", checks, "checks", plugged_checks=CHECKS, plugged_syntax=SYNTAX)
    laws = {name: f"plugged_laws:{value}" for name, value in _LAWS.items()}
    install(site, "plugged-laws", "1.0", laws, "laws", plugged_laws=LAWS)
    references = {name: f"plugged_references:{value}" for name, value in _REFERENCES.items()}
    install(site, "plugged-references", "1.0", references, "references", plugged_references=REFERENCES)
    estimators = {"estimator_raises": "plugged_estimators:Raises"}
    install(site, "plugged-estimators", "1.0", estimators, "estimators", plugged_estimators=ESTIMATORS)


def line_of(source, text):
    """The number of the first line that holds this."""
    return 1 + next(at for at, line in enumerate(source.splitlines()) if text in line)
