"""What the tests of campaigns share: an engine in this process, which needs no other program and works by chance."""

import random
from types import SimpleNamespace

import pytest

from mirotwin.fuzz.engine import Engine, EngineProgress, Explorer
from tests.fuzz.mutation import changed

BATCH = 150
LIMITS = SimpleNamespace(words=(), most_bytes=400)


class RandomEngine(Engine):
    """Runs a batch each time that it is asked for what is new. `stopped`: that it was told to stop."""

    def __init__(self, target, seeds, out, seed):
        super().__init__()
        self.explorer = Explorer(target, self._keep)
        self.out, self.random, self.stopped = out, random.Random(seed), False
        self.queue = list(seeds)
        self.files = {"queue": [], "crashes": []}

    def start(self):
        for data in list(self.queue):
            self.explorer.run(data)

    def stop(self):
        self.stopped = True

    def progress(self):
        return EngineProgress(self.explorer.target.executions, self.explorer.edges)

    def new_crashes(self):
        for _ in range(0 if self.stopped else BATCH):
            data = changed(self.random.choice(self.queue), LIMITS, self.queue, self.random)
            self.explorer.run(data)
        return super().new_crashes()

    def _keep(self, kind, data):
        if kind == "queue":
            self.queue.append(data)
        path = self.out / f"{kind}-{len(self.files[kind]):05d}"
        path.write_bytes(data)
        self.files[kind].append(path)

    def _inputs(self, kind):
        return self.files[kind]


@pytest.fixture
def engines(monkeypatch):
    """The engines that `mirotwin fuzz` makes in a test."""
    made = []

    def engine_for(spec, inputs, folder, target, jobs, seed):
        made.append(RandomEngine(target, inputs, folder.folder("engine"), seed))
        return made[-1], []

    monkeypatch.setattr("mirotwin.fuzz.fuzz_command.engine_for", engine_for)
    return made
