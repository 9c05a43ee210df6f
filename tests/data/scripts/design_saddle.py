"""A bicycle saddle, 15 cm wide and 26 cm long: from points that were fitted, then sculpted.

The nose is at +y. The points lie on a surface of degree 2, so that the fit is that surface.
"""

import math

from design_sculpt import SculptScript, turn

HALF_WIDTH, HALF_LENGTH = 0.075, 0.13


def height(x, y):
    return 0.95 - 3.0 * x * x + 0.8 * y * y


def place(x, y):
    return (x, y, height(x, y))


def look(script, entity, x, y, z, tolerance):
    script.holds("pick", {"origin": {"x": x, "y": y, "z": 2}, "direction": {"z": -1}}, "pick.entity", equals=entity)
    script.holds("pick", {"origin": {"x": x, "y": y, "z": 2}, "direction": {"z": -1}}, "pick.position.z", near=z,
                 tolerance=tolerance)


def make(script):
    points = []
    for i in range(-6, 7):
        for j in range(-8, 9):
            p = place(HALF_WIDTH * i / 6, HALF_LENGTH * j / 8)
            points.append({"position": {"x": p[0], "y": p[1], "z": p[2]}, "pressure": 0.8})
    script.do("createDualShape", id="cloud", name="Cloud", degree=2)
    script.do("addPoints", entity="cloud", points=points)
    script.do("fit", entity="cloud", degree=2)
    script.do("setRepresentation", entity="cloud", representation="REPRESENTATION_POINTS")
    script.comment("The fitted surface, exactly; and the points approximated, within 0.05 mm.")
    script.do("createSculptSurface", id="saddle", name="Saddle", fitted="cloud", controlU=18, controlV=14)
    for x, y in ((0, 0), (0.03, 0.09), (-0.05, -0.1)):
        look(script, "saddle", x, y, height(x, y), 1e-9)
    script.do("createSculptSurface", id="near", points="cloud", toleranceM=5e-5)
    script.do("transform", entities=["near"], translation={"z": 0.5})
    for x, y in ((0, 0), (0.03, 0.09), (-0.05, -0.1)):
        look(script, "near", x, y, height(x, y) + 0.5, 6e-5)
    script.do("delete", entity="near")


def derivatives(script):
    script.comment("", "Second derivatives and the twist in the middle: their arrows (5 cm for the unit) point where",
                   "they are dragged to. The crown is bent up across, the twist raises two corners.")
    for index, (name, kind, label) in enumerate((("across", "ICON_SECOND_U", "R2"), ("along", "ICON_SECOND_V", "V2"),
                                                 ("twist", "ICON_TWIST", "RV"))):
        script.icon_near("saddle", name, place(0, 0), property=kind)
        script.of_icon("saddle", index, "label", equals=label)
        script.of_icon("saddle", index, "place", near={"x": 0, "y": 0, "z": height(0, 0)}, tolerance=1e-9)
    script.drag("saddle", "across", (0, 0, 0.05))
    script.drag("saddle", "along", (0, 0, 0.03))
    script.drag("saddle", "twist", (0, 0, 0.004))
    for index in range(3):
        script.of_icon("saddle", index, "direction", near={"x": 0, "y": 0, "z": 1}, tolerance=1e-6)
    script.comment("One icon for all of a point: position, then tangents, each from the surface as it is (D18).")
    for name in ("across", "along", "twist"):
        script.change("saddle", name, state="ICON_SLEEPING")
    script.at_rest("saddle")
    for name in ("across", "along"):
        script.do("deleteIcon", entity="saddle", icon=name)
    for kind in ("ICON_POSITION", "ICON_TANGENT_U", "ICON_TANGENT_V", "ICON_NORMAL", "ICON_POSITION"):
        script.change("saddle", "twist", property=kind, state="ICON_DRIVING")
        script.of_icon("saddle", 0, "property", equals=kind)
        script.holds("sculpt", {"entity": "saddle"}, "sculpt.maxDisplacementM", atMost=1e-11)
    script.do("deleteIcon", entity="saddle", icon="twist")


def groove(script):
    script.comment("", "A groove within a frame: the rim is held to the bit (the outside of a region, D11), a curve in the",
                   "middle goes down by 12 mm, a point of the rear up by 8 mm.")
    script.icon_near("saddle", "frame", place(-0.06, -0.11), place(0.06, 0.11), shape="ICON_REGION", outside=True,
                     state="ICON_PASSIVE")
    script.icon_near("saddle", "groove", place(0, -0.05), place(0, 0.05), shape="ICON_CURVE", sensors=["pen"])
    script.drag("saddle", "groove", (0, 0, -0.012))
    for y in (-0.05, 0, 0.05):
        look(script, "saddle", 0, y, height(0, y) - 0.012, 1e-5)
    for x, y in ((0.07, 0), (-0.07, 0.1), (0.0, 0.125), (0.03, -0.12)):
        look(script, "saddle", x, y, height(x, y), 1e-9)
    script.control("saddle", remember="grooved")
    script.do("commitSculpting", entity="saddle")
    script.do("deleteIcon", entity="saddle", icon="groove")
    script.control("saddle", equalsRemembered="grooved")


def refine(script):
    script.comment("", "More control points, the same shape; then a dent as small as they allow, and back.")
    script.do("refineSurface", entity="saddle", controlU=31, controlV=25)
    script.holds("sculpt", {"entity": "saddle"}, "sculpt.controlV", equals=25)
    look(script, "saddle", 0, 0, height(0, 0) - 0.012, 1e-5)
    script.control("saddle", remember="refined")
    script.icon_near("saddle", "dent", place(0.02, 0.0), role="ICON_LOAD", stiffness=500)
    script.drag("saddle", "dent", (0, 0, -0.003), rotation=turn("y", 4))
    script.do("undo")
    script.control("saddle", equalsRemembered="refined")
    script.do("redo")
    script.do("commitSculpting", entity="saddle")
    for kind in ("step", "iges", "glb"):
        script.do("export", path=f"bicycle_saddle.{kind}", entities=["saddle"])
    script.comment("Recovered it is as it was made, with the control points that it had then.")
    script.do("recoverSculpting", entity="saddle")
    script.holds("sculpt", {"entity": "saddle"}, "sculpt.controlU", equals=18)
    for x, y in ((0, 0), (0.03, 0.09), (-0.05, -0.1)):
        look(script, "saddle", x, y, height(x, y), 1e-9)
    script.do("undo")
    script.holds("sculpt", {"entity": "saddle"}, "sculpt.controlU", equals=31)


def write(folder):
    script = SculptScript(
        8, "A bicycle saddle: a fitted surface that is sculpted by derivatives, a groove within a held rim, loads.",
        "Written by make_designs.py; run from the repository:",
        "handloft-modeld run tests/data/scripts/bicycle_saddle.jsonl --output-dir out")
    make(script)
    derivatives(script)
    groove(script)
    refine(script)
    script.write(folder / "bicycle_saddle.jsonl")
