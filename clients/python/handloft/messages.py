"""The protocol's messages, as protoc has them, and how Python's values become fields."""

from handloft import fields
from handloft._proto import operation_pb2, query_pb2, scene_pb2, session_pb2  # noqa: F401
from handloft.errors import Refused

Envelope = session_pb2.Envelope
Operation = operation_pb2.Operation
Query = query_pb2.Query

ROLES = {
    "viewer": session_pb2.ROLE_VIEWER,
    "editor": session_pb2.ROLE_EDITOR,
    "commenter": session_pb2.ROLE_COMMENTER,
    "owner": session_pb2.ROLE_OWNER,
}
LEVELS = {
    None: session_pb2.SAVE_LEVEL_UNSPECIFIED,
    "applied": session_pb2.SAVE_LEVEL_APPLIED,
    "durable": session_pb2.SAVE_LEVEL_DURABLE,
}


def name_of(names, value):
    return next((name for name, number in names.items() if number == value and name), "")


def vec3(message, values):
    """x, y, z of a list, a tuple or an array."""
    x, y, z = values
    message.x, message.y, message.z = float(x), float(y), float(z)


def operation_of(what):
    """An Operation of one, or of a dict in its JSON form: {"rename": {"entity": "top", "name": "Lid"}}."""
    operation = Operation()
    if isinstance(what, Operation):
        operation.CopyFrom(what)
    else:
        _fill(operation, what, "operation")
    return operation


def query_of(what):
    """A Query of one, or of a dict in its JSON form: {"surface": {"entity": "top"}}."""
    if isinstance(what, Query):
        return what
    query = Query()
    _fill(query, what, "query")
    return query


def _fill(message, what, called):
    """Errors are told from inside on, as the server does: "fit.degree", not "operation.fit.degree"."""
    if not isinstance(what, dict):
        raise Refused("invalid_argument", called, "found %s, expected a dict or a message" % fields.shown(what))
    fields.fill(message, what)


def plain(message):
    """A message as dicts, lists and numbers; fields as the .proto has them, 64-bit numbers as numbers."""
    result = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        if field.label == field.LABEL_REPEATED:
            result[field.name] = [_plain_value(field, one) for one in value]
        elif field.type == field.TYPE_MESSAGE or field.containing_oneof is not None:
            if message.HasField(field.name):
                result[field.name] = _plain_value(field, value)
        else:
            result[field.name] = _plain_value(field, value)
    return result


def _plain_value(field, value):
    if field.type == field.TYPE_MESSAGE:
        return plain(value)
    if field.type == field.TYPE_ENUM:
        known = field.enum_type.values_by_number.get(value)
        return known.name if known else value
    return value
