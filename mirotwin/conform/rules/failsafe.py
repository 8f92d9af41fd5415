"""Rules about silence: the smooth stop, motors off, and coming back from both."""

from __future__ import annotations

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.robot_rules import TOLERANCE_TICKS, SilenceRule
from miro_protocol.table import (
    DEFAULT_ACCELERATION,
    FAILSAFE_OFF_TICKS,
    FAILSAFE_STOP_TICKS,
    SYNC,
    TICKS_PER_MS,
)
from miro_robot.lm629.chip import SAMPLE_TICKS
from miro_robot.lm629.signals import MOTOR_OFF
from miro_sim.world.events import SIDES
from mirotwin.conform.hints import in_words
from mirotwin.conform.observed import Observed
from mirotwin.conform.rule import FRESHNESS, WHEELS, Chapter
from mirotwin.conform.trial_script import Found, Frame, TrialScript, ms

CHAPTER = Chapter("Failsafe")


@CHAPTER.rule(
    "P29", FRESHNESS, presupposes="P28", broken="the wheels are not told to stop 110 ms after the last frame"
)
def stop(script: TrialScript) -> None:
    """110 ms after the last fresh frame both wheels MUST be told to stop. A robot may count from the start or from the
    end of that frame's last character (1.04 ms apart), and may be 0.5 ms off.
    """
    for make in (script.team, script.team, script.ask_nobody, script.ask):
        script.obeyed(script.team())
        script.wait(3.3)
        stops_behind(script, make())
        script.wait(130.0)


@CHAPTER.rule("P30", FRESHNESS, presupposes="P06 P13 P20 P32 P37", broken="the failsafe is put off")
def not_put_off(script: TrialScript) -> None:
    """Frames that are not fresh, or not valid, and characters that are no frame MUST NOT put off the failsafe."""
    last = script.obeyed(script.team())
    for count in range(16):
        script.team(step=0, fresh=False, lead=b"", gap_ms=0.0)
        script.team(fresh=False, lead=b"", gap_ms=0.0, wrong={4: 1})
        if count == 0:  # 150 ms later it would be fresh
            script.team(step=40, fresh=False, lead=b"", gap_ms=0.0)
    stops_behind(script, last)
    off_behind(script, last)
    script.wait_until(max(script.now, last.end_tick + ms(530.0)))
    script.obeyed(script.team())
    script.wait(3.3)
    last = script.team(gap_ms=0.0)
    script.characters(bytes(8))  # no robot has looked at the frame when the first of these ends
    stops_behind(script, last)
    script.wait(130.0)
    _stop_of_a_busy_robot(script)


def _stop_of_a_busy_robot(script: TrialScript) -> None:
    """One wheel is still stopping and an acceleration waits for it; several syncs come before the next frame."""
    for syncs in (16, 24):
        for _ in range(8):
            script.team(script.same(0, 12000))
        script.team(script.same(0, 12000), gap_ms=2.0)
        script.acceleration(DEFAULT_ACCELERATION, gap_ms=0.0)
        script.wait(112.0)
        script.characters(SYNC * syncs)
        stops_behind(script, script.obeyed(script.team(label=f"team frame after {syncs} syncs", lead=b"")))
        script.wait(130.0)


@CHAPTER.rule("P31", FRESHNESS, presupposes="P29 P36", broken="the failsafe's stop is not as it has to be")
def smooth(script: TrialScript) -> None:
    """The failsafe's stop MUST be smooth, with the acceleration in force: 5973 (6 m/s2) until a service frame sets
    another.
    """
    for acceleration in (DEFAULT_ACCELERATION, 3000):
        changed = acceleration != DEFAULT_ACCELERATION
        if changed:
            script.acceleration(acceleration)
        fast = tuple((12000, -12000) for _ in range(script.n))
        until = script.now + ms(12000 * 256 / acceleration * SAMPLE_TICKS / TICKS_PER_MS + 60.0)
        while script.now < until:
            last = script.team(fast, gap_ms=60.0)
        script.obeyed(last)
        stop_tick = last.end_tick + FAILSAFE_STOP_TICKS
        script.wait_until(last.end_tick + ms(490.0) if changed else stop_tick + ms(320.0))
        _slows_down(script, stop_tick + TOLERANCE_TICKS, script.now, acceleration)
        _stays_closed(script, last, script.now)


def _slows_down(script: TrialScript, after_tick: int, until_tick: int, acceleration: int) -> None:
    """From one control period to the next the velocities must fall by the acceleration times 97 or 98 samples."""
    samples = CONTROL_PERIOD_TICKS // SAMPLE_TICKS

    @script.expects(until_tick, f"wheels slowed down by {acceleration} / 65536 count per sample^2")
    def test(observed: Observed) -> Found:
        before: dict[str, int] = {}
        steps = 0
        for tick, side, chip in observed.chips(after_tick, until_tick):
            now = abs(chip.desired_velocity)
            fallen = before.get(side, now) - now
            if side in before and now:  # the last step is a part of one
                steps += 1
                if fallen not in (samples * acceleration, (samples + 1) * acceleration):
                    yield tick, f"the {side} one slower by {fallen / samples:.0f} a sample"
            before[side] = now
        if not steps:
            yield until_tick, "no wheel that slowed down"
        if any(before.values()):
            yield until_tick, "a wheel that still turns"


def _stays_closed(script: TrialScript, last: Frame, until_tick: int) -> None:
    """There must be no abrupt stop, and the motors must stay on."""

    @script.expects(until_tick, "a smooth stop")
    def test(observed: Observed) -> Found:
        for order in observed.ordered(last.acted_tick, until_tick):
            if order.abrupt or order.what == "off":
                yield order.tick, f"an order to the {order.side} wheel: {in_words(order)}"


@CHAPTER.rule(
    "P32", FRESHNESS, presupposes="P31 P34", broken="the motors are not off 500 ms after the last frame"
)
def off(script: TrialScript) -> None:
    """500 ms after the last fresh frame both motors MUST be off. A robot may count from the start or from the end of
    that frame's last character (1.04 ms apart), and may be 0.5 ms off.
    """
    script.obeyed(script.team())
    last = script.ping()
    off_behind(script, last)
    script.wait_until(last.end_tick + ms(700.0))
    end = script.now

    @script.expects(end, "both motors off")
    def driven(observed: Observed) -> Found:
        for tick, side, chip in observed.chips(last.end_tick + ms(501.0), end):
            if chip.pwm_magnitude or not chip.status & MOTOR_OFF:
                yield tick, f"the {side} one on"


@CHAPTER.rule("P33", WHEELS, presupposes="P28")
def back(script: TrialScript) -> None:
    """After a failsafe stop and after motors off the next fresh team frame MUST be obeyed, with both motors on."""
    for silence_ms in (150.0, 600.0, 900.0, 120.0):
        frame = script.obeyed(script.team())
        _turning(script, script.team(frame.words, gap_ms=60.0))
        script.wait(silence_ms - 60.0)
    script.obeyed(script.team())


def _turning(script: TrialScript, frame: Frame) -> None:
    """Both wheels must turn as ordered, measured at the encoders, after time for acceleration."""
    until = frame.end_tick + ms(60.0)

    @script.expects(until, f"wheels that turn as by {frame.what}")
    def test(observed: Observed) -> Found:
        *_, earlier, other = (record for tick, record in observed.periods if tick <= until)
        left = other.left.real_position - earlier.left.real_position
        right = other.right.real_position - earlier.right.real_position
        for side, moved, word in zip(SIDES, (left, right), frame.for_robot(observed.slot), strict=True):
            nominal = word * CONTROL_PERIOD_TICKS / SAMPLE_TICKS / 256
            if abs(moved - nominal) > abs(nominal) / 2:
                reason = f"{moved} counts of the {side} one in a camera frame and not about {nominal:.0f}"
                loaded = observed.set_to(side, until)
                yield until, reason + ("" if loaded else ": no filter was loaded into its LM629 (LFIL, UDF)")


def stops_behind(script: TrialScript, last: Frame) -> None:
    """Expects the stop in time, and neither earlier nor later."""
    _in_time(script, last, FAILSAFE_STOP_TICKS, "stop", "both wheels told to stop")


def off_behind(script: TrialScript, last: Frame) -> None:
    """Expects motors off in time."""
    _in_time(script, last, FAILSAFE_OFF_TICKS, "off", "both motors off")


def _in_time(script: TrialScript, last: Frame, after_ticks: int, order_kind: str, wanted: str) -> None:
    rule = SilenceRule(after_ticks)
    rule.last_tick = last.last_tick
    earliest, latest = rule.earliest_tick(), rule.latest_tick()

    def done(observed: Observed, side: str, tick: int) -> bool:
        order = observed.last_order(side, tick)
        return order.what == "off" if order_kind == "off" else not order.moves

    def when(observed: Observed, side: str) -> str:
        after = [order.tick for order in observed.orders[side] if order.tick > last.end_tick]
        tick = next((later for later in after if done(observed, side, later)), None)
        if tick is None:
            return f"{side} not within {in_ms(observed.end_tick - last.end_tick)}"
        return f"{side} at {in_ms(tick - last.end_tick)}"

    window = f"{in_ms(earliest - last.end_tick)} to {in_ms(latest - last.end_tick)}"

    @script.expects(latest, f"{wanted} {window} after the end of {last.what}")
    def test(observed: Observed) -> Found:
        for side in SIDES:
            order = observed.last_order(side, earliest)
            if done(observed, side, earliest) and order.tick <= last.tick:
                yield latest, f"an earlier order to the {side} wheel: {in_words(order)}"
            elif done(observed, side, earliest):
                yield order.tick, f"the {side} one {in_ms(order.tick - last.end_tick)} after its end"
        if not all(done(observed, side, latest) for side in SIDES):
            yield latest, ", ".join(when(observed, side) for side in SIDES)


def in_ms(ticks: int) -> str:
    return f"{ticks / TICKS_PER_MS:.2f} ms"
