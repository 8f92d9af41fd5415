"""Parts of a board tick by tick, from the levels that their pins have at each tick: slow, and plain to see."""

from itertools import pairwise


def echo_levels(trig, us_per_tick, answer_us):
    """HC-SR04: the level of its echo at each tick. `answer_us(ping)`: how long answer 1, 2, .. is."""
    echo = []
    high_for = 0.0  # us of trig, while the module waits for it
    waits_us = answers_us = None
    pings = 0
    before = 0
    for tick, level in enumerate(trig):
        if waits_us is not None and tick >= waits_us:
            waits_us = None
            pings += 1
            answers_us = tick + to_ticks(answer_us(pings), us_per_tick)
            if answers_us == tick:
                answers_us = None
            high_for = None
        elif answers_us is not None and tick >= answers_us:
            answers_us = high_for = None
        busy = waits_us is not None or answers_us is not None
        if level and not before:
            high_for = None if busy else 0.0
        if (
            not level
            and before
            and high_for is not None
            and not busy
            and high_for >= to_ticks(10, us_per_tick)
        ):
            waits_us = tick + to_ticks(450, us_per_tick)
            busy = True
        high_for = high_for + 1 if level and high_for is not None and not busy else None
        before = level
        echo.append(1 if answers_us is not None else 0)
    return echo


def to_ticks(us, us_per_tick):
    return int(us / us_per_tick + 0.5)


def servo_angles(pin, ticks_per_us, deg_per_tick, low_us=500.0, high_us=2500.0, range_deg=180.0):
    """Servo: where it is at the end of each tick. The pin begins low."""
    angle = target = range_deg / 2
    angles = []
    high = driven = 0
    for level in pin:
        angle += min(max(target - angle, -deg_per_tick), deg_per_tick) if driven > 0 else 0.0
        driven -= 1
        if not level and 300 * ticks_per_us <= high <= 3000 * ticks_per_us:
            share = (high / ticks_per_us - low_us) / (high_us - low_us)
            target = range_deg * min(max(share, 0.0), 1.0)
            driven = 50_000 * ticks_per_us
        high = high + 1 if level else 0
        angles.append(angle)
    return angles


def pwm(directions, longest):
    """L298: (duty, period in ticks) of what was driven (-1, 0, 1) at each tick; period 0: the level is constant.

    What counts are the ticks since the level was last constant.
    """
    since = directions[:1]
    seen = (float(directions[0]), 0)
    for direction in directions[1:]:
        edges, (end, begin) = edges_of(since)
        period = end - begin
        # It is constant from a tick on, and changes on the same one, if both come together.
        if edges and len(since) - edges[-1] >= min(longest, 2 * period or longest):
            seen = (float(since[-1]), 0)
            since = since[-1:]
        elif not edges:
            since = since[-1:]
        since.append(direction)
        end, begin = edges_of(since)[1]
        if end > begin:
            seen = (sum(since[begin:end]) / (end - begin), end - begin)
    return seen


def edges_of(directions):
    """The ticks of changes, and (end, begin) of the last period: from one begin of driving to the next the same way."""
    edges = [tick for tick in range(1, len(directions)) if directions[tick] != directions[tick - 1]]
    periods = [
        (end, begin)
        for way in (-1, 1)
        for begin, end in pairwise(tick for tick in edges if directions[tick] == way)
    ]
    return edges, max(periods, default=(0, 0))


def seen_segments(levels, window, digits):
    """Seven-segment display, common cathode: the patterns that are seen after each whole window of ticks.

    `levels`: at each tick the segments' byte and, by digit, the level of its pin, which is low for one that is on.
    """
    windows = [levels[first : first + window] for first in range(0, len(levels) - window + 1, window)]
    shown = []
    for ticks in windows:
        times = [
            [
                sum(1 for segments, selects in ticks if segments >> bit & 1 and not selects[digit])
                for bit in range(8)
            ]
            for digit in range(digits)
        ]
        least = max(1, max(max(row) for row in times) // 4, window // 256)
        shown.append([sum(1 << bit for bit, time in enumerate(row) if time >= least) for row in times])
    return shown
