"""The car side panel of the paper's figure 12: 1.2 m of body side with a shoulder line, a sill and a wheel arch.

The panel runs along x (front at -x), stands along z, and its outer side faces -y, towards the designer.
"""

import math

from design_hand import Script, noisy_curve, polyline, truth_tolerance, vec
from design_math import draw_profile

INWARDS = (0.0, 1.0, 0.0)
ARCH = (0.30, 0.02, 0.185)  # Centre x, z and radius of the wheel arch.


def outside(x, z):
    """Degree 4: barrel-shaped, fuller at the shoulder than below, drawn in towards the front."""
    u, v = x / 0.6, (z - 0.32) / 0.28
    bulge = 0.070 - 0.036 * u**2 - 0.040 * v**2 + 0.008 * v**3 - 0.012 * v**4 + 0.008 * u**3 + 0.007 * u**2 * v
    return (x, -bulge, z)


def shoulder(t):
    return (-0.56 + 1.12 * t, 0.475 - 0.02 * t)


def sill(t):
    return (-0.52 + 0.60 * t, 0.165 + 0.01 * t)


def outline():
    """Seen from the side, from the front's foot against the clock of that view; the arch is cut out of the foot."""
    x0, z0, r = ARCH
    places = [(-0.55, 0.08), (x0 - math.sqrt(r**2 - (0.08 - z0) ** 2), 0.08)]
    first = math.atan2(0.08 - z0, places[-1][0] - x0)
    for k in range(1, 40):
        a = first - (2 * first - math.pi) * k / 40
        places.append((x0 + r * math.cos(a), z0 + r * math.sin(a)))
    places += [(x0 + math.sqrt(r**2 - (0.08 - z0) ** 2), 0.08), (0.555, 0.085), (0.575, 0.20), (0.56, 0.40), (0.52, 0.53),
               (0.42, 0.565), (0.0, 0.575), (-0.40, 0.55), (-0.545, 0.50), (-0.58, 0.30)]
    return places


def area(polygon):
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(polygon, polygon[1:] + polygon[:1]))) / 2


def write(folder):
    script = Script(12,
                    "A car's side panel, after figure 12 of the paper: 1.2 m of it, with character lines and a wheel arch.",
                    "Written by make_designs.py; run from the repository:",
                    "handloft-modeld run tests/data/scripts/car_side_panel.jsonl --output-dir out")
    script.comment("", "Long strokes from front to rear and back, some upright ones across them.")
    script.create("panel", "Side panel", 2)
    paths = []
    for k in range(9):
        z = 0.07 + 0.50 * k / 8
        a, b = (-0.58, 0.58) if k % 2 == 0 else (0.58, -0.58)
        paths.append(lambda t, z=z, a=a, b=b: (a + (b - a) * t, z + 0.012 * math.sin(3 * t)))
    for k in range(6):
        x = -0.55 + 1.10 * k / 5
        a, b = (0.06, 0.57) if k % 2 == 0 else (0.57, 0.06)
        paths.append(lambda t, x=x, a=a, b=b: (x + 0.01 * math.sin(3 * t), a + (b - a) * t))
    script.lay("panel", outside, paths, 0.012)
    shape = script.shapes["panel"]

    script.comment("The degree is left to the points. What the hand had in mind is of degree 4: below it they contradict",
                   "the surface, above it there is nothing to gain but tremor.")
    script.do("fit", entity="panel", automaticDegree=True)
    shape.fit(4)
    script.expect("surface", {"entity": "panel"}, "surface.degree", equals=4)
    script.expect("surface", {"entity": "panel"}, "surface.crossValidatedRmsM", count=6)
    script.expect_residuals("panel")
    tolerance = round(truth_tolerance(len(shape.points), 4), 4)
    for x, z in ((-0.4, 0.2), (-0.2, 0.45), (0.0, 0.3), (0.2, 0.5), (0.4, 0.35)):
        script.look("panel", (x, -0.5, z), INWARDS, outside(x, z), tolerance)

    character_lines(script, shape)
    boundary(script, shape)
    script.write(folder / "car_side_panel.jsonl")


def character_lines(script, shape):
    script.comment("", "Character lines: a shoulder drawn out by 9 mm in three overlapping strokes, a sill pressed in by",
                   "8 mm in two. All at once; order and direction don't matter.")
    curves, drawn = [], []
    for line, out, spread in ((shoulder, 0.009, (-0.004, 0.0, 0.003)), (sill, -0.008, (0.002, -0.003))):
        for k, up in enumerate(spread):
            def path(t, line=line, out=out, up=up, k=k):
                x, z = line(t if k % 2 == 0 else 1 - t)
                place = outside(x, z + up)
                return (place[0], place[1] - out, place[2])
            places, points = noisy_curve(script.hand, path, 0.015)
            drawn.append(places)
            curves.append({"points": points})
    script.expect("hash", {}, "hash.sha256", remember="before")
    script.do("modifyProfile", curves=curves, entities=["panel"])
    before = shape.surface
    shape.surface, shape.points = draw_profile(shape.points, before, drawn)
    script.comment("The surface goes as far as its points and the strokes agree upon (A19, reckoned anew), the points with",
                   "it, keeping their residuals (A8).")
    for line, t in ((shoulder, 0.3), (shoulder, 0.5), (shoulder, 0.7), (sill, 0.4), (sill, 0.6)):
        x, z = line(t)
        eye = (x, -0.5, z)
        went = shape.surface.hit(eye, INWARDS, 1.0)[1] - before.hit(eye, INWARDS, 1.0)[1]
        assert (went < -0.003) if line is shoulder else (went > 0.002), (line, t, went)
        script.look("panel", eye, INWARDS, shape.surface.hit(eye, INWARDS, 1.0), 0.0005)
    rms = shape.surface.weighted_rms(shape.points)
    script.expect("surface", {"entity": "panel"}, "surface.residuals.weightedRmsM", near=rms, tolerance=2e-6)
    script.comment("Undone, it is what it was.")
    script.do("undo")
    script.expect("hash", {}, "hash.sha256", equalsRemembered="before")
    script.do("redo")


def boundary(script, shape):
    script.comment("", "The outline with the wheel arch is drawn around it, some centimetres in front of it and not quite",
                   "closed.")
    places = outline()
    corners = [(x, outside(x, z)[1] - 0.02, z) for x, z in places]
    whole = polyline(corners + corners[:1])
    curve, _ = noisy_curve(script.hand, lambda t: whole(0.985 * t), 0.010)
    x0, z0, r = ARCH
    hub = (x0, -0.5, z0 + 0.5 * r)
    script.look("panel", hub, INWARDS)
    script.do("export", path="car_side_panel_untrimmed.step", untrimmed=True)
    script.do("setBoundary", entity="panel", curve=[vec(p) for p in curve])
    script.expect("surface", {"entity": "panel"}, "surface.trim", equals="boundary")
    script.comment("Through the arch one looks past the panel; a hand's breadth above it, and at the door, one does not.")
    script.look_past(hub, INWARDS)
    script.look("panel", (x0, -0.5, z0 + r + 0.05), INWARDS)
    script.look("panel", (-0.2, -0.5, 0.3), INWARDS)
    script.look_past((0.0, -0.5, 0.62), INWARDS)
    script.do("setRepresentation", entity="panel", representation="REPRESENTATION_SURFACE")
    script.comment(f"Seen from the side the outline holds {area(places):.4f} square metres.")
    script.do("export", path="car_side_panel.step")
    script.do("export", path="car_side_panel.obj")
    script.do("export", path="car_side_panel.glb")
