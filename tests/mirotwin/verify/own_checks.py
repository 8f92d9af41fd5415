"""Checks of a board alone made of functions: `function(monitor)` says what is wrong at the end of a run, or None."""

from mirotwin.verify.checks.expect import CHECKS
from mirotwin.verify.checks.interface import Check
from mirotwin.verify.checks.serial import SerialMonitor


def check_of(name, function):
    """A check, which is known by its name from now on, as one from a file of the command line is."""

    class OwnMonitor(SerialMonitor):
        def end(self, tick):
            self.judged += 1
            wrong = function(self)
            if wrong is not None:
                self.fail(tick, "", wrong)

    class Own(Check, frozen=True, kw_only=True, tag=name):
        KIND = "safety"
        SUBJECTS = ("board",)

        def monitor(self, subject):
            return OwnMonitor(self, subject)

    CHECKS.in_files[name] = Own
    return Own()


SOURCE = """
from mirotwin.verify.checks.interface import Check
from mirotwin.verify.checks.serial import SerialMonitor


class {name}(Check, frozen=True, kw_only=True, tag="{tag}"):
    KIND = "safety"
    SUBJECTS = ("board",)

    def monitor(self, subject):
        return OwnMonitor(self, subject)


class OwnMonitor(SerialMonitor):
    def end(self, tick):
        self.judged += 1
        if {wrong}:
            self.fail(tick, "", {found})
"""


def source_of(name, tag, wrong, found):
    """A file with such a check: the class, its tag, and expressions for whether something is wrong and what."""
    return SOURCE.format(name=name, tag=tag, wrong=wrong, found=found)
