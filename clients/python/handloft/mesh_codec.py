"""Meshes as they travel: residuals in Zstandard, where Python has it, or meshoptimizer's vertex codec (version 0) from
servers of protocol 1.2; meshoptimizer's index codec (versions 0, 1); octahedral normals.

The bytes may come from anybody: whatever they are, the answer is a mesh or a ValueError.
"""

import math
import struct

try:
    import zstandard
except ImportError:  # Then the server is told that this viewer is of protocol 1.2.
    zstandard = None

MAX_VERTICES = 1 << 20
MAX_INDICES = 6 << 20
NORMAL_LEVELS = 2047.0
_GROUP = 16
_TAIL_BYTES = 32


def decode_vertices(data, count, stride):
    """`count` vertices of `stride` bytes, one after another."""
    if count > MAX_VERTICES or not 0 < stride <= 256 or stride % 4:
        raise ValueError("found %d vertices of %d bytes" % (count, stride))
    tail = max(stride, _TAIL_BYTES)
    if len(data) < 1 + tail or data[0] != 0xA0:
        raise ValueError("found no encoded vertices")
    last = list(data[len(data) - stride :])
    at, end = 1, len(data) - tail
    out = bytearray(count * stride)
    per_block = min((8192 // stride) & ~(_GROUP - 1), 256)
    for first in range(0, count, per_block):
        size = min(per_block, count - first)
        groups = (size + _GROUP - 1) // _GROUP
        for k in range(stride):
            heads = at
            at += (groups + 3) // 4
            if at > end:
                raise ValueError("the encoded vertices are cut off")
            deltas = bytearray()
            for group in range(groups):
                kind = (data[heads + group // 4] >> (2 * (group % 4))) & 3
                if kind == 0:
                    deltas += bytes(_GROUP)
                    continue
                if kind == 3:
                    if at + _GROUP > end:
                        raise ValueError("the encoded vertices are cut off")
                    deltas += data[at : at + _GROUP]
                    at += _GROUP
                    continue
                bits = 2 if kind == 1 else 4
                packed = _GROUP * bits // 8
                more = at + packed
                if more > end:
                    raise ValueError("the encoded vertices are cut off")
                escape = (1 << bits) - 1
                per_byte = 8 // bits
                for i in range(_GROUP):
                    value = (data[at + i // per_byte] >> (8 - bits - bits * (i % per_byte))) & escape
                    if value == escape:
                        if more >= end:
                            raise ValueError("the encoded vertices are cut off")
                        value = data[more]
                        more += 1
                    deltas.append(value)
                at = more
            value = last[k]
            place = first * stride + k
            for i in range(size):
                delta = deltas[i]
                value = (value + ((delta >> 1) ^ -(delta & 1))) & 0xFF
                out[place] = value
                place += stride
            last[k] = value
    if at != end:
        raise ValueError("bytes are left behind the encoded vertices")
    return bytes(out)


def decode_indices(data, count, vertex_count):
    """`count` indices, three a triangle, each below vertex_count."""
    if count > MAX_INDICES or count % 3:
        raise ValueError("found %d indices, expected three a triangle" % count)
    end = len(data) - 16
    if len(data) < 1 + count // 3 + 16 or data[0] & 0xF0 != 0xE0 or data[0] & 0x0F > 1:
        raise ValueError("found no encoded indices")
    free = 13 if data[0] & 0x0F else 15
    edges = [(0, 0)] * 16
    vertices = [0] * 16
    edge_at = vertex_at = upcoming = last = 0
    at = 1 + count // 3
    out = []

    def read_free():
        nonlocal at, last
        value, shift = 0, 0
        for _ in range(5):
            if at >= end:
                raise ValueError("the encoded indices are cut off")
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                break
        last = (last + ((value >> 1) ^ -(value & 1))) & 0xFFFFFFFF
        return last

    def keep_vertex(vertex):
        nonlocal vertex_at
        vertices[vertex_at] = vertex
        vertex_at = (vertex_at + 1) & 15

    def keep_edge(a, b):
        nonlocal edge_at
        edges[edge_at] = (a, b)
        edge_at = (edge_at + 1) & 15

    for triangle in range(count // 3):
        code = data[1 + triangle]
        if code < 0xF0:
            a, b = edges[(edge_at - 1 - (code >> 4)) & 15]
            which = code & 15
            if which == 0:
                c = upcoming
                upcoming += 1
                keep_vertex(c)
            elif which < free:
                c = vertices[(vertex_at - 1 - which) & 15]
            else:
                if which == 15:
                    c = read_free()
                else:  # 13: one before the last free one, 14: one after
                    c = last = (last + (-1 if which == 13 else 1)) & 0xFFFFFFFF
                keep_vertex(c)
            keep_edge(c, b)
            keep_edge(a, c)
        else:
            first = 0
            if code < 0xFE:
                pair = data[end + (code & 15)]
            else:
                if at >= end:
                    raise ValueError("the encoded indices are cut off")
                pair = data[at]
                at += 1
                first = 0 if code == 0xFE else 15
                if pair == 0:
                    upcoming = 0
            second, third = pair >> 4, pair & 15
            a = b = c = 0
            if first == 0:
                a = upcoming
                upcoming += 1
            if second == 0:
                b = upcoming
                upcoming += 1
            else:
                b = vertices[(vertex_at - second) & 15]
            if third == 0:
                c = upcoming
                upcoming += 1
            else:
                c = vertices[(vertex_at - third) & 15]
            if first == 15:
                a = read_free()
            if second == 15 and code >= 0xFE:
                b = read_free()
            if third == 15 and code >= 0xFE:
                c = read_free()
            keep_vertex(a)
            if second == 0 or (second == 15 and code >= 0xFE):
                keep_vertex(b)
            if third == 0 or (third == 15 and code >= 0xFE):
                keep_vertex(c)
            keep_edge(b, a)
            keep_edge(c, b)
            keep_edge(a, c)
        if a >= vertex_count or b >= vertex_count or c >= vertex_count:
            raise ValueError("an index is beyond the %d vertices" % vertex_count)
        out += (a, b, c)
    if at != end:
        raise ValueError("bytes are left behind the encoded indices")
    return out


def decode_residuals(data, count, row):
    """Five lists of `count` numbers of 16 bits: x, y, z and the normal's two. PROTOCOL.md, "Meshes"."""
    if zstandard is None:
        raise ValueError("found residuals, but Python's zstandard is not installed")
    if count > MAX_VERTICES or row > count:
        raise ValueError("found %d vertices, %d a row" % (count, row))
    size = 10 * count
    try:
        if zstandard.get_frame_parameters(data).content_size != size:
            raise ValueError("the residuals are not those of %d vertices" % count)
        planes = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except zstandard.ZstdError as problem:
        raise ValueError("found no residuals: %s" % problem) from problem
    if len(planes) != size:
        raise ValueError("the residuals are cut off")
    row = row or max(count, 1)
    return [_from_residuals(planes[2 * k * count : (2 * k + 2) * count], count, row) for k in range(5)]


def _from_residuals(planes, count, row):
    values = [0] * count

    def straight_on(i, step):
        if i < step:
            return 0
        return values[i - step] if i < 2 * step else 2 * values[i - step] - values[i - 2 * step]

    for i in range(count):
        if i < row:
            predicted = straight_on(i, 1)
        elif i % row == 0:
            predicted = straight_on(i, row)
        else:
            predicted = values[i - 1] + values[i - row] - values[i - row - 1]
        folded = planes[i] | planes[count + i] << 8
        values[i] = (predicted + ((folded >> 1) ^ -(folded & 1))) & 0xFFFF
    return values


def decode_vertices_of(message):
    """Vertices of a Mesh message as (x, y, z), metres, and their unit normals."""
    count = message.vertex_count
    if count == 0:
        return [], []
    x0, y0, z0, step = message.origin.x, message.origin.y, message.origin.z, message.step_m
    if not all(math.isfinite(one) for one in (x0, y0, z0, step)):
        raise ValueError("the mesh lies nowhere")
    if message.residuals:
        xs, ys, zs, us, vs = decode_residuals(message.residuals, count, message.row)
        places = zip(xs, ys, zs)
        packed_normals = ((u - ((u & 0x8000) << 1), v - ((v & 0x8000) << 1)) for u, v in zip(us, vs))
    else:
        places = ((x, y, z) for x, y, z, _ in struct.iter_unpack("<4H", decode_vertices(message.positions, count, 8)))
        packed_normals = struct.iter_unpack("<2h", decode_vertices(message.normals, count, 4))
    positions = [(x0 + step * x, y0 + step * y, z0 + step * z) for x, y, z in places]
    return positions, [octahedral(u, v) for u, v in packed_normals]


def decode_opacity(message):
    """0 to 1 a vertex."""
    if message.residuals and not message.opacity:
        return [1.0] * message.vertex_count
    return [one / 255.0 for one in message.opacity]


def octahedral(x, y):
    x = max(-1.0, min(1.0, x / NORMAL_LEVELS))
    y = max(-1.0, min(1.0, y / NORMAL_LEVELS))
    z = 1.0 - abs(x) - abs(y)
    if z < 0.0:
        x, y = (1.0 - abs(y)) * math.copysign(1.0, x), (1.0 - abs(x)) * math.copysign(1.0, y)
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length
