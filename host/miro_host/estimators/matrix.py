"""Small matrices of plain float64: the algebra of a Kalman filter.

What belongs here: the few operations that `ekf` needs, each in a written order of additions, so that every machine
gives the same bits. What does not: anything that knows what a row means. A matrix is a list of rows.
"""

import math

Matrix = list[list[float]]


def zeros(rows: int, columns: int) -> Matrix:
    """A matrix of zeros."""
    return [[0.0] * columns for _ in range(rows)]


def diagonal(values: list[float]) -> Matrix:
    """A square matrix with these values on its diagonal."""
    made = zeros(len(values), len(values))
    for index, value in enumerate(values):
        made[index][index] = value
    return made


def times_transposed(a: Matrix, b: Matrix) -> Matrix:
    """a b^T for two matrices of five columns, whose products are added from left to right. Written out for speed."""
    return [
        [a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3 + a4 * b4 for b0, b1, b2, b3, b4 in b]
        for a0, a1, a2, a3, a4 in a
    ]


def sandwiched(f: Matrix, p: Matrix) -> Matrix:
    """f p f^T of size 5 for a symmetric p, made exactly symmetric."""
    return symmetric(times_transposed(times_transposed(f, p), f))


def plus(a: Matrix, b: Matrix) -> Matrix:
    """a + b."""
    return [[x + y for x, y in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]


def symmetric(a: Matrix) -> Matrix:
    """The mean of a and its transpose."""
    size = range(len(a))
    return [[0.5 * (a[i][j] + a[j][i]) for j in size] for i in size]


def cholesky(a: Matrix) -> Matrix:
    """The lower triangle l with l l^T = a. ValueError unless the symmetric a is positive definite."""
    made = zeros(len(a), len(a))
    for i in range(len(a)):
        for j in range(i + 1):
            rest = a[i][j]
            for k in range(j):
                rest -= made[i][k] * made[j][k]
            if i > j:
                made[i][j] = rest / made[j][j]
            elif rest > 0.0:
                made[i][i] = math.sqrt(rest)
            else:
                raise ValueError("the covariance is not positive definite")
    return made


def forward(lower: Matrix, right: list[float]) -> list[float]:
    """The solution y of l y = right."""
    found: list[float] = []
    for i, row in enumerate(lower):
        rest = right[i]
        for j in range(i):
            rest -= row[j] * found[j]
        found.append(rest / row[i])
    return found


def solved(lower: Matrix, right: list[float]) -> list[float]:
    """The solution x of l l^T x = right."""
    found = forward(lower, right)
    for i in range(len(lower) - 1, -1, -1):
        for j in range(i + 1, len(lower)):
            found[i] -= lower[j][i] * found[j]
        found[i] /= lower[i][i]
    return found
