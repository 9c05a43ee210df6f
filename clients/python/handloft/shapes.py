"""A shape that is points and surface at once, by its id."""

from handloft import messages
from handloft.errors import Refused
from handloft.fields import shown
from handloft.scene import numpy, rows


def add_point_messages(to, points, pressure):
    """Rows of x, y, z: a list, a tuple, an array. pressure: one for all, or one each."""
    rows = points.tolist() if hasattr(points, "tolist") else points
    each = pressure.tolist() if hasattr(pressure, "tolist") else pressure
    rows = list(rows)
    try:
        each = [float(each)] * len(rows) if isinstance(each, (int, float)) else [float(one) for one in each]
    except (TypeError, ValueError):
        raise Refused("invalid_argument", "pressure", "found %s, expected a number, or one a point" % shown(pressure)) from None
    if len(each) != len(rows):
        raise Refused("invalid_argument", "pressure", "found %d, expected %d, one a point" % (len(each), len(rows)))
    for i, (row, weight) in enumerate(zip(rows, each)):
        message = to.add()
        try:
            messages.vec3(message.position, row)
        except (TypeError, ValueError) as problem:
            raise Refused("invalid_argument", "points[%d]" % i, "found %r, expected x, y, z" % (row,)) from problem
        message.pressure = weight


class DualShape:
    def __init__(self, model, identifier):
        self.model, self.id = model, identifier

    def __repr__(self):
        return "<DualShape %s>" % self.id

    def add_points(self, points, pressure=1.0, **options):
        """Points with their certainty, 0 to 1: the weight of the fit. options: those of addPoints, as stroke=1."""
        return self.model.add_points(self.id, points, pressure, **options)

    def fit(self, degree=0, *, automatic=False):
        return self.model.submit({"fit": {"entity": self.id, "degree": degree, "automaticDegree": automatic}})

    def surface(self):
        """Frame, degree, coefficients, residuals: a dict (proto/query.proto, SurfaceResult)."""
        return self.model.query("surface", entity=self.id)

    def points(self):
        """(positions, pressures)."""
        answer = self.model.ask({"points": {"entity": self.id}})
        positions = rows([(p.position.x, p.position.y, p.position.z) for p in answer.points], 3)
        pressures = [p.pressure for p in answer.points]
        return positions, numpy.array(pressures) if numpy is not None else pressures

    def evaluate(self, at):
        """World positions of the surface at local x, y of its frame, metres."""
        places = at.tolist() if hasattr(at, "tolist") else at
        query = messages.Query()
        query.evaluate.entity = self.id
        for x, y in places:
            place = query.evaluate.at.add()
            place.x, place.y = float(x), float(y)
        return rows([(p.x, p.y, p.z) for p in self.model.ask(query).positions], 3)

    def rename(self, name):
        return self.model.submit({"rename": {"entity": self.id, "name": name}})

    def show(self, what):
        """"points", "surface" or "both"."""
        return self.model.submit(
            {"setRepresentation": {"entity": self.id, "representation": "REPRESENTATION_" + what.upper()}}
        )

    def move(self, by, *, rotation=None, scale=1.0, pivot=(0.0, 0.0, 0.0)):
        """by: metres; rotation: w, x, y, z of a quaternion; about the pivot."""
        operation = messages.Operation()
        request = operation.transform
        request.entities.append(self.id)
        messages.vec3(request.translation, by)
        messages.vec3(request.pivot, pivot)
        request.scale = scale
        if rotation is not None:
            request.rotation.w, request.rotation.x, request.rotation.y, request.rotation.z = map(float, rotation)
        return self.model.submit(operation)

    def duplicate(self, identifier="", by=(0.0, 0.0, 0.0)):
        operation = messages.Operation()
        operation.duplicate.entity, operation.duplicate.id = self.id, identifier
        messages.vec3(operation.duplicate.translation, by)
        made = self.model.submit(operation)
        return DualShape(self.model, identifier or made.entities[0])

    def delete(self):
        return self.model.submit({"delete": {"entity": self.id}})
