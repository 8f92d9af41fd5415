"""What the tests of campaigns share: the command in this process, with an engine that needs no other program."""

import pytest

from tests.mirotwin.fuzz.random_engine import RandomEngine


@pytest.fixture
def engines(monkeypatch):
    """The engines that `mirotwin fuzz` makes in a test: in this process, by chance."""
    made = []

    def engine_for(spec, inputs, folder, target, jobs, seed):
        made.append(RandomEngine(target, list(inputs), folder.folder("engine"), seed))
        return made[-1], []

    monkeypatch.setattr("mirotwin.fuzz.fuzz_command.engine_for", engine_for)
    return made


@pytest.fixture
def built():
    """The image of the firmware with a planted mistake, by its name."""
    from tests.mirotwin.verify.checks.rig import planted

    def find(name):
        image = planted(name)
        return image.path

    return find
