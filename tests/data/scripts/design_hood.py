"""A car's hood, 1.4 m wide and 1.1 m long, sculpted from a flat sheet: creases, a scoop, a nose, headlight bulges.

Across the car is x, the wind screen is at +y. Parameters are metres from the corner at -x, -y. All constraints are set
on the flat sheet before one of them is dragged, so that where each of them is to be is known.
"""

import math

from design_sculpt import SculptScript, turn

WIDTH, LENGTH, HEIGHT = 1.4, 1.1, 0.8


def flat(u, v, up=0.0):
    return (u - WIDTH / 2, v - LENGTH / 2, HEIGHT + up)


def bulges(script):
    script.comment("", "A load at a headlight follows the hand exactly (D16), as long as it is driven: passive or asleep",
                   "it does nothing (D13).")
    script.icon("hood", "light", (0.2, 0.15), role="ICON_LOAD", sensors=["hand", "spacemouse"])
    script.of_icon("hood", 0, "sensors", equals=["hand", "spacemouse"])
    script.at_rest("hood")
    script.drag("hood", "light", (0, 0, 0.04))
    script.at("hood", 0.2, 0.15, flat(0.2, 0.15, 0.04))
    script.change("hood", "light", state="ICON_PASSIVE")
    script.at_rest("hood")
    script.of_icon("hood", 0, "place.z", near=HEIGHT, tolerance=1e-12)
    script.refused("dragIcon", "failed_precondition", "drag_icon.icon", entity="hood", icon="light")
    script.change("hood", "light", state="ICON_DRIVING")
    script.at_rest("hood")
    script.comment("A stiffness of its own: half the force goes half the way.")
    script.change("hood", "light", stiffness=100)
    script.drag("hood", "light", (0, 0, 0.04))
    script.holds("evaluate", {"entity": "hood", "at": [{"x": 0.2, "y": 0.15}]}, "evaluate.positions.0.z",
                 remember="100 N/m, 4 cm")
    script.change("hood", "light", stiffness=200)
    script.drag("hood", "light", (0, 0, -0.02))
    script.holds("evaluate", {"entity": "hood", "at": [{"x": 0.2, "y": 0.15}]}, "evaluate.positions.0.z",
                 equalsRemembered="100 N/m, 4 cm")
    script.comment("Turned, it twists the surface about itself (D15): about +x the normal leans towards -y.")
    script.do("deleteIcon", entity="hood", icon="light")
    script.icon("hood", "twister", (0.7, 0.55), role="ICON_LOAD")
    script.drag("hood", "twister", rotation=turn("x", 6))
    script.holds("evaluate", {"entity": "hood", "at": [{"x": 0.7, "y": 0.55}]}, "evaluate.normals.0.y",
                 near=-math.sin(math.radians(6)), tolerance=0.002)
    script.change("hood", "twister", state="ICON_SLEEPING")
    script.at_rest("hood")


def constraints(script):
    script.comment("", "All that is held: two creases, a scoop, the nose's slope, the emblem's normal, a crown.")
    for name, u in (("crease-left", 0.30), ("crease-right", 1.10)):
        script.icon("hood", name, (u, 0.25), (u, 0.85), shape="ICON_CURVE")
    script.icon("hood", "scoop", (0.58, 0.64), (0.82, 0.84), shape="ICON_REGION")
    script.icon("hood", "nose", (0.7, 0.12), property="ICON_TANGENT_V")
    script.icon("hood", "emblem", (0.7, 0.28), property="ICON_NORMAL")
    script.icon("hood", "crown", (0.7, 0.45))
    script.of_icon("hood", 4, "label", equals="V")
    script.holds("sculpt", {"entity": "hood"}, "sculpt.icons", count=7)
    script.holds("sculpt", {"entity": "hood"}, "sculpt.maxDisplacementM", atMost=1e-12)

    for name in ("crease-left", "crease-right"):
        script.drag("hood", name, (0, 0, 0.02))
    script.drag("hood", "scoop", (0, 0, 0.05), rotation=turn("x", 5))
    script.drag("hood", "nose", rotation=turn("x", 12))
    script.drag("hood", "emblem", rotation=turn("x", 8))
    script.drag("hood", "crown", (0, 0, 0.03))
    script.comment("Each of them where it was dragged to, whatever the others did.")
    for u in (0.30, 1.10):
        for v in (0.25, 0.41, 0.66, 0.85):
            script.at("hood", u, v, flat(u, v, 0.02), 1e-6)
    a = math.radians(5)
    for u, v in ((0.58, 0.64), (0.7, 0.74), (0.82, 0.84), (0.61, 0.8)):
        x, y, _ = flat(u, v)
        away = v - 0.74
        script.at("hood", u, v, (x, y - away * (1 - math.cos(a)), HEIGHT + 0.05 + away * math.sin(a)), 1e-8)
    b = math.radians(12)
    script.of_icon("hood", 4, "direction", near={"x": 0, "y": math.cos(b), "z": math.sin(b)}, tolerance=1e-8)
    c = math.radians(8)
    script.normal("hood", 0.7, 0.28, (0, -math.sin(c), math.cos(c)), 1e-8)
    script.at("hood", 0.7, 0.45, flat(0.7, 0.45, 0.03), 1e-8)
    script.comment("The wind screen's side and the wings' are clamped: they have not moved at all.")
    for u, v in ((0, 0.5), (1.4, 0.3), (0.5, 1.1), (1.4, 1.1)):
        script.at("hood", u, v, flat(u, v), 1e-14)


def finish(script):
    script.comment("", "A copy that is recovered is the flat sheet again; the hood itself is committed and stays.")
    script.do("duplicate", entity="hood", id="spare", translation={"z": 1})
    script.do("recoverSculpting", entity="spare")
    script.at_rest("spare")
    script.height("spare", 0.7, 0.74, HEIGHT + 1, 1e-12)
    script.of_icon("spare", 3, "state", equals="ICON_SLEEPING")
    script.do("delete", entity="spare")
    script.control("hood", remember="sculpted")
    script.do("commitSculpting", entity="hood")
    script.control("hood", equalsRemembered="sculpted")
    script.at_rest("hood")
    script.comment("The right crease as a load, the left one bent by 1 cm in its middle, 15 cm to each side.")
    script.change("hood", "crease-right", role="ICON_LOAD", state="ICON_PASSIVE")
    script.drag("hood", "crease-left", (0, 0, 0.01), heldAt=0.5, reachM=0.15)
    script.comment("No control point goes much farther than the hand: the bend makes no waves.")
    script.holds("sculpt", {"entity": "hood"}, "sculpt.maxDisplacementM", near=0.0112, tolerance=0.0005)
    script.at("hood", 0.30, 0.55, flat(0.30, 0.55, 0.03), 2e-3)
    script.at("hood", 0.30, 0.25, flat(0.30, 0.25, 0.02), 2e-3)
    script.do("commitSculpting", entity="hood")
    for kind in ("step", "igs", "glb"):
        script.do("export", path=f"car_hood.{kind}")


def write(folder):
    script = SculptScript(
        7, "A car's hood, sculpted from a flat sheet by points, curves and regions that hold or pull it.",
        "Written by make_designs.py; run from the repository:",
        "handloft-modeld run tests/data/scripts/car_hood.jsonl --output-dir out")
    script.do("createSculptSurface", id="hood", name="Hood", controlU=37, controlV=29,
              rectangle={"pose": {"position": {"z": HEIGHT}, "orientation": {"w": 1}}, "widthM": WIDTH, "depthM": LENGTH})
    script.holds("sculpt", {"entity": "hood"}, "sculpt.controlU", equals=37)
    script.holds("sculpt", {"entity": "hood"}, "sculpt.upper", near={"x": WIDTH, "y": LENGTH}, tolerance=1e-12)
    script.do("setSculpting", entity="hood", vLower="EDGE_SUPPORTED")
    bulges(script)
    constraints(script)
    finish(script)
    script.write(folder / "car_hood.jsonl")
