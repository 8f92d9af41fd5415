"""Positions: index search, home, breakpoints, the border of the position space."""

from tests.robot.lm629.drivers.driver import BREAKPOINT, INDEX, everywhere, outcomes

TURN = 80
BORDER = 2**30


def index_search(driver):
    """Two index positions in one move. Returns how far they are apart, and the position of the first."""
    driver.load(0x1828, 0x8000, 0x40000)
    driver.command("SIP")
    driver.command("STT")
    found = []
    for _ in range(2):
        driver.until_flag(INDEX)
        found.append(driver.ask("RDIP"))
        driver.wait(3 * 8192)
        driver.command("RSTI", 0x7E & ~INDEX)
        driver.command("SIP")
    return found[0], found[1] - found[0]


def home_at_rest(driver):
    """At 100 counts, with a breakpoint at 50, the place becomes 0. Returns the flag then, and once 50 is passed."""
    driver.start(0x002A, 0x8000, 0x80000, 100, samples=40)
    driver.position("SBPA", 50)
    driver.command("DFH")
    driver.ready()
    driver.sample(3)
    at_rest = driver.status() & BREAKPOINT
    driver.start(0x0002, 60, samples=60)
    return driver.ask("RDRP"), at_rest, driver.status() & BREAKPOINT


def home_on_the_breakpoint(driver):
    """A breakpoint at 0 armed, then the place becomes 0: it has not been reached."""
    driver.start(0x002A, 0x8000, 0x80000, 100, samples=40)
    driver.position("SBPA", 0)
    driver.command("DFH")
    driver.ready()
    driver.sample(3)
    return driver.ask("RDRP"), driver.status() & BREAKPOINT


def over_the_border(driver, breakpoint):
    """From 40 counts before the border of the position space to 40 behind it."""
    driver.chip.real_position = BORDER - 40
    driver.chip.trajectory.follow(BORDER - 40)
    driver.position("SBPA", breakpoint)
    driver.start(0x1828, 0x8000, 0x40000, samples=40)
    return driver.ask("RDRP") < 0, driver.status() & BREAKPOINT


def home_at_the_border(driver):
    return over_the_border(driver, 0)


def behind_the_border(driver):
    return over_the_border(driver, -BORDER + 7)


def test_two_index_positions_are_a_turn_apart():
    assert outcomes(index_search, turn=TURN) == everywhere((TURN, TURN))


def test_define_home_fires_no_breakpoint():
    assert outcomes(home_at_rest) == everywhere((60, 0, BREAKPOINT))
    assert outcomes(home_on_the_breakpoint) == everywhere((0, 0))


def test_the_border_of_the_position_space_is_no_breakpoint_and_may_have_one_behind_it():
    assert outcomes(home_at_the_border) == everywhere((True, 0))
    assert outcomes(behind_the_border) == everywhere((True, BREAKPOINT))
