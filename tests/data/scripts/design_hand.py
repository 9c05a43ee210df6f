"""A hand that lays points, and the script that it writes: what the three designs have in common.

The hand is slow at the ends of a stroke and presses less there; its points are off by a tremor of about 1 mm: a
slow wander (standard deviation 0.8 mm an axis, correlated over some five points) and a jitter (0.5 mm).
"""

import json
import math
import random

from design_math import Surface, mirrored_x, norm, sub

WANDER_M = 0.0008
WANDER_MEMORY = 0.8  # Correlation from one point to the next.
JITTER_M = 0.0005
FRAME_NS = 1_000_000_000 // 30  # One point a camera frame (A1).
PAUSE_NS = 900_000_000

# A mean of n wandering points varies as if there were n * (1 - m) / (1 + m) of them.
_SPREAD_M2 = WANDER_M**2 * (1 + WANDER_MEMORY) / (1 - WANDER_MEMORY) + JITTER_M**2


def truth_tolerance(count, degree):
    """How far a fit of `count` points may be from what the hand followed, in the middle of its points: three standard
    errors of a least-squares fit, whose variance is the points' times (number of coefficients) / count."""
    return 3 * math.sqrt(_SPREAD_M2 * (degree + 1) * (degree + 2) / 2 / count)


class Hand:
    """Numbers are rounded where they are made, to a micrometre, so that the script holds what is reckoned with."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.time_ns = 1_000_000_000

    def stroke(self, path, spacing, tremor=1.0):
        """Points (position, pressure, time, tremor) along path(t), t = 0..1, about `spacing` metres apart."""
        fine = [path(k / 200) for k in range(201)]
        length = sum(norm(sub(b, a)) for a, b in zip(fine, fine[1:]))
        count = max(4, round(length / spacing) + 1)
        wander = [self.random.gauss(0, WANDER_M) for _ in range(3)]
        grip = self.random.uniform(0.7, 0.9)
        points = []
        for k in range(count):
            t = k / (count - 1)
            t = 0.6 * t + 0.4 * (1 - math.cos(math.pi * t)) / 2
            fresh = math.sqrt(1 - WANDER_MEMORY**2)
            wander = [WANDER_MEMORY * w + fresh * self.random.gauss(0, WANDER_M) for w in wander]
            true = path(t)
            off = tuple(tremor * (w + self.random.gauss(0, JITTER_M)) for w in wander)
            position = tuple(round(p + o, 6) for p, o in zip(true, off))
            grip = min(0.95, max(0.55, grip + self.random.gauss(0, 0.02)))
            pressure = round(grip * (0.4 + 0.6 * min(1.0, math.sin(math.pi * t) * 2.5)), 3)
            points.append((position, pressure, self.time_ns, off))
            self.time_ns += FRAME_NS
        self.time_ns += PAUSE_NS
        return points


def vec(p):
    return {"x": p[0], "y": p[1], "z": p[2]}


class Shape:
    """A shape as the script should have made it: points [position, pressure], and where they were meant to be."""

    def __init__(self, symmetric):
        self.symmetric = symmetric
        self.points = []
        self.meant = []
        self.surface = None

    def fit(self, degree):
        self.surface = Surface(self.points, degree, self.surface.frame if self.surface else None)
        return self.surface

    def rms_of_intent(self):
        """Weighted rms distance of the points from the surface of this kind that is nearest to what the hand meant.
        The fit is nearest to the points themselves, so it leaves no more; the difference is what it takes of the
        tremor into its shape."""
        meant = Surface(list(zip(self.meant, (w for _, w in self.points))), self.surface.degree, self.surface.frame)
        return meant.weighted_rms(self.points)


class Script:
    def __init__(self, seed, *about):
        self.hand = Hand(seed)
        self.lines = []
        self.shapes = {}
        self.comment(*about)

    def comment(self, *lines):
        self.lines += ["# " + line for line in lines]

    def do(self, operation, **members):
        self.lines.append(json.dumps({operation: members}))

    def query(self, kind, **members):
        self.lines.append(json.dumps({"query": {kind: members}}))

    def expect(self, kind, members, path, **holds):
        for key, value in holds.items():
            if isinstance(value, float):
                holds[key] = round(value, 7)
        self.lines.append(json.dumps({"expect": {"query": {kind: members}, "path": path, **holds}}))

    # --- laying and fitting

    def create(self, entity, name, degree, symmetry="OFF"):
        self.do("createDualShape", id=entity, name=name, degree=degree)
        if symmetry != "OFF":
            self.do("setSymmetry", entity=entity, mode=symmetry, plane={"normal": {"x": 1}})
        self.shapes[entity] = Shape(symmetry == "SAME_SHAPE")

    def lay(self, entity, place, paths, spacing):
        """One stroke for each path(t) -> (u, v), over what the hand has in mind: place(u, v)."""
        shape = self.shapes[entity]
        for path in paths:
            laid = self.hand.stroke(lambda t, path=path: place(*path(t)), spacing)
            self.do("addPoints", entity=entity, points=[
                {"position": vec(p), "pressure": w, "timeNs": str(time)} for p, w, time, _ in laid])
            for p, w, _, off in laid:
                shape.points.append((p, w))
                shape.meant.append(sub(p, off))
                if shape.symmetric:
                    shape.points.append((mirrored_x(p), w))
                    shape.meant.append(mirrored_x(sub(p, off)))

    def fit(self, entity, degree):
        self.do("fit", entity=entity, degree=degree)
        self.shapes[entity].fit(degree)
        self.expect_residuals(entity)

    def expect_residuals(self, entity):
        """The points are no farther from the surface than from the one that was meant, and not so near as if it
        followed their tremor, of which a polynomial of few terms takes up less than half."""
        rms = self.shapes[entity].rms_of_intent()
        self.expect("surface", {"entity": entity}, "surface.residuals.weightedRmsM", atMost=1.001 * rms,
                    atLeast=0.5 * rms)

    # --- looking at the result

    def look(self, entity, origin, direction, place=None, tolerance=None):
        """Whoever looks from `origin` along `direction` sees `entity`, within `tolerance` of `place`."""
        ray = {"origin": vec(origin), "direction": vec(direction)}
        self.expect("pick", ray, "pick.entity", equals=entity)
        if place:
            place = tuple(round(c, 6) for c in place)
            self.expect("pick", ray, "pick.position", near=vec(place), tolerance=tolerance)

    def look_past(self, origin, direction):
        self.expect("pick", {"origin": vec(origin), "direction": vec(direction)}, "pick.entity", equals="")

    def write(self, path):
        path.write_text("\n".join(self.lines) + "\n", encoding="utf-8")


def noisy_curve(hand, path, spacing, tremor=1.0):
    """A drawn curve: places, and the message's points."""
    laid = hand.stroke(path, spacing, tremor)
    places = [p for p, _, _, _ in laid]
    return places, [{"position": vec(p), "pressure": w, "timeNs": str(time)} for p, w, time, _ in laid]


def polyline(corners):
    """path(t) of constant speed along corners."""
    lengths = [0.0]
    for a, b in zip(corners, corners[1:]):
        lengths.append(lengths[-1] + norm(sub(b, a)))

    def path(t):
        s = min(max(t, 0.0), 1.0) * lengths[-1]
        k = max(i for i in range(len(corners) - 1) if lengths[i] <= s or i == 0)
        f = (s - lengths[k]) / (lengths[k + 1] - lengths[k])
        return tuple(a + f * (b - a) for a, b in zip(corners[k], corners[k + 1]))

    return path
