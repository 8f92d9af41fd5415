"""JSON against a schema, slowly: whether a message has the fields of its schema, all of them and no others.

Knows the words that Foxglove's schemas use and refuses every other word, so that none goes unchecked.
"""

import base64

ABOUT = {"title", "description", "$comment"}
TYPES = {"string": str, "boolean": bool, "array": list, "object": dict}


def problems(value, schema, place=""):
    """What is wrong with `value`, a line each."""
    words = set(schema) - ABOUT
    if "oneOf" in schema:
        assert words == {"oneOf"}, place
        if value not in [one["const"] for one in schema["oneOf"]] or isinstance(value, bool):
            yield f"{place}: {value!r} is none of the values"
        return
    kind = schema["type"]
    if kind in ("number", "integer"):
        assert words <= {"type", "minimum", "maximum"}, (place, words)
        if isinstance(value, bool) or not isinstance(value, int if kind == "integer" else (int, float)):
            yield f"{place}: {value!r} is no {kind}"
        elif not schema.get("minimum", value) <= value <= schema.get("maximum", value):
            yield f"{place}: {value!r} is out of range"
        return
    if not isinstance(value, TYPES[kind]):
        yield f"{place}: {value!r} is no {kind}"
    elif kind == "object":
        assert words <= {"type", "properties", "required"}, (place, words)
        if set(value) != set(schema["properties"]):
            yield f"{place}: fields {sorted(set(value) ^ set(schema['properties']))}"
        for name in value.keys() & schema["properties"].keys():
            yield from problems(value[name], schema["properties"][name], f"{place}.{name}")
    elif kind == "array":
        assert words <= {"type", "items", "minItems", "maxItems"}, (place, words)
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            yield f"{place}: {len(value)} items"
        for index, part in enumerate(value):
            yield from problems(part, schema["items"], f"{place}[{index}]")
    elif kind == "string":
        assert words <= {"type", "contentEncoding"}, (place, words)
        if schema.get("contentEncoding") == "base64":
            base64.b64decode(value, validate=True)
