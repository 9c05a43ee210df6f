"""Python's values into a message's fields, in protobuf's JSON form; what does not fit is told by its field.

Fields may be named as in the .proto or lowerCamelCase; 64-bit numbers may be texts, bytes are base64 (proto/SCRIPT.md).
Arrays and tuples count as lists, numpy's numbers as numbers. None is as if left out.
"""

import base64
import binascii
import functools
import json
import math
import numbers
import re
from collections.abc import Mapping

from google.protobuf.descriptor import FieldDescriptor

from handloft.errors import Refused

MOST_SHOWN = 60
LARGEST_FLOAT32 = 3.4028234663852886e38
WHOLE = {
    FieldDescriptor.CPPTYPE_INT32: (-(1 << 31), (1 << 31) - 1),
    FieldDescriptor.CPPTYPE_UINT32: (0, (1 << 32) - 1),
    FieldDescriptor.CPPTYPE_INT64: (-(1 << 63), (1 << 63) - 1),
    FieldDescriptor.CPPTYPE_UINT64: (0, (1 << 64) - 1),
}


def fill(message, value, where=""):
    """Refused with the path from `where` on, as "add_points.points[3].pressure"; then the message is half filled."""
    if not isinstance(value, Mapping):
        raise _fault(value, _object_of(message.DESCRIPTOR), where)
    known = _fields_of(message.DESCRIPTOR)
    chosen = {}
    for name, member in value.items():
        field = known.get(name)
        if field is None:
            raise _unknown(message.DESCRIPTOR, name, where)
        if member is None:
            continue
        at = "%s.%s" % (where, field.name) if where else field.name
        # Several names of one field, or fields of which only one can be.
        other = chosen.setdefault(field.containing_oneof.full_name if field.containing_oneof else field.name, name)
        if other != name:
            raise Refused("invalid_argument", at, 'found "%s" beside "%s", expected one of them' % (name, other))
        _fill_field(message, field, member, at)


def _fill_field(message, field, value, at):
    if hasattr(value, "tolist"):
        value = value.tolist()
    is_message = field.cpp_type == FieldDescriptor.CPPTYPE_MESSAGE
    if field.label == FieldDescriptor.LABEL_REPEATED:
        if not isinstance(value, (list, tuple)):
            raise _fault(value, "a list", at)
        to = getattr(message, field.name)
        for i, one in enumerate(value):
            if is_message:
                fill(to.add(), one, "%s[%d]" % (at, i))
            else:
                to.append(_scalar(field, one, "%s[%d]" % (at, i)))
    elif is_message:
        inner = getattr(message, field.name)
        inner.SetInParent()  # there, even if empty
        fill(inner, value, at)
    else:
        setattr(message, field.name, _scalar(field, value, at))


def _scalar(field, value, at):
    if hasattr(value, "tolist"):
        value = value.tolist()
    kind = field.cpp_type
    if kind in WHOLE:
        least, most = WHOLE[kind]
        number = _whole(value)
        if number is None or not least <= number <= most:
            raise _fault(value, "a whole number from %d to %d" % (least, most), at)
        return number
    if kind in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        number = _number(value)
        if number is None or (kind == FieldDescriptor.CPPTYPE_FLOAT and abs(number) > LARGEST_FLOAT32):
            raise _fault(value, "a number", at)
        return number
    if kind == FieldDescriptor.CPPTYPE_BOOL:
        if not isinstance(value, bool):
            raise _fault(value, "true or false", at)
        return value
    if kind == FieldDescriptor.CPPTYPE_ENUM:
        return _enumerator(field.enum_type, value, at)
    return _bytes(value, at) if field.type == FieldDescriptor.TYPE_BYTES else _text(value, at)


def _whole(value):
    if isinstance(value, bool):
        return None
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, str) and re.fullmatch(r"-?[0-9]{1,20}", value, re.ASCII):
        return int(value)
    return None


def _number(value):
    """Finite, else None."""
    if isinstance(value, str):
        if not re.fullmatch(r"[-+.eE0-9]+", value, re.ASCII):
            return None
    elif isinstance(value, bool) or not hasattr(value, "__float__"):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _enumerator(kind, value, at):
    known = _enumerators_of(kind)
    if isinstance(value, str) and value in known:
        return known[value]
    number = _whole(value)
    if number is None or not -(1 << 31) <= number < 1 << 31:
        raise _fault(value, "one of " + ", ".join(known), at)
    return number


def _text(value, at):
    if not isinstance(value, str):
        raise _fault(value, "text", at)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise _fault(value, "text that is Unicode", at) from None
    return value


def _bytes(value, at):
    try:
        # Both alphabets, with padding or without.
        return base64.b64decode((value + "=" * (-len(value) % 4)).translate({45: "+", 95: "/"}), validate=True)
    except (TypeError, AttributeError, ValueError, binascii.Error):
        raise _fault(value, "bytes in base64", at) from None


@functools.lru_cache(maxsize=None)
def _fields_of(descriptor):
    return {name: field for field in descriptor.fields for name in (field.json_name, field.name)}


@functools.lru_cache(maxsize=None)
def _enumerators_of(kind):
    return {one.name: one.number for one in kind.values}


def _object_of(descriptor):
    names = [field.name for field in descriptor.fields]
    return "an object with " + ", ".join(names) if 0 < len(names) <= 8 else "an object"


def _unknown(descriptor, name, where):
    bodies = descriptor.oneofs_by_name.get("body")  # of an operation or a query: which one it is
    kind = descriptor.name.lower() if bodies else "field"
    names = [field.name for field in (bodies or descriptor).fields]
    expected = "one of " + ", ".join(names) if names else "none"
    name = str(name).encode(errors="backslashreplace").decode()
    path = "%s.%s" % (where, name) if where else name
    return Refused("invalid_argument", path, 'found the unknown %s "%s", expected %s' % (kind, name, expected))


def _fault(value, expected, at):
    return Refused("invalid_argument", at, "found %s, expected %s" % (shown(value), expected))


def shown(value):
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, (list, tuple)):
        return "a list"
    if isinstance(value, str):
        value = value[: MOST_SHOWN + 1]
    try:
        text = json.dumps(value) if value is None or isinstance(value, (str, float, int)) else repr(value)
    except ValueError:  # Python does not write what has thousands of digits
        return "a number of too many digits"
    text = " ".join(text.split())  # one line
    return text if len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + "..."
