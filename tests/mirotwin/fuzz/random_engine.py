"""An engine for tests: it changes inputs by chance, in this process, and keeps those that reach new edges."""

import random
import time

from mirotwin.fuzz.engine import EngineProgress

BATCH = 150


class RandomEngine:
    """Runs a batch each time that it is asked for what is new. `stopped`: that it was told to stop."""

    def __init__(self, target, seeds, out, seed):
        self.target = target
        self.out = out
        self.random = random.Random(seed)
        self.edges = bytearray(target.map_size)
        self.seen = bytearray(target.map_size)
        self.queue = list(seeds)
        self.count = 0
        self.found = {"queue": [], "crashes": []}
        self.stopped = False
        self.began_s = time.monotonic()
        target.use_map(self.edges)

    def start(self):
        for data in list(self.queue):
            self._try(data)

    def stop(self):
        self.stopped = True

    def progress(self):
        run_s = time.monotonic() - self.began_s
        done = self.target.executions
        return EngineProgress(done, done / run_s, len(self.seen) - self.seen.count(0))

    def new_crashes(self):
        for _ in range(0 if self.stopped else BATCH):
            self._try(self._changed(self.random.choice(self.queue)))
        return self._new("crashes")

    def new_queue(self):
        return self._new("queue")

    def _new(self, kind):
        new, self.found[kind] = self.found[kind], []
        return new

    def _try(self, data):
        self.edges[:] = bytes(len(self.edges))
        code = self.target.run(data)
        new = any(now and not before for now, before in zip(self.edges, self.seen, strict=True))
        if new:
            self.seen[:] = bytes(max(now, before) for now, before in zip(self.edges, self.seen, strict=True))
            self.queue.append(data)
        if code or new:
            kind = "crashes" if code else "queue"
            self.count += 1
            path = self.out / f"{kind}-{self.count:05d}"
            path.write_bytes(data)
            self.found[kind].append(path)

    def _changed(self, data):
        changed = bytearray(data)
        for _ in range(self.random.randrange(1, 4)):
            place = self.random.randrange(len(changed) + 1)
            way = self.random.randrange(3)
            if way == 0:
                changed[place:place] = self.random.choice(self.queue)
            elif way == 1 and place < len(changed):
                changed[place] = self.random.randrange(256)
            else:
                changed[place:place] = self.random.randbytes(2)
        return bytes(changed[:400])
