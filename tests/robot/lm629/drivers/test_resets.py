"""Reset handshakes: a pulse or RESET, the values that the status shows, RSTI."""

import pytest

from tests.robot.lm629.drivers.driver import everywhere, outcomes

MS = 24_000


def pulse(driver):
    """Looks for 00h at once, waits 2 ms, wants 84h or C4h, then 80h or C0h after RSTI. Returns its tries."""
    for tries in range(1, 4):
        driver.reset(wait=False)
        if 0x00 not in [driver.status() for _ in range(20)]:
            continue
        driver.wait(2 * MS)
        if driver.status() not in (0x84, 0xC4):
            continue
        driver.command("RSTI", 0)
        driver.ready()
        if driver.status() in (0x80, 0xC0):
            return tries
    return None


def pulse_and_rsti_until_80h(driver):
    """A driver that takes C0h for a reason to send RSTI once more. Returns how many it sent."""
    driver.reset()
    for sent in range(1, 4):
        driver.command("RSTI", 0)
        driver.ready()
        if driver.status() == 0x80:
            return sent
    return None


def software_reset(driver):
    """RESET, then busy polling alone until masks and flags are set."""
    driver.command("LPES", 100)
    driver.command("RESET")
    driver.ready()
    booted = driver.status() & 0xBF
    driver.command("MSKI", 0)
    driver.command("RSTI", 0)
    driver.ready()
    return booted, driver.status() & 0xBF, driver.chip.hi, driver.chip.threshold


@pytest.mark.parametrize("bit_6", ["none", "fires", "stays"])
def test_the_handshake_by_a_pulse_succeeds_at_the_first_try(bit_6):
    assert outcomes(pulse, boots=False, reset_breakpoint=bit_6) == everywhere(1)


@pytest.mark.parametrize(("bit_6", "sent"), [("none", 1), ("stays", 2)])
def test_a_flag_that_outlives_the_first_rsti_does_not_outlive_the_second(bit_6, sent):
    assert outcomes(pulse_and_rsti_until_80h, boots=False, reset_breakpoint=bit_6) == everywhere(sent)


@pytest.mark.parametrize("bit_6", ["none", "fires", "stays"])
def test_a_software_reset_is_over_when_the_chip_is_no_longer_busy(bit_6):
    assert outcomes(software_reset, reset_breakpoint=bit_6) == everywhere((0x84, 0x80, 0, 100))
