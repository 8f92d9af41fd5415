"""Whether a program leaves its stack, told from the list of values that SP had."""


def problems(steps, first, last):
    """`steps`: (how, before, after) of each change of SP; how: push, pop, data or sum. "over" or "under" for each."""
    floor = first - 1 if first else 0
    found = []
    for how, before, after in steps:
        if how == "push":
            if after == (last + 1) % 256:
                found.append("over")
        elif how == "pop":
            if before == floor:
                found.append("under")
        elif floor <= before <= last:
            inside = floor <= after <= last
            upwards = (after - before) % 256 < 128
            if how == "sum" and upwards and after < before:
                found.append("over")
            elif not inside:
                found.append("over" if after > last else "under")
    return found
