"""Products and linear equations of small matrices of any shape, in a written order of additions.

A matrix is a list of rows.
"""

Vector = list[float]
Matrix = list[Vector]


def diagonal(values):
    """A square matrix with these values on its diagonal."""
    made = [[0.0] * len(values) for _ in values]
    for index, value in enumerate(values):
        made[index][index] = value
    return made


def transposed(a):
    """a^T."""
    return [list(column) for column in zip(*a, strict=True)]


def dot(a, b):
    """a . b, added from left to right."""
    total = 0.0
    for x, y in zip(a, b, strict=True):
        total += x * y
    return total


def times(a, x):
    """a x."""
    return [dot(row, x) for row in a]


def product(a, b):
    """a b."""
    columns = transposed(b)
    return [[dot(row, column) for column in columns] for row in a]


def added(a, b):
    """a + b."""
    return [x + y for x, y in zip(a, b, strict=True)]


def solution(a, right):
    """The x of a x = right by elimination, each column's largest entry first. ValueError for a singular a."""
    size = len(a)
    rows = [list(row) + list(more) for row, more in zip(a, right, strict=True)]
    for column in range(size):
        best = column
        for row in range(column + 1, size):
            if abs(rows[row][column]) > abs(rows[best][column]):
                best = row
        rows[column], rows[best] = rows[best], rows[column]
        pivot = rows[column]
        if pivot[column] == 0.0:
            raise ValueError("the matrix is singular")
        for row in range(size):
            if row != column:
                factor = rows[row][column] / pivot[column]
                rows[row] = [x - factor * y for x, y in zip(rows[row], pivot, strict=True)]
    if any(row[at] == 0.0 for at, row in enumerate(rows)):  # singular to rounding
        raise ValueError("the matrix is singular")
    return [[x / row[at] for x in row[size:]] for at, row in enumerate(rows)]


def solved(a, right):
    """The x of a x = right for one column. ValueError for a singular a."""
    return [row[0] for row in solution(a, [[value] for value in right])]
