"""The chip and its slow twin on one bench, compared after every step."""

from miro_robot.lm629.chip import Lm629
from tests.naive.lm629 import NaiveLm629


class Pair:
    """Looks like a chip to a `Bench`."""

    def __init__(self, options):
        self.chip = Lm629(options)
        self.naive = NaiveLm629(options)

    def __getattr__(self, name):
        return getattr(self.chip, name)

    def compare(self, tick):
        chip, naive = self.chip, self.naive
        loaded, gains = chip.trajectory_buffer, chip.filter_buffer
        ours = {
            "status": chip.status_at(tick),
            "signals": chip.signals.word,
            "hi": chip.hi,
            "pwm": chip.pwm,
            "sign": chip.sign,
            "magnitude": chip.pwm_magnitude,
            "data": chip.data_out(tick),
            "lost": chip.writes_while_busy,
            "real": (chip.real_position, chip.real_velocity, chip.index_position),
            "desired": (chip.trajectory.position, chip.desired_velocity),
            "integral": chip.pid.integral,
            "target": chip.trajectory.target,
            "settings": (chip.threshold, chip.signals.mask),
            "trajectory": (loaded.acceleration, loaded.velocity, loaded.position, loaded.relative),
            "filter": (gains.kp, gains.ki, gains.kd, gains.il, gains.ds),
        }
        theirs = {
            "status": naive.status_at(tick),
            "signals": naive.signals_word(),
            "hi": naive.signals_word() >> 15,
            "pwm": naive.pwm_at(tick),
            "sign": naive.sign,
            "magnitude": naive.magnitude,
            "data": naive.data_out(tick),
            "lost": naive.lost,
            "real": (naive.real, naive.velocity_counts, naive.index_position),
            "desired": (naive.desired * 65536, naive.speed),
            "integral": naive.pid.integral,
            "target": naive.target,
            "settings": (naive.threshold, sum(1 << bit for bit in naive.mask)),
            "trajectory": (naive.buffer["a"], naive.buffer["v"], naive.buffer["p"], naive.relative),
            "filter": tuple(naive.filter[name] for name in ("kp", "ki", "kd", "il", "ds")),
        }
        assert ours == theirs, f"at tick {tick}"

    def advance(self, tick):
        self.chip.advance(tick)
        self.naive.run_to(tick)
        self.compare(tick)

    def set_bus(self, tick, cs, rd, wr, ps, data):
        self.chip.set_bus(tick, cs, rd, wr, ps, data)
        self.naive.set_bus(tick, cs, rd, wr, ps, data)
        self.compare(tick)

    def set_reset(self, tick, level):
        self.chip.set_reset(tick, level)
        self.naive.set_reset(tick, level)
        self.compare(tick)

    def set_encoder(self, tick, a, b):
        self.chip.set_encoder(tick, a, b)
        self.naive.set_encoder(tick, a, b)

    def set_index(self, tick, level):
        self.chip.set_index(tick, level)
        self.naive.set_index(tick, level)
