#!/usr/bin/env python3
"""Writes the complete designs beside itself: computer_mouse.jsonl with mouse_internals.obj, car_seat.jsonl and
car_side_panel.jsonl, after figures 14, 13 and 12 of the paper; and the sculpted ones, car_hood.jsonl,
bicycle_saddle.jsonl and boat_deck.jsonl.

    make_designs.py                     writes them here
    make_designs.py --output-dir DIR    writes them there
    make_designs.py --check             compares them with what is here; exit status 1 when they differ

The points are laid by a simulated hand with a fixed seed, so that the files are the same each time. What the scripts
expect comes from what that hand had in mind, with tolerances from its tremor, and from design_math.py, which reckons
fits, profile strokes and pushes independently of the server. What sculpting is to do is known from its demands, from
symmetry and from the books on plates. Python 3 standard library only.
"""

import argparse
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True  # This folder holds what is committed, and no more.

import design_deck
import design_hood
import design_mouse
import design_panel
import design_saddle
import design_seat

HERE = pathlib.Path(__file__).resolve().parent


def write(folder):
    design_mouse.write(folder)
    design_seat.write(folder)
    design_panel.write(folder)
    design_hood.write(folder)
    design_saddle.write(folder)
    design_deck.write(folder)


def check():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write(folder)
        status = 0
        for fresh in sorted(folder.iterdir()):
            committed = HERE / fresh.name
            if not committed.exists() or committed.read_bytes() != fresh.read_bytes():
                print(f"{fresh.name} is not what make_designs.py writes; run it and look at the difference")
                status = 1
        return status


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output-dir", type=pathlib.Path, default=HERE)
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if arguments.check:
        sys.exit(check())
    write(arguments.output_dir)


if __name__ == "__main__":
    main()
