"""A boat's deck: a hatch cover that bends as plates do, a deck from a mesh, a cabin roof that is part of a cylinder, and
a model that goes out as STEP, comes in again and is sculpted.

Plates: Timoshenko and Woinowsky-Krieger. A square plate, side a, stiffness D: simply supported under a force P in the
middle it sinks by 0.0116008 P a^2 / D, clamped under an even load q by 0.00126532 q a^4 / D.
"""

import math

from design_sculpt import SculptScript

PLATE = {"b11": 1, "b12": 1, "b22": 1}
ALL = ("uLower", "uUpper", "vLower", "vUpper")


def hatch(script):
    script.comment("", "The hatch cover, a square metre of pure plate. 100 N/m dragged by 1 cm are 1 N.")
    script.do("createSculptSurface", id="hatch", name="Hatch", rectangle={"widthM": 1, "depthM": 1}, controlU=24,
              controlV=24)
    script.do("setSculpting", entity="hatch", energy=PLATE, **{side: "EDGE_SUPPORTED" for side in ALL})
    script.icon("hatch", "knee", (0.5, 0.5), role="ICON_LOAD", stiffness=100)
    script.drag("hatch", "knee", (0, 0, -0.01))
    script.height("hatch", 0.5, 0.5, -0.0116008, 0.0116008 * 0.005)
    script.change("hatch", "knee", state="ICON_SLEEPING")
    script.do("setSculpting", entity="hatch", **{side: "EDGE_CLAMPED" for side in ALL})
    script.icon("hatch", "water", (0, 0), (1, 1), shape="ICON_REGION", role="ICON_LOAD", stiffness=1000)
    script.drag("hatch", "water", (0, 0, -0.01))
    script.height("hatch", 0.5, 0.5, -10 * 0.00126532, 10 * 0.00126532 * 0.005)
    script.comment("Sunk by the water for good; as fair as a plane lets it (absolute fairing, D4) it is flat again.")
    script.do("commitSculpting", entity="hatch")
    script.do("deleteIcon", entity="hatch", icon="water")
    script.do("setSculpting", entity="hatch", mode="ABSOLUTE")
    script.height("hatch", 0.5, 0.5, 0, 1e-9)
    script.do("setSculpting", entity="hatch", mode="DISPLACEMENT")
    script.height("hatch", 0.5, 0.5, -10 * 0.00126532, 10 * 0.00126532 * 0.005)
    script.do("delete", entity="hatch")


def deck(script):
    script.comment("", "The deck from a mesh: cambered, 3 m by 2 m.")

    def z(x, y):
        return 0.4 - 0.03 * y * y + 0.01 * x * x

    positions, indices, nx, ny = [], [], 24, 16
    for i in range(nx + 1):
        for j in range(ny + 1):
            x, y = 3 * i / nx - 1.5, 2 * j / ny - 1
            positions += [round(x, 6), round(y, 6), round(z(x, y), 6)]
    for i in range(nx):
        for j in range(ny):
            a, b = i * (ny + 1) + j, (i + 1) * (ny + 1) + j
            indices += [a, b, b + 1, a, b + 1, a + 1]
    script.do("importReference", id="scan", name="Scan", resolved={"positions": positions, "indices": indices})
    script.do("createSculptSurface", id="deck", name="Deck", mesh="scan", toleranceM=1e-4, controlU=24, controlV=18)
    for x, y in ((0, 0), (1.2, 0.5), (-0.7, -0.8)):
        ray = {"origin": {"x": x, "y": y, "z": 3}, "direction": {"z": -1}}
        script.holds("pick", ray, "pick.entity", equals="deck")
        script.holds("pick", ray, "pick.position.z", near=z(x, y), tolerance=2e-4)
    script.comment("Two icons want the same place elsewhere: refused by name, or met half way (D20).")
    for name in ("foot", "hand"):
        script.icon_near("deck", name, (0, 0, z(0, 0)))
    script.refused("dragIcon", "failed_precondition", "drag_icon", entity="deck", icon="hand", translation={"z": 0.1})
    script.do("setSculpting", entity="deck", leastSquares=True)
    script.of_icon("deck", 0, "place.z", remember="before")
    script.drag("deck", "hand", (0, 0, 0.1))
    script.of_icon("deck", 0, "place.z", near=z(0, 0) + 0.05, tolerance=2e-4)
    for name in ("foot", "hand"):
        script.do("deleteIcon", entity="deck", icon=name)
    script.do("setSculpting", entity="deck", leastSquares=False)
    script.comment("A curve as a load raises the rail: its middle follows the hand nearly.")
    script.icon_near("deck", "rail", (-1, 0.8, z(-1, 0.8)), (1, 0.8, z(1, 0.8)), shape="ICON_CURVE", role="ICON_LOAD",
                     sensors=["spacemouse"])
    script.drag("deck", "rail", (0, 0, 0.05))
    script.of_icon("deck", 0, "place.z", atLeast=z(0, 0.8) + 0.03, atMost=z(0, 0.8) + 0.08)
    script.do("commitSculpting", entity="deck")


def roof(script):
    script.comment("", "The cabin's roof: a quarter of a cylinder of radius 1.2 m, exactly, as a rational B-spline.")
    r, w = 1.2, math.sqrt(0.5)
    s = math.sqrt(0.5) * r  # The quarter from -45 to +45 degrees about the top.
    arc = ((-s, s), (0, math.sqrt(2) * r), (s, s))
    control, weights = [], []
    for x in (-0.9, 0.9):
        for k, (y, z) in enumerate(arc):
            control += [x, y, z]
            weights.append(1 if k != 1 else w)
    script.do("createSculptSurface", id="roof", name="Roof", controlU=9, controlV=14,
              surface={"degreeU": 1, "degreeV": 2, "knotsU": [0, 0, 1, 1], "knotsV": [0, 0, 0, 1, 1, 1],
                       "control": control, "weights": weights})

    def look(x, y, z, tolerance):
        script.holds("pick", {"origin": {"x": x, "y": y, "z": 9}, "direction": {"z": -1}}, "pick.position.z", near=z,
                     tolerance=tolerance)

    for x, y in ((0, 0), (0.4, 0.5), (-0.6, -0.7)):
        look(x, y, math.sqrt(r * r - y * y), 1e-9)
    script.comment("A window in it moves out as a body, 3 cm.")
    script.icon_near("roof", "window", (-0.2, -0.2, r), (0.2, 0.2, r), shape="ICON_REGION")
    script.drag("roof", "window", (0, 0, 0.03))
    for x, y in ((0, 0), (0.1, 0.1), (-0.15, 0.05)):
        look(x, y, math.sqrt(r * r - y * y) + 0.03, 1e-8)
    script.do("commitSculpting", entity="roof")


def out_and_in(script):
    script.comment("", "Deck and roof go out as STEP and come in again as a model; one of its faces is sculpted, and the",
                   "model is written with it.")
    script.do("export", path="boat_parts.step", entities=["deck", "roof"])
    script.do("importModel", id="boat", path="boat_parts.step", translation={"x": 10})
    script.holds("sculpt", {"entity": "boat.face-2"}, "sculpt.model", equals="boat")
    top = {"origin": {"x": 10, "y": 0, "z": 9}, "direction": {"z": -1}}
    script.holds("pick", top, "pick.entity", equals="boat.face-2")
    script.holds("pick", top, "pick.position.z", near=1.23, tolerance=1e-8)
    script.icon_near("boat.face-2", "hook", (10, 0, 1.23))
    script.drag("boat.face-2", "hook", (0, 0, 0.05))
    script.of_icon("boat.face-2", 0, "place", near={"x": 10, "y": 0, "z": 1.28}, tolerance=1e-8)
    for kind in ("step", "igs", "glb"):
        script.do("export", path=f"boat_deck.{kind}", entities=["boat"])
    script.comment("What was written comes in as it is.")
    script.do("importModel", id="again", path="boat_deck.step", translation={"x": 10})
    script.holds("pick", {"origin": {"x": 20, "y": 0, "z": 9}, "direction": {"z": -1}}, "pick.entity",
                 equals="again.face-2")
    script.holds("pick", {"origin": {"x": 20, "y": 0, "z": 9}, "direction": {"z": -1}}, "pick.position.z", near=1.28,
                 tolerance=1e-8)


def write(folder):
    script = SculptScript(
        9, "A boat's deck: plates that bend by the book, a deck from a mesh, a rational roof, a model out and in again.",
        "Written by make_designs.py; it reads what it writes. Run from the repository:",
        "handloft-modeld run tests/data/scripts/boat_deck.jsonl --input-dir out --output-dir out")
    hatch(script)
    deck(script)
    roof(script)
    out_and_in(script)
    script.write(folder / "boat_deck.jsonl")
