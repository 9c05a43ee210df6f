"""The computer mouse of the paper's figure 14: a shell of 110 x 60 x 40 mm around given internals, and an alternative
with a thumb rest.

The mouse points along +y, stands on z = 0 and has x = 0 as its plane of symmetry; the thumb is at -x.
"""

import math

from design_hand import Script, noisy_curve, polyline, truth_tolerance, vec
from design_math import Surface, add, draw_profile, mirrored_x, push, scale
from design_seat import rows

DOWN = (0.0, 0.0, -1.0)
FROM_RIGHT = (-1.0, 0.0, 0.0)
INTERNALS = "mouse_internals.obj"

# Board, battery and sensor seen from the side: (y, height), millimetres, and the scroll wheel in front of them.
CHASSIS = [(-42, 9), (-36, 18), (-24, 27), (-2, 27), (8, 19), (18, 14)]
CHASSIS_FOOT, CHASSIS_HALF_WIDTH = 2, 19
WHEEL_Y, WHEEL_Z, WHEEL_RADIUS, WHEEL_HALF_WIDTH, WHEEL_SIDES = 32, 13, 10, 3.5, 16


def top(x, y):
    """Too low on purpose: the battery looks out of it."""
    return (x, y, 0.0288 - 9.0 * x**2 - 2.4 * (y + 0.008) ** 2)


def heel_cap(x, t):
    """Over the edge of the heel and down, t = 0..1."""
    return (x, -0.046 - 0.010 * math.sin(1.2 * t), 0.029 - 9.0 * x**2 - 0.005 * t - 0.010 * t**2)


def side(y, z):
    return (0.0295 - 0.14 * (z - 0.004) - 1.7 * (y + 0.004) ** 2 - 4.0 * (z - 0.012) ** 2, y, z)


def heel(x, z):
    return (x, -0.0545 + 9.5 * x**2 + 0.05 * (z - 0.004), z)


def nose(x, z):
    return (x, 0.0535 - 5.5 * x**2 - 0.10 * (z - 0.004), z)


def thumb_rest(s, y):
    """From the left side outwards, s = 0..1: a ledge that rises a little at its rim."""
    return (-0.0255 - 0.0165 * s, y, 0.0085 - 0.0045 * s + 0.0040 * s**2 - 2.0 * (y - 0.008) ** 2)


def internals_obj():
    """Closed and free of overlaps, wound outwards."""
    vertices, faces = [], []

    def prism(profile, half_width):
        """A closed profile in (y, z), against the clock as seen from +x, swept along x."""
        first, n = len(vertices) + 1, len(profile)
        for x in (-half_width, half_width):
            vertices.extend((x, y, z) for y, z in profile)
        for k in range(n):
            a, b = first + k, first + (k + 1) % n
            faces.append((a, b, b + n, a + n))
        return first, n

    heights = [(y, z) for y, z in CHASSIS]
    feet = [(y, CHASSIS_FOOT) for y, _ in CHASSIS]
    first, n = prism(feet + heights[::-1], CHASSIS_HALF_WIDTH)
    for k in range(len(CHASSIS) - 1):  # Caps as strips from foot to height.
        a, b, c, d = first + k, first + k + 1, first + n - 2 - k, first + n - 1 - k
        faces.append((a, d, c, b))
        faces.append((a + n, b + n, c + n, d + n))
    circle = [(WHEEL_Y + WHEEL_RADIUS * math.cos(2 * math.pi * k / WHEEL_SIDES),
               WHEEL_Z + WHEEL_RADIUS * math.sin(2 * math.pi * k / WHEEL_SIDES)) for k in range(WHEEL_SIDES)]
    first, n = prism(circle, WHEEL_HALF_WIDTH)
    faces.append(tuple(first + n - 1 - k for k in range(n)))
    faces.append(tuple(first + n + k for k in range(n)))
    lines = ["# A mouse's internals, millimetres: board with battery, and the scroll wheel. Written by make_designs.py."]
    lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(k) for k in face) for face in faces]
    return "\n".join(lines) + "\n"


def write(folder):
    (folder / INTERNALS).write_text(internals_obj(), encoding="utf-8")
    script = Script(14,
                    "A computer mouse around given internals, after figure 14 of the paper, and an alternative of it with a",
                    "thumb rest. Written by make_designs.py; run from the repository:",
                    "handloft-modeld run tests/data/scripts/computer_mouse.jsonl --input-dir tests/data/scripts \\",
                    "  --output-dir out")
    script.comment("", "The internals, in millimetres; everything else here is in metres.")
    script.do("importReference", id="internals", name="Internals", path=INTERNALS, scale=0.001)
    primary(script)
    features(script)
    script.comment("", "The design is finished; the outlines rounded, off to CAD.")
    show(script, ["top", "side", "heel", "nose"])
    script.do("export", path="computer_mouse.step")
    script.do("export", path="computer_mouse.obj")
    script.do("export", path="computer_mouse.glb")
    alternative(script)
    script.write(folder / "computer_mouse.jsonl")


def show(script, entities):
    for entity in entities:
        script.do("setRepresentation", entity=entity, representation="REPRESENTATION_SURFACE")
        script.query("surface", entity=entity)


def primary(script):
    script.comment("", "The top, its own mirror image, a quadratic.")
    script.create("top", "Top", 2, "SAME_SHAPE")
    script.lay("top", top, rows(6, 0.0015, 0.026, -0.050, 0.050), 0.003)
    script.fit("top", 2)
    shape = script.shapes["top"]
    tolerance = round(truth_tolerance(len(shape.points) // 2, 2), 4)
    for x, y in ((0.0, 0.0), (0.0, -0.04), (0.015, 0.02)):
        script.look("top", (x, y, 0.2), DOWN, top(x, y), tolerance)
    script.comment("The battery looks out of it: its upper edges, 19 mm beside the middle, are higher than the surface.")
    edge = (0.019, -0.022, 0.2)
    assert shape.surface.hit(edge, DOWN, 0.3)[2] < 0.0268
    script.expect("distance", {"entity": "top", "reference": "internals"}, "distance.surface.minM", atMost=-0.0002)

    script.comment("", "A palm ridge, drawn along the middle, lifts it over the battery.")
    ridge = polyline([(0.0, y, 0.0395 - 4.2 * (y + 0.008) ** 2) for y in (-0.05 + 0.005 * k for k in range(21))])
    places, points = noisy_curve(script.hand, ridge, 0.003)
    script.do("modifyProfile", curves=[{"entity": "top", "points": points}])
    second = polyline([(x, -0.012, 0.0395 - 7.0 * x**2) for x in (-0.024 + 0.004 * k for k in range(13))])
    shape.surface, shape.points = draw_profile(shape.points, shape.surface, [places], mirror=True)
    places, points = noisy_curve(script.hand, second, 0.003)
    script.comment("And a second stroke across it.")
    script.do("modifyProfile", curves=[{"entity": "top", "points": points}])
    shape.surface, shape.points = draw_profile(shape.points, shape.surface, [places], mirror=True)
    for x, y in ((0.0, 0.02), (0.0, -0.012), (0.018, -0.012)):
        script.look("top", (x, y, 0.2), DOWN, shape.surface.hit((x, y, 0.2), DOWN, 0.3), 0.0004)
    clear = min(shape.surface.hit((x, y, 0.2), DOWN, 0.3)[2] - z
                for x in (0.0, 0.019) for y, z in ((-0.036, 0.018), (-0.024, 0.027), (-0.002, 0.027), (0.008, 0.019)))
    assert clear > 0.002, clear

    script.comment("", "More points at the heel, which falls off there: the degree is left to them.")
    cap = [lambda t, x=x: (x, t) for x in (0.002, 0.008, 0.014, 0.020)]
    script.lay("top", heel_cap, cap, 0.0016)
    script.do("fit", entity="top", degree=4)
    shape.fit(4)
    for x, y in ((0.0, 0.02), (0.0, -0.012), (0.0, -0.046), (0.012, -0.050)):
        script.look("top", (x, y, 0.2), DOWN, shape.surface.hit((x, y, 0.2), DOWN, 0.3), 0.00005)
    script.expect("distance", {"entity": "top", "reference": "internals"}, "distance.surface.minM", atLeast=0.001)

    script.comment("", "Trimmed by an outline drawn above it. A corner that was seen before is not any more.")
    script.do("setSuperellipse", entity="top", exponent=8)
    corner = (0.0245, 0.0455, 0.2)
    script.look("top", corner, DOWN)
    angles = [2 * math.pi * k / 60 for k in range(59)]
    outline = polyline([(0.0285 * math.copysign(abs(math.cos(a)) ** (2 / 3.2), math.cos(a)),
                         -0.0005 + 0.0545 * math.copysign(abs(math.sin(a)) ** (2 / 3.2), math.sin(a)), 0.045)
                        for a in angles])
    curve, _ = noisy_curve(script.hand, outline, 0.003, tremor=0.4)
    script.do("setBoundary", entity="top", curve=[vec(p) for p in curve])
    script.expect("surface", {"entity": "top"}, "surface.trim", equals="boundary")
    script.look_past(corner, DOWN)
    script.look("top", (0.0, 0.0, 0.2), DOWN)


def features(script):
    script.comment("", "The sides: the right one by hand, the left one its partner.")
    script.create("side", "Side", 2, "PARTNER")
    script.lay("side", side, [lambda t, p=p: p(t)[::-1] for p in rows(5, 0.004, 0.0255, -0.044, 0.040)], 0.003)
    script.fit("side", 2)
    shape = script.shapes["side"]
    tolerance = round(truth_tolerance(len(shape.points), 2), 4)
    eye = (0.2, 0.012, 0.014)
    for y, z in ((0.012, 0.014), (-0.03, 0.010), (0.025, 0.017)):
        script.look("side", (0.2, y, z), FROM_RIGHT, side(y, z), tolerance)
        script.look("side-mirror", (-0.2, y, z), (1.0, 0.0, 0.0), mirrored_x(side(y, z)), tolerance)

    script.comment("", "Both are pushed in where thumb and ring finger hold: a fingertip of 12 mm goes 4 mm deep on the",
                   "right, what is near follows, the left is its image. They need degree 4 to show it.")
    place = shape.surface.hit(eye, FROM_RIGHT, 0.3)
    start, depth, radius, reach = (0.045, 0.012, 0.014), round(0.045 - place[0] + 0.004, 6), 0.012, 0.5
    end = (round(start[0] - depth, 6), start[1], start[2])
    script.expect("hash", {}, "hash.sha256", remember="before")
    script.do("pushPoints", entities=["side"], range=reach, falloff="FALLOFF_SMOOTH", refit=True, path=[
        {"centre": vec(start), "normal": vec(FROM_RIGHT), "radiusM": radius, "timeNs": "0"},
        {"centre": vec(end), "normal": vec(FROM_RIGHT), "radiusM": radius, "timeNs": "400000000"}])
    shape.points, touched = push(shape.points, start, FROM_RIGHT, depth, radius, reach)
    assert touched > 8, touched
    script.do("fit", entity="side", degree=4)
    shape.fit(4)
    hollow = shape.surface.hit(eye, FROM_RIGHT, 0.3)
    assert place[0] - hollow[0] > 0.002, (place, hollow)
    script.look("side", eye, FROM_RIGHT, hollow, 0.00005)
    script.look("side-mirror", mirrored_x(eye), (1.0, 0.0, 0.0), mirrored_x(hollow), 0.00005)
    script.comment("Undone, the sides are what they were; done again, they are hollow again.")
    script.do("undo")
    script.do("undo")
    script.expect("hash", {}, "hash.sha256", equalsRemembered="before")
    script.look("side", eye, FROM_RIGHT, place, 0.00005)
    script.do("redo")
    script.do("redo")
    script.look("side", eye, FROM_RIGHT, hollow, 0.00005)

    script.comment("", "Heel and nose close the shell.")
    for entity, name, meant, top_z in (("heel", "Heel", heel, 0.0155), ("nose", "Nose", nose, 0.0155)):
        script.create(entity, name, 2, "SAME_SHAPE")
        script.lay(entity, meant, rows(5, 0.001, 0.0235, 0.003, top_z), 0.0022)
        script.fit(entity, 2)
    for entity, exponent in (("heel", 4), ("nose", 4)):
        script.do("setSuperellipse", entity=entity, exponent=exponent)
    script.comment("The side ends where it meets the top, and so does its partner.")
    rim = [(y, script.shapes["top"].surface.hit((0.0265, y, 0.2), DOWN, 0.3)[2] - 0.0003)
           for y in (0.046 - 0.004 * k for k in range(24))]
    edge = [(-0.046, 0.003), (0.046, 0.003)] + rim
    outline = polyline([(side(y, z)[0] + 0.004, y, z) for y, z in edge])
    curve, _ = noisy_curve(script.hand, outline, 0.003, tremor=0.4)
    script.do("setBoundary", entity="side", curve=[vec(p) for p in curve])
    for entity in ("side", "side-mirror"):
        script.expect("surface", {"entity": entity}, "surface.trim", equals="boundary")
    for sign, entity in ((1, "side"), (-1, "side-mirror")):
        script.look(entity, (0.2 * sign, 0.0, 0.010), (-1.0 * sign, 0.0, 0.0))


def alternative(script):
    script.comment("", "Another design: the mirror is let go, the right side moved out by 2 mm, a rest for the thumb laid on",
                   "the left.")
    script.do("newAlternative", name="thumb rest")
    script.expect("alternatives", {}, "alternatives.names", equals=["main", "thumb rest"])
    script.expect("compare", {"alternative": "main"}, "compare.differences", count=0)
    script.do("setSymmetry", entity="side", mode="OFF")
    script.do("transform", entities=["side"], translation={"x": 0.002})
    script.create("thumb-rest", "Thumb rest", 2)
    script.lay("thumb-rest", thumb_rest, rows(5, 0.0, 1.0, -0.026, 0.040), 0.003)
    script.fit("thumb-rest", 2)
    script.do("setSuperellipse", entity="thumb-rest", exponent=3)
    show(script, ["thumb-rest"])
    moved = add(script.shapes["side"].surface.hit((0.2, 0.012, 0.014), FROM_RIGHT, 0.3), (0.002, 0, 0))
    still = mirrored_x(add(moved, (-0.002, 0, 0)))
    script.look("side", (0.2, 0.012, 0.014), FROM_RIGHT, moved, 0.00005)
    script.look("side-mirror", (-0.2, 0.012, 0.018), (1.0, 0.0, 0.0))
    script.look("thumb-rest", (-0.036, 0.008, 0.2), DOWN, thumb_rest((0.036 - 0.0255) / 0.0165, 0.008),
                round(truth_tolerance(len(script.shapes["thumb-rest"].points), 2), 4))
    script.comment("Three things differ from the main design: the right side by 2 mm, its former partner is free, and the",
                   "rest is new.")
    script.query("compare", alternative="main")
    script.expect("compare", {"alternative": "main"}, "compare.differences", count=3)
    for k, entity in enumerate(("side", "side-mirror", "thumb-rest")):
        script.expect("compare", {"alternative": "main"}, f"compare.differences.{k}.entity", equals=entity)
    script.expect("compare", {"alternative": "main"}, "compare.differences.0.maxPointDistanceM", near=0.002, tolerance=1e-6)
    script.expect("compare", {"alternative": "main"}, "compare.differences.1.maxPointDistanceM", equals=0)
    script.expect("compare", {"alternative": "main"}, "compare.differences.2.words", equals="added")
    script.do("export", path="computer_mouse_thumb_rest.step")
    script.do("export", path="computer_mouse_thumb_rest.obj")
    script.comment("The main design is what it was.")
    script.do("switchAlternative", name="main")
    script.expect("entities", {}, "entities.entities", count=6)
    script.look("side", (0.2, 0.012, 0.014), FROM_RIGHT, add(moved, (-0.002, 0, 0)), 0.00005)
    script.look_past((-0.036, 0.008, 0.2), DOWN)
