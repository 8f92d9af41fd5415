"""Laws for tests: one that remembers, and ones that do what a law must not."""

from miro_host.laws.interface import Accelerations, Law, LawParameters, Velocities


class LeakyParameters(LawParameters, frozen=True, kw_only=True, tag="leaky"):
    gain_per_s: float = 2.0

    def law(self):
        return Leaky(self)


class Leaky(Law[LeakyParameters]):
    """Velocities from a filtered error along X, a count of periods, and the last two headings."""

    INNER = ("error_m",)
    STATE = {"error_m": "d", "periods": "q", "begun": "?", "headings_rad": "2d"}

    def __init__(self, parameters):
        super().__init__(parameters)
        self.error_m = 0.0
        self.periods = 0
        self.begun = False
        self.headings_rad = [0.0, 0.0]

    def step(self, given):
        error_m = given.reference.posture.x_m - given.posture.x_m
        self.error_m += 0.3 * (error_m - self.error_m)
        self.periods += 1
        self.begun = True
        self.headings_rad = [self.headings_rad[1], given.posture.theta_rad]
        v_m_s = given.reference.v_m_s + self.parameters.gain_per_s * self.error_m
        return Velocities(v_m_s, self.headings_rad[0] - self.headings_rad[1], {"error_m": self.error_m})


NAN = float("nan")
ANSWERS = {
    "nan": Velocities(NAN, 0.0, {"a": 1.0}),
    "infinite": Accelerations(0.0, float("-inf"), {"a": 1.0}),
    "inner nan": Velocities(0.1, 0.0, {"a": NAN}),
    "inner names": Velocities(0.1, 0.0, {"b": 1.0}),
    "int": Velocities(1, 0.0, {"a": 1.0}),
    "nothing": None,
}
MEMORIES = {"memory nan": NAN, "memory type": "text"}


class WrongParameters(LawParameters, frozen=True, kw_only=True, tag="wrong"):
    how: str = "nan"

    def law(self):
        return Wrong(self)


class Wrong(Law[WrongParameters]):
    """Good in the first period, then wrong in the way that `how` says."""

    INNER = ("a",)
    STATE = {"memory": "d", "periods": "q"}

    def __init__(self, parameters):
        super().__init__(parameters)
        self.memory = 0.0
        self.periods = 0

    def step(self, given):
        self.periods += 1
        good = Velocities(0.1, 0.0, {"a": 1.0})
        if self.periods == 1:
            return good
        how = self.parameters.how
        if how == "raises":
            raise ZeroDivisionError("division by zero")
        if how == "undeclared":
            self.hidden = 1.0
        self.memory = MEMORIES.get(how, 0.0)
        return ANSWERS.get(how, good)
