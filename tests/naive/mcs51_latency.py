"""Interrupts of a timer that its own routine reloads, by the rules of 4316E section 2.16 alone: no CPU."""

from itertools import cycle as repeated


def answers(loop, routine, reload_after, counts, first, number):
    """(cycle of the overflow, full cycles from it to the routine), `number` of them.

    The loop's first instruction begins in cycle 0 and `first` is the cycle of the first overflow. The routine
    reloads the timer at the end of its cycle `reload_after` (1 is its first): it overflows `counts` cycles later.
    """
    found = []
    now, overflow = 0, first
    for length in repeated(loop):
        now += length
        last = now - 1  # of this instruction: the flag that it polls was latched in the cycle before
        if overflow > last - 1:
            continue
        begin = now + 2  # behind the LCALL
        found.append((overflow, begin - overflow - 1))
        if len(found) == number:
            break
        overflow = begin + reload_after - 1 + counts
        now = begin + sum(routine)
        assert overflow > now + max(loop), "the instruction after RETI is not interrupted"
    return found
