"""The comparison of a robot's answers with its twin's, as slow as it is plain: every answer is looked for among all.

Answers are (tick, telemetry), frames that were sent (end tick, the robot's velocities). Nothing is remembered between
two questions; each is answered from the lists.
"""

MS = 24_000
LIMITS = (110 * MS, 150 * MS, 500 * MS)


def same_question(one, other):
    return (one.slot, one.seq) == (other.slot, other.seq)


def shortest_delay(port, twin):
    found = []
    for tick, said in twin:
        later = [at for at, heard in port if same_question(heard, said) and at >= tick - 5 * MS]
        if later and min(later) - tick < 500 * MS:
            found.append(min(later) - tick)
    return min(found, default=0)


def partner(answer, others):
    """The answer of the other side to the same question, or None."""
    near = [one for one in others if same_question(one[1], answer[1]) and abs(one[0] - answer[0]) <= 500 * MS]
    return min(near, key=lambda one: abs(one[0] - answer[0]), default=None)


def moved(one, other):
    return (other - one + 32768) % 65536 - 32768


def values(before, after):
    """What is compared, and whether it has to be equal."""
    seen = 0b00100010 if after.flags & 0b10000 else 0b10100010  # a motor that was off is being started
    return {
        "accepted": ((after.accepted - before.accepted) % 256, True),
        "rejected": ((after.rejected - before.rejected) % 256, True),
        "flags": (after.flags, True),
        "status left": (after.status_left & seen, True),
        "status right": (after.status_right & seen, True),
        "left moved": (moved(before.position_left, after.position_left), False),
        "right moved": (moved(before.position_right, after.position_right), False),
    }


def silence_near_a_limit(sent, first_tick, last_tick, unsure):
    ends = [end for end, _ in sent]
    begun = max((end for end in ends if end <= first_tick), default=None)
    seen = [end for end in ends if end == begun or first_tick < end < last_tick]
    gaps = [seen[at + 1] - seen[at] for at in range(len(seen) - 1)]
    return any(abs(gap - limit) < 2 * MS + unsure for gap in gaps for limit in LIMITS)


def off_by(sent, first_tick, last_tick, wheel, late):
    """How far off a position is at most, if each frame in between, and shortly before, is late by 0 to `late` ticks."""
    told = [(end, words[wheel]) for end, words in sent if first_tick - 8 * 800_800 < end < last_tick]
    course = [0]
    for at, (end, word) in enumerate(told):
        if at == 0 or end - told[at - 1][0] > 110 * MS:
            course.append(0)
        course.append(word)
    course.append(0)
    rises = sum(max(0, course[at + 1] - course[at]) for at in range(len(course) - 1))
    return rises * late / 8192 / 256


def compared(port, twin, sent, lost_tick, within_counts, within_ticks):
    """The differences of one robot as (tick, channel), in their order, and how many values time leaves open.

    `lost_tick`: when the port was there no longer.
    """
    way = shortest_delay(port, twin)
    port = [(tick - way, said) for tick, said in port]
    questions = [(one, partner(one, port)) for one in twin]
    questions += [(None, one) for one in port if partner(one, twin) is None]
    questions.sort(key=lambda both: (both[0] or both[1])[0])
    full = [(one, other) for one, other in questions if one and other]
    late = [other[0] - one[0] for one, other in full]
    differences, open_values = [], 0
    for one, other in questions:
        earlier = [both for both in full if both[0][0] < (one or other)[0]]
        if not (one and other):
            still_to_come = one and one[0] + way + within_ticks > lost_tick
            if (earlier or not full) and not still_to_come:
                differences.append(((one or other)[0], "answer"))
            continue
        at = full.index((one, other))
        if late[at] > within_ticks:
            differences.append((one[0], "answer"))
        if not at:
            continue
        before = full[at - 1]
        window = before[0][0], one[0]
        unsure = max(late[max(0, at - 3) : at + 3])
        of_twin, of_robot = values(before[0][1], one[1]), values(before[1][1], other[1])
        for name, (value, exact) in of_twin.items():
            apart = abs(of_robot[name][0] - value)
            if apart and silence_near_a_limit(sent, *window, unsure):
                open_values += 1
            elif apart > (
                0 if exact else within_counts + off_by(sent, *window, name == "right moved", unsure)
            ):
                differences.append((one[0], name))
    return differences, open_values
