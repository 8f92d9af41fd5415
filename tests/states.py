"""The states of parts, taken once: for more than that, a `Flat` is kept."""

from miro_exact.state import Flat


def snapshot(part):
    """The state of a part and of all below it."""
    return Flat(part).save()


def restore(part, data):
    """Puts back what `snapshot` gave of a part built alike. Raises ValueError and changes nothing for anything else."""
    Flat(part).load(data)


def values(part):
    """Path -> value of every field of a part and of all below it."""
    flat = Flat(part)
    return flat.decode(flat.save())


def difference(flat, one, other):
    """Path and both values of the first field that differs between two states, None if none does."""
    first, second = flat.decode(one), flat.decode(other)
    return next(((path, first[path], second[path]) for path in first if first[path] != second[path]), None)
