"""The LM629's encoder inputs, sampled clock by clock."""

FORWARD = [(0, 0), (1, 0), (1, 1), (0, 1)]


class NaiveEncoder:
    """Keeps the levels of A, B and /IN over time and looks at them at every multiple of 4 ticks.

    A sample sees the level from just before its tick. `filter_clocks` 0 takes every change as it comes. With
    `hurry`, clocks at which all three inputs have rested for long are passed over.
    """

    def __init__(self, filter_clocks, double_step=0, hurry=False):
        self.double_step = double_step
        self.hurry = hurry
        self.filter_clocks = filter_clocks
        self.phases = []
        self.index_levels = [(-1, 1)]
        self.accepted = None
        self.accepted_index = 1
        self.phase_run = []
        self.index_run = []
        self.clock = 0
        self.drop()

    def drop(self):
        self.counts = 0
        self.armed = False
        self.caught = None

    def set_phases(self, tick, a, b):
        if self.accepted is None:
            self.accepted = (a, b)
            self.phases = [(-1, (a, b))]
        elif self.filter_clocks == 0:
            self.accept((a, b), self.accepted_index)
        else:
            self.phases.append((tick, (a, b)))

    def set_index(self, tick, level):
        if self.filter_clocks == 0:
            self.accept(self.accepted or (0, 0), level)
        else:
            self.index_levels.append((tick, level))

    def accept(self, phases, index):
        before = FORWARD.index(self.accepted or (0, 0))
        step = (FORWARD.index(phases) - before) % 4
        self.counts += {0: 0, 1: 1, 2: self.double_step, 3: -1}[step]
        if self.accepted is not None:
            self.accepted = phases
        self.accepted_index = index
        self.look()

    def look(self):
        if self.armed and (self.accepted or (0, 0)) == (0, 0) and self.accepted_index == 0:
            self.armed = False
            self.caught = self.counts

    def arm(self, tick):
        self.run_to(tick)
        self.armed = True
        self.caught = None
        self.look()

    def run_to(self, tick):
        """All clocks up to and including `tick`."""
        if self.filter_clocks == 0:
            return
        while self.clock + 4 <= tick:
            if self.hurry and self.rests():
                self.clock = tick - tick % 4
                return
            self.clock += 4
            while len(self.phases) > 1 and self.phases[1][0] < self.clock:
                del self.phases[0]
            while len(self.index_levels) > 1 and self.index_levels[1][0] < self.clock:
                del self.index_levels[0]
            wanted = self.filter_clocks
            seen = self.phases[0][1] if self.phases else (0, 0)
            self.phase_run = [*self.phase_run, seen][-wanted:]
            self.index_run = [*self.index_run, self.index_levels[0][1]][-wanted:]
            phases, index = self.accepted or (0, 0), self.accepted_index
            if self.phase_run == [seen] * wanted:
                phases = seen
            if self.index_run == [self.index_run[-1]] * wanted:
                index = self.index_run[-1]
            if (phases, index) != (self.accepted or (0, 0), self.accepted_index):
                self.accept(phases, index)

    def rests(self):
        return (
            len(self.phases) < 2
            and len(self.index_levels) == 1
            and self.phase_run == [self.accepted or (0, 0)] * self.filter_clocks
            and self.index_run == [self.index_levels[0][1]] * self.filter_clocks
            and self.index_run[-1] == self.accepted_index
            and (not self.phases or self.phases[0][1] == self.phase_run[-1])
        )

    def take(self, tick):
        """Counts since the last call, and the counts at which an index was caught."""
        self.run_to(tick)
        counts, caught = self.counts, self.caught
        self.counts, self.caught = 0, None
        return counts, caught
