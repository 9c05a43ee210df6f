"""What a viewer sees: the scene, kept up to date from snapshots and deltas (proto/scene.proto)."""

import copy
import struct

from handloft import mesh_codec, messages
from handloft._proto import operation_pb2
from handloft.errors import ProtocolError

try:
    import numpy
except ImportError:  # all works without, with lists of tuples
    numpy = None

MAX_POINTS = 1 << 24


def rows(values, width):
    """An (n, width) array where numpy is there, else the list of tuples."""
    if numpy is None:
        return values
    return numpy.array(values, dtype=float).reshape(-1, width)


class Surface:
    """A triangle mesh. Its parts are decoded when they are looked at."""

    def __init__(self, message, known):
        self._message = message
        self._indices = None
        self._vertices = None
        if message.topology and message.index_count and not message.indices:
            if known is None or known._message.topology != message.topology:
                raise ProtocolError("found a mesh without its triangles")
            self._triangles_of = known._triangles_of
        else:
            self._triangles_of = message

    @property
    def vertices(self):
        """Metres, world: x, y, z of each."""
        return rows(self._decoded()[0], 3)

    @property
    def normals(self):
        return rows(self._decoded()[1], 3)

    def _decoded(self):
        if self._vertices is None:
            self._vertices = mesh_codec.decode_vertices_of(self._message)
        return self._vertices

    @property
    def opacity(self):
        """0 to 1 a vertex: what the trim leaves to see."""
        return mesh_codec.decode_opacity(self._message)

    @property
    def triangles(self):
        """Three indices of vertices each, anticlockwise seen from the normals' side."""
        of = self._triangles_of
        if self._indices is None:
            self._indices = mesh_codec.decode_indices(of.indices, of.index_count, of.vertex_count) if of.index_count else []
        flat = self._indices
        if numpy is not None:
            return numpy.array(flat, dtype=int).reshape(-1, 3)
        return [tuple(flat[i : i + 3]) for i in range(0, len(flat), 3)]


class Entity:
    """Of the scene; a value, which never changes. `message` is its last EntityState as it came, for what has no attribute
    here."""

    def __init__(self, identifier):
        self.id = identifier
        self.name = self.kind = ""
        self.revision = 0
        self.representation = ""
        self.provisional = self.selected = False
        self.leased_by = 0
        self.leased_by_name = ""
        self.residual_rms_m = 0.0
        self.surface = None
        self.surface_id = 0
        self.curves, self.icons = [], []
        self.message = None
        # Lists that grow, shared with what this entity was before; its own are the first _count of them.
        self._positions, self._pressures, self._count = [], [], 0

    @property
    def points(self):
        """Metres, world: x, y, z of each, in order of arrival."""
        return rows(self._positions[: self._count], 3)

    @property
    def pressures(self):
        own = self._pressures[: self._count]
        return numpy.array(own) if numpy is not None else own

    def _after(self, message):
        """As it is after this message."""
        entity = copy.copy(self)
        entity._take(message)
        return entity

    def _take(self, message):
        self.message = message
        self.name, self.kind, self.revision = message.name, message.kind, message.revision
        names = operation_pb2.Representation.DESCRIPTOR.values_by_number
        known = names.get(message.representation)
        self.representation = known.name[len("REPRESENTATION_") :].lower() if known else ""
        self.provisional, self.selected = message.provisional, message.selected
        self.leased_by, self.leased_by_name = message.leased_by, message.leased_by_name
        self.residual_rms_m = message.residual_rms_m
        if message.HasField("points"):
            self._take_points(message.points)
        if message.HasField("surface"):
            self.surface = Surface(message.surface, self.surface)
            self.surface_id = message.surface_id
        elif not message.surface_shown:
            self.surface, self.surface_id = None, 0
        if message.curves_shown:
            self.curves = [messages.plain(one) for one in message.curves]
            for curve in self.curves:
                curve["points"] = rows(list(struct.iter_unpack("<3f", curve["points"])), 3)
        if message.icons_shown:
            self.icons = [messages.plain(one) for one in message.icons]

    def _take_points(self, cloud):
        count = cloud.total - cloud.first
        if not 0 <= count <= MAX_POINTS or cloud.first > self._count:
            raise ProtocolError("found points %d to %d, this side has %d" % (cloud.first, cloud.total, self._count))
        if len(cloud.positions) != 12 * count or len(cloud.styles) != 2 * count:
            raise ProtocolError("found %d bytes of %d points" % (len(cloud.positions), count))
        x0, y0, z0, step = cloud.origin.x, cloud.origin.y, cloud.origin.z, cloud.step_m
        if cloud.first != len(self._positions):
            self._positions, self._pressures = self._positions[: cloud.first], self._pressures[: cloud.first]
        for x, y, z in struct.iter_unpack("<3i", cloud.positions):
            self._positions.append((x0 + step * x, y0 + step * y, z0 + step * z))
        for (style,) in struct.iter_unpack("<H", cloud.styles):
            if style >= len(cloud.palette):
                raise ProtocolError("found a point of style %d of %d" % (style, len(cloud.palette)))
            self._pressures.append(cloud.palette[style].pressure)
        self._count = cloud.total


class Scene:
    """The whole of it. What watch() gives never changes."""

    def __init__(self):
        self.epoch = self.sequence = 0
        self.entities = {}
        self.history = self.storage = None
        self.alternatives, self.comments, self.versions, self.people = {}, [], [], []

    def entity(self, identifier):
        return self.entities[identifier]

    def _still(self):
        """As it is now."""
        scene = copy.copy(self)
        scene.entities = dict(self.entities)
        return scene

    def _take_snapshot(self, message):
        self.entities = {}
        self.epoch = message.epoch
        self._take(message, message.entities)
        return list(self.entities)

    def _take_delta(self, message):
        if message.epoch != self.epoch:
            raise ProtocolError("found a change of another scene")
        for identifier in message.removed:
            self.entities.pop(identifier, None)
        self._take(message, message.changed)

    def _take(self, message, states):
        self.sequence = message.sequence
        for state in states:
            try:
                self.entities[state.id] = self.entities.get(state.id, Entity(state.id))._after(state)
            except (ValueError, struct.error) as problem:
                raise ProtocolError("%s: %s" % (state.id, problem)) from problem
        if message.HasField("history"):
            self.history = messages.plain(message.history)
        if message.HasField("alternatives"):
            self.alternatives = messages.plain(message.alternatives)
        if message.HasField("storage"):
            self.storage = messages.plain(message.storage)
        if message.HasField("comments"):
            self.comments = messages.plain(message.comments)["comments"]
        if message.HasField("versions"):
            self.versions = messages.plain(message.versions)["versions"]

    def _held(self, join):
        """What is held, so that the server sends only what differs."""
        join.epoch = self.epoch
        for one in self.entities.values():
            held = join.have.add()
            held.id, held.revision, held.points = one.id, one.revision, one._count
            held.surface_id = one.surface_id


class Change:
    """What watch() yields. `changed` and `removed` are ids; after a whole snapshot `whole` is true and all are changed."""

    def __init__(self, scene, whole, changed, removed, capture_time_ns, presences):
        self.scene, self.whole = scene, whole
        self.changed, self.removed = changed, removed
        self.capture_time_ns = capture_time_ns
        self.presences = presences  # of others, newest of each, as dicts

    def __repr__(self):
        return "<Change sequence=%d changed=%s removed=%s>" % (self.scene.sequence, self.changed, self.removed)
