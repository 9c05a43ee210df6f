"""What the sculpted designs have in common: a script that adds icons, drags them and looks at what became of it.

Nothing is computed here that the server should: a surface passes where its position icons were dragged to, a region
moves as a body, a derivative turns with its arrow, and plates are in the books.
"""

import json
import math

from design_hand import Script, vec


def turn(axis, degrees):
    """A rotation about one of the world's axes, "x", "y" or "z"."""
    half = math.radians(degrees) / 2
    return {"w": math.cos(half), axis: math.sin(half)}


class SculptScript(Script):
    def icon(self, entity, icon, *parameters, **members):
        self.do("addIcon", entity=entity, id=icon, parameters=[{"x": u, "y": v} for u, v in parameters], **members)

    def icon_near(self, entity, icon, *places, **members):
        self.do("addIcon", entity=entity, id=icon, places=[vec(p) for p in places], **members)

    def drag(self, entity, icon, by=(0, 0, 0), **members):
        self.do("dragIcon", entity=entity, icon=icon, translation=vec(by), **members)

    def change(self, entity, icon, **members):
        self.do("changeIcon", entity=entity, icon=icon, **members)

    def holds(self, kind, members, path, **what):
        """As expect(), with all digits."""
        self.lines.append(json.dumps({"expect": {"query": {kind: members}, "path": path, **what}}))

    def at(self, entity, u, v, place, tolerance=1e-9):
        self.holds("evaluate", {"entity": entity, "at": [{"x": u, "y": v}]}, "evaluate.positions.0", near=vec(place),
                   tolerance=tolerance)

    def height(self, entity, u, v, z, tolerance=1e-9):
        self.holds("evaluate", {"entity": entity, "at": [{"x": u, "y": v}]}, "evaluate.positions.0.z", near=z,
                   tolerance=tolerance)

    def normal(self, entity, u, v, normal, tolerance=1e-9):
        self.holds("evaluate", {"entity": entity, "at": [{"x": u, "y": v}]}, "evaluate.normals.0", near=vec(normal),
                   tolerance=tolerance)

    def of_icon(self, entity, index, member, **what):
        self.holds("sculpt", {"entity": entity}, f"sculpt.icons.{index}.{member}", **what)

    def at_rest(self, entity):
        self.holds("sculpt", {"entity": entity}, "sculpt.maxDisplacementM", equals=0)

    def control(self, entity, **what):
        self.holds("sculpt", {"entity": entity, "control": True}, "sculpt.surface.control", **what)

    def refused(self, operation, code, field, **members):
        self.lines.append(json.dumps({"expect": {"fails": {operation: members}, "code": code, "field": field}}))
