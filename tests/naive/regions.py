"""Regions of one class by flood fill over a dictionary of pixels: slow and obvious."""

from miro_host.eye.regions import Region


def regions(table, pixels, width, height):
    """The regions of a window, in the order of their first pixels."""
    kinds = {}
    for row in range(height):
        for column in range(width):
            y, cb, cr = pixels[3 * (row * width + column) :][:3]
            kinds[row, column] = table[y // 16 * 4096 + cb // 4 * 64 + cr // 4]
    found = []
    seen = set()
    for first, kind in kinds.items():
        if kind == 0 or first in seen:
            continue
        members = {first}
        waiting = [first]
        while waiting:
            row, column = waiting.pop()
            for near in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
                if kinds.get(near) == kind and near not in members:
                    members.add(near)
                    waiting.append(near)
        seen |= members
        found.append(described(kind, members, width, height))
    return found


def described(kind, members, width, height):
    rows = [row for row, _ in members]
    columns = [column for _, column in members]
    return Region(
        kind,
        len(members),
        min(columns),
        min(rows),
        max(columns) + 1,
        max(rows) + 1,
        sum(2 * column + 1 for column in columns),
        sum(2 * row + 1 for row in rows),
        0 in rows or 0 in columns or height - 1 in rows or width - 1 in columns,
    )
