"""Paths of keys in nested tables, written down the long way."""


def scalar_places(value, path=""):
    """(path, value) of everything in the tables that is no table and no list of tables."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from scalar_places(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, item in enumerate(value):
            yield from scalar_places(item, f"{path}.{index}")
    else:
        yield path, value
