"""The car seat of the paper's figure 13: cushion, back and head rest under one profile stroke, with side rests.

The seat faces +y, its plane of symmetry is x = 0, the cushion's middle is a hand's breadth above the table's origin.
"""

from design_hand import Script, noisy_curve, polyline, truth_tolerance, vec
from design_math import draw_profile, mirrored_x, push


def cushion(x, y):
    return (x, y, 0.050 + 0.70 * x**2 + 0.08 * y - 0.55 * y**2)


def back(x, z):
    return (x, -0.255 - 0.22 * (z - 0.08) + 0.70 * x**2 - 0.35 * (z - 0.28) ** 2, z)


def head_rest(x, z):
    return (x, -0.440 + 1.20 * x**2 - 0.25 * (z - 0.80) - 1.0 * (z - 0.80) ** 2, z)


def apron(x, z):
    """Below the cushion's front edge."""
    return (x, 0.285 - 0.25 * x**2 - 0.30 * (z - 0.02), z)


def back_side(s, z):
    """From the back's edge outwards and forwards, s = 0..1: the wing that holds the shoulder."""
    edge = back(0.235, z)
    return (0.235 + 0.055 * s + 0.02 * s * (1 - s), edge[1] + 0.015 + 0.085 * s, z)


def cushion_side(s, y):
    edge = cushion(0.235, y)
    return (0.235 + 0.060 * s, y, edge[2] + 0.012 + 0.050 * s - 0.030 * s**2)


def rows(count, low, high, start, end):
    """Strokes along the second parameter at `count` values of the first, to and fro as a hand goes."""
    paths = []
    for k in range(count):
        u = low + (high - low) * k / (count - 1)
        a, b = (start, end) if k % 2 == 0 else (end, start)
        paths.append(lambda t, u=u, a=a, b=b: (u, a + (b - a) * t))
    return paths


TOWARDS_SEAT = (0.0, -1.0, 0.0)
DOWN = (0.0, 0.0, -1.0)


def write(folder):
    script = Script(13,
                    "A car seat, after figure 13 of the paper: three symmetric surfaces under one stroke, side rests in",
                    "pairs, pushed into shape. Written by make_designs.py; run from the repository:",
                    "handloft-modeld run tests/data/scripts/car_seat.jsonl --output-dir out")

    script.comment("", "Cushion, back and head rest: each its own mirror image, each a quadratic.")
    main = {"cushion": ("Cushion", cushion, rows(6, 0.012, 0.235, -0.22, 0.27)),
            "back": ("Back", back, rows(6, 0.012, 0.235, 0.06, 0.64)),
            "head-rest": ("Head rest", head_rest, rows(4, 0.010, 0.120, 0.70, 0.87))}
    for entity, (name, place, paths) in main.items():
        script.create(entity, name, 2, "SAME_SHAPE")
        script.lay(entity, place, paths, 0.014)
        script.fit(entity, 2)
    script.comment("Before the stroke, the surfaces are where the hand meant them to be.")
    looks = {"cushion": ((0.1, 0.05, 0.5), DOWN, cushion(0.1, 0.05)),
             "back": ((0.1, 0.5, 0.35), TOWARDS_SEAT, back(0.1, 0.35)),
             "head-rest": ((0.05, 0.5, 0.79), TOWARDS_SEAT, head_rest(0.05, 0.79))}
    for entity, (origin, direction, place) in looks.items():
        count = len(script.shapes[entity].points) // 2  # An image is no observation of its own.
        script.look(entity, origin, direction, place, round(truth_tolerance(count, 2), 4))

    profile(script, looks)
    side_rests(script)
    finish(script)
    script.write(folder / "car_seat.jsonl")


def profile(script, looks):
    script.comment("", "One stroke over all three, deeper in cushion and lumbar region, kept as points: it divides itself",
                   "where it passes from one surface to the next, and draws the profile of each.")
    corners = [cushion(0, y) for y in (0.27, 0.20)]
    corners += [(0, y, cushion(0, y)[2] - 0.022) for y in (0.12, 0.02, -0.08, -0.15)]
    corners += [cushion(0, -0.225)]
    bend = len(corners)
    corners += [back(0, 0.055)]
    corners += [(0, back(0, z)[1] - d, z) for z, d in ((0.16, 0.012), (0.26, 0.022), (0.36, 0.022), (0.48, 0.012))]
    corners += [back(0, 0.64)]
    top = len(corners)
    corners += [(0, head_rest(0, z)[1] + d, z) for z, d in ((0.70, 0.0), (0.76, 0.012), (0.81, 0.014), (0.87, 0.0))]
    places, points = noisy_curve(script.hand, polyline(corners), 0.012)
    script.do("modifyProfile", curves=[{"points": points}], keepAsPoints=True)

    def nearest(corner):
        return min(range(len(places)), key=lambda k: sum((a - b) ** 2 for a, b in zip(places[k], corner)))

    first = (nearest(corners[bend - 1]) + nearest(corners[bend])) // 2
    second = (nearest(corners[top - 1]) + nearest(corners[top])) // 2
    parts = {"cushion": places[:first + 1], "back": places[first:second + 1], "head-rest": places[second:]}
    script.comment("Each takes its part of the stroke (A19, reckoned anew by make_designs.py); a tenth more points (A20).")
    for entity, part in parts.items():
        shape = script.shapes[entity]
        count = len(shape.points)
        shape.surface, shape.points = draw_profile(shape.points, shape.surface, [part], mirror=True)
        kept = max(1, round(0.1 * count))
        script.expect("surface", {"entity": entity}, "surface.pointCount", atLeast=count + kept,
                      atMost=count + kept + 1)
        origin, direction, _ = looks[entity]
        for x in (0.0, origin[0]):
            eye = (x, origin[1], origin[2])
            # A few millimetres of the stroke's corner go to the one neighbour or the other.
            script.look(entity, eye, direction, shape.surface.hit(eye, direction, 1.5), 0.0015)
    script.query("surface", entity="cushion")


def side_rests(script):
    script.comment("", "Side rests, on the right with a partner on the left.")
    script.create("back-side", "Side of the back", 2, "PARTNER")
    script.lay("back-side", back_side, rows(5, 0.0, 1.0, 0.10, 0.56), 0.014)
    script.fit("back-side", 2)
    script.create("cushion-side", "Side of the cushion", 2, "PARTNER")
    script.lay("cushion-side", cushion_side, rows(4, 0.0, 1.0, -0.18, 0.25), 0.014)
    script.fit("cushion-side", 2)
    shape = script.shapes["back-side"]
    eye = (0.6, back_side(0.5, 0.30)[1], 0.30)
    inwards = (-1.0, 0.0, 0.0)
    place = shape.surface.hit(eye, inwards, 0.6)
    script.look("back-side", eye, inwards, place, 0.0002)
    script.look("back-side-mirror", mirrored_x(eye), (1.0, 0.0, 0.0), mirrored_x(place), 0.0002)

    script.comment("As points they are given more curvature: a fist of 70 mm pushes the wing inwards by some 30 mm, and",
                   "what is near follows. The partner mirrors it.")
    script.expect("hash", {}, "hash.sha256", remember="before")
    script.do("setRepresentation", entity="back-side", representation="REPRESENTATION_POINTS")
    centre, radius, reach = back_side(0.6, 0.33), 0.07, 0.6
    start = (round(centre[0] + 0.06, 6), round(centre[1], 6), 0.33)
    depth = 0.09
    end = (round(start[0] - depth, 6), start[1], start[2])
    script.do("pushPoints", entities=["back-side"], range=reach, falloff="FALLOFF_SMOOTH", refit=True, path=[
        {"centre": vec(start), "normal": vec(inwards), "radiusM": radius, "timeNs": "0"},
        {"centre": vec(end), "normal": vec(inwards), "radiusM": radius, "timeNs": "500000000"}])
    shape.points, touched = push(shape.points, start, inwards, depth, radius, reach)
    assert touched > 20, touched
    shape.fit(2)
    place_after = shape.surface.hit(eye, inwards, 0.6)
    assert place[0] - place_after[0] > 0.010, (place, place_after)
    script.do("setRepresentation", entity="back-side", representation="REPRESENTATION_BOTH")
    script.look("back-side", eye, inwards, place_after, 0.0002)
    script.look("back-side-mirror", mirrored_x(eye), (1.0, 0.0, 0.0), mirrored_x(place_after), 0.0002)
    script.comment("Undone, it is what it was; done again, it is pushed again.")
    for _ in range(3):
        script.do("undo")
    script.expect("hash", {}, "hash.sha256", equalsRemembered="before")
    script.look("back-side", eye, inwards, place, 0.0002)
    for _ in range(3):
        script.do("redo")
    script.look("back-side", eye, inwards, place_after, 0.0002)


def finish(script):
    script.comment("", "A surface below the front edge closes the cushion; rounded outlines; off to CAD.")
    script.create("apron", "Apron", 2, "SAME_SHAPE")
    script.lay("apron", apron, rows(5, 0.01, 0.225, -0.09, 0.015), 0.012)
    script.fit("apron", 2)
    exponents = {"cushion": 5, "back": 4, "head-rest": 3, "back-side": 5, "cushion-side": 6, "apron": 6}
    for entity, exponent in exponents.items():
        script.do("setSuperellipse", entity=entity, exponent=exponent)
    for entity in ("back-side-mirror", "cushion-side-mirror"):
        script.expect("surface", {"entity": entity}, "surface.superellipseExponent",
                      equals=exponents[entity.removesuffix("-mirror")])
    for entity in exponents:
        script.do("setRepresentation", entity=entity, representation="REPRESENTATION_SURFACE")
        script.query("surface", entity=entity)
    script.query("surface", entity="back-side-mirror")
    script.do("export", path="car_seat.step")
    script.do("export", path="car_seat.obj")
    script.do("export", path="car_seat.glb")
