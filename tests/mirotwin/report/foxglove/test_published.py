"""Each derived message is what Foxglove published, field for field: by the protobuf classes in its own package."""

import base64
import importlib
from collections import Counter

import msgspec
import pytest
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto

from mirotwin.recording import channels
from mirotwin.report.foxglove import messages

NAMES = ("FrameTransforms", "SceneUpdate", "CompressedImage", "CameraCalibration", "Log")
FOXGLOVE = [f"foxglove.{name}" for name in NAMES]


def of_protobuf(name):
    """The class of that schema in Foxglove's package."""
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)


KINDS = {
    "time": ("Timestamp",),
    "duration": ("Duration",),
    "boolean": (FieldDescriptorProto.TYPE_BOOL,),
    "number": (FieldDescriptorProto.TYPE_DOUBLE,),
    "integer": (FieldDescriptorProto.TYPE_FIXED32, FieldDescriptorProto.TYPE_ENUM),
    "string": (FieldDescriptorProto.TYPE_STRING, FieldDescriptorProto.TYPE_BYTES),
}
"""Title or type of a JSON schema -> protobuf."""


def many(field):
    """Whether a field is repeated; how to ask a descriptor depends on its version."""
    proto = DescriptorProto()
    field.containing_type.CopyToProto(proto)
    return proto.field[field.index].label == FieldDescriptorProto.LABEL_REPEATED


def schema_fields(schema, descriptor, place):
    """Where a JSON schema has fields that the protobuf message lacks, or has in another order or of other kinds."""
    published = [field for field in descriptor.fields if field.name in schema["properties"]]
    names = [field.name for field in published]
    found = [] if list(schema["properties"]) == names else [f"{place}: {list(schema['properties'])}, {names}"]
    for field in published:
        part = schema["properties"][field.name]
        inner = part.get("items", part)
        inside = field.message_type
        if (part.get("type") == "array") is not many(field):
            found.append(f"{place}.{field.name}: one or many")
        if inside is not None and inside.file.package == "foxglove":
            found += schema_fields(inner, inside, f"{place}.{field.name}")
        elif (inside.name if inside else field.type) not in KINDS[inner.get("title", inner["type"])]:
            found.append(f"{place}.{field.name}: {inner}")
    return found


def fill(message, content):
    """Puts JSON into a protobuf message, by the names of its fields; a name that it has not raises."""
    for name, value in content.items():
        field = message.DESCRIPTOR.fields_by_name[name]
        if field.message_type is not None and field.message_type.file.package == "google.protobuf":
            getattr(message, name).seconds = value["sec"]
            getattr(message, name).nanos = value["nsec"]
        elif field.message_type is not None and many(field):
            for part in value:
                fill(getattr(message, name).add(), part)
        elif field.message_type is not None:
            getattr(message, name).SetInParent()
            fill(getattr(message, name), value)
        elif many(field):
            getattr(message, name).extend(value)
        else:
            raw = base64.b64decode(value) if field.type == field.TYPE_BYTES else value
            setattr(message, name, raw)


def back(message, content):
    """The fields that `content` has, out of a protobuf message, as JSON."""
    found = {}
    for name, inner in content.items():
        field, value = message.DESCRIPTOR.fields_by_name[name], getattr(message, name)
        if field.message_type is not None and field.message_type.file.package == "google.protobuf":
            found[name] = {"sec": value.seconds, "nsec": value.nanos}
        elif field.message_type is not None and many(field):
            found[name] = [back(*pair) for pair in zip(value, inner, strict=True)]
        elif field.message_type is not None:
            found[name] = back(value, inner)
        elif many(field):
            found[name] = list(value)
        else:
            found[name] = base64.b64encode(value).decode() if isinstance(value, bytes) else value
    return found


@pytest.mark.parametrize(
    ("names", "of", "published"),
    [
        (("LINE_STRIP", "LINE_LOOP", "LINE_LIST"), "LinePrimitive", "Type"),
        (("INFO", "WARNING", "ERROR"), "Log", "Level"),
    ],
)
def test_the_constants_are_the_published_ones(names, of, published):
    values = of_protobuf(of).DESCRIPTOR.enum_types_by_name[published].values_by_name
    assert [getattr(messages, name) for name in names] == [values[name].number for name in names]


@pytest.mark.parametrize("name", NAMES)
def test_the_schemas_that_are_written_have_the_fields_of_foxgloves_protobuf_messages(name):
    schema = msgspec.json.decode(channels.schema_text(getattr(messages, name)))
    assert schema["title"] == name
    assert schema_fields(schema, of_protobuf(name).DESCRIPTOR, name) == []


def strict(schema):
    """A JSON schema in which objects have all of their fields and no others."""
    if isinstance(schema, list):
        return [strict(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    found = {name: strict(part) for name, part in schema.items()}
    if found.get("type") == "object":
        found |= {"required": list(found["properties"]), "additionalProperties": False}
    return found


@pytest.mark.develop
def test_each_message_fits_its_schema(shown):
    jsonschema = pytest.importorskip("jsonschema", reason="needs the extra develop")
    found = [one for one in shown if one.topic.startswith("/foxglove/")]
    checkers = {one.name: jsonschema.Draft202012Validator(strict(one.schema)) for one in found}
    wrong = [error for one in found for error in checkers[one.name].iter_errors(one.content)]
    assert wrong[:5] == []
    assert checkers.keys() == {*FOXGLOVE, "mirotwin.Error"}


def test_each_message_goes_through_foxgloves_protobuf_classes_unchanged(shown):
    counts = Counter()
    for one in shown:
        if one.name in FOXGLOVE and one.topic.startswith("/foxglove/"):
            kind = of_protobuf(one.name.removeprefix("foxglove."))
            message = kind()
            fill(message, one.content)
            assert back(kind.FromString(message.SerializeToString()), one.content) == one.content
            counts[one.name] += 1
    assert set(counts) == set(FOXGLOVE)
    assert min(counts.values()) >= 2
