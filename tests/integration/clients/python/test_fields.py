"""Python's values as fields of messages: what does not fit is told by its field, before anything is sent."""

import array
import copy
import io
import json
import os
import random
import subprocess
import unittest
from fractions import Fraction

from google.protobuf import json_format

import handloft
from handloft import messages, script
from support import MODELD, PATIENCE, SOURCES


def refusal(what, of=messages.operation_of):
    try:
        of(what)
    except handloft.Refused as refused:
        return refused
    return None


def scripts_lines():
    """Every operation and query of the scripts page and of the complete designs."""
    folder = os.path.join(SOURCES, "tests", "data", "scripts")
    paths = [os.path.join(folder, name) for name in sorted(os.listdir(folder)) if name.endswith(".jsonl")]
    for path in [os.path.join(SOURCES, "proto", "SCRIPT.md"), *paths]:
        with open(path, encoding="utf-8") as file:
            for line in file:
                if line.startswith("{\"") and len(line) < 20000 and '"line":' not in line:
                    yield json.loads(line)


class Fields(unittest.TestCase):
    def test_what_does_not_fit_is_told_by_its_field(self):
        point = {"position": {"x": 0}, "pressure": 1}
        for what, field, message in (
            ({"fit": {"entty": "top"}}, "fit.entty",
             'found the unknown field "entty", expected one of entity, degree, show, automatic_degree, chosen_degree'),
            ({"undo": {"steps": 2}}, "undo.steps", 'found the unknown field "steps", expected none'),
            ({"rename": {"entity": 3}}, "rename.entity", "found 3, expected text"),
            ({"rename": {"entity": "\ud800"}}, "rename.entity", 'found "\\ud800", expected text that is Unicode'),
            ({"fit": {"entity": "top", "degree": 2.5}}, "fit.degree", "found 2.5, expected a whole number from 0 to 4294967295"),
            ({"fit": {"degree": -1}}, "fit.degree", "found -1, expected a whole number from 0 to 4294967295"),
            ({"fit": {"degree": True}}, "fit.degree", "found true, expected a whole number from 0 to 4294967295"),
            ({"fit": {"degree": "two"}}, "fit.degree", 'found "two", expected a whole number from 0 to 4294967295'),
            ({"fit": {"automaticDegree": "yes"}}, "fit.automatic_degree", 'found "yes", expected true or false'),
            ({"fit": {"show": "surface"}}, "fit.show",
             'found "surface", expected one of REPRESENTATION_UNSPECIFIED, REPRESENTATION_POINTS, REPRESENTATION_SURFACE, '
             "REPRESENTATION_BOTH"),
            ({"set_superellipse": {"exponent": float("nan")}}, "set_superellipse.exponent", "found NaN, expected a number"),
            ({"set_superellipse": {"exponent": "NaN"}}, "set_superellipse.exponent", 'found "NaN", expected a number'),
            ({"set_superellipse": {"exponent": float("inf")}}, "set_superellipse.exponent", "found Infinity, expected a number"),
            ({"set_superellipse": {"exponent": 10**400}}, "set_superellipse.exponent",
             "found 1" + 59 * "0" + "..., expected a number"),
            ({"set_superellipse": {"exponent": [4]}}, "set_superellipse.exponent", "found a list, expected a number"),
            ({"addPoints": {"points": [point, point, {"position": {"x": 0, "w": 1}}]}}, "add_points.points[2].position.w",
             'found the unknown field "w", expected one of x, y, z'),
            ({"addPoints": {"points": [point, {"position": (0, 0, 1)}]}}, "add_points.points[1].position",
             "found a list, expected an object with x, y, z"),
            ({"addPoints": {"points": point}}, "add_points.points", "found an object, expected a list"),
            ({"addPoints": {"points": [None]}}, "add_points.points[0]",
             "found null, expected an object with position, pressure, time_ns"),
            ({"push_points": {"entities": ["a", 1]}}, "push_points.entities[1]", "found 1, expected text"),
            ({"import_reference": {"resolved": {"positions": [0, 1e39]}}}, "import_reference.resolved.positions[1]",
             "found 1e+39, expected a number"),
            ({"import_model": {"resolved": {"boundaryRepresentation": "a*"}}}, "import_model.resolved.boundary_representation",
             'found "a*", expected bytes in base64'),
            ({"move_points": {"region": {"sphere": {}, "box": {}}}}, "move_points.region.box",
             'found "box" beside "sphere", expected one of them'),
            ({"add_points": {"min_spacing_m": 1, "minSpacingM": 1}}, "add_points.min_spacing_m",
             'found "minSpacingM" beside "min_spacing_m", expected one of them'),
            ({"fit": {}, "rename": {}}, "rename", 'found "rename" beside "fit", expected one of them'),
            ({"fit": "top"}, "fit",
             'found "top", expected an object with entity, degree, show, automatic_degree, chosen_degree'),
            ("fit", "operation", 'found "fit", expected a dict or a message'),
        ):
            with self.subTest(what=what if field != "set_superellipse.exponent" else field):
                refused = refusal(what)
                self.assertIsNotNone(refused)
                self.assertEqual((refused.code, refused.field, refused.message), ("invalid_argument", field, message))

    def test_an_unknown_operation_or_query_is_told_which_there_are(self):
        refused = refusal({"fitt": {}})
        self.assertEqual(refused.field, "fitt")
        self.assertTrue(refused.message.startswith('found the unknown operation "fitt", expected one of create_dual_shape, '))
        self.assertNotIn("client_id", refused.message)
        refused = refusal({"surfaces": {}}, messages.query_of)
        self.assertTrue(refused.message.startswith('found the unknown query "surfaces", expected one of surface, evaluate, '))

    def test_arrays_and_other_numbers_are_taken(self):
        made = messages.operation_of({"modify_profile": {"curves": ({"split_at": array.array("d", [0.25, Fraction(1, 2)])},)}})
        self.assertEqual(list(made.modify_profile.curves[0].split_at), [0.25, 0.5])

    def test_arrays_and_numbers_of_numpy_are_taken(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed")
        made = messages.operation_of({"modify_profile": {"curves": [
            {"split_at": numpy.array([0.25, 0.5]), "points": [{"pressure": numpy.float32(0.5), "time_ns": numpy.int64(7)}]}
        ], "keep_as_points": numpy.bool_(True)}})
        curve = made.modify_profile.curves[0]
        self.assertEqual(list(curve.split_at), [0.25, 0.5])
        self.assertEqual((curve.points[0].pressure, curve.points[0].time_ns), (0.5, 7))
        self.assertTrue(made.modify_profile.keep_as_points)
        refused = refusal({"modify_profile": {"curves": [{"split_at": numpy.array([0.25, numpy.nan])}]}})
        self.assertEqual(refused.field, "modify_profile.curves[0].split_at[1]")

    def test_what_fits_is_what_protobuf_makes_of_it(self):
        seen = 0
        for said in scripts_lines():
            said = said.get("expect", said)
            said = said.get("fails", said)
            kind, of = (messages.Query, messages.query_of) if "query" in said else (messages.Operation, messages.operation_of)
            said = said.get("query", said)
            self.assertEqual(of(said), json_format.ParseDict(said, kind()), said)
            seen += 1
        self.assertGreater(seen, 150)

    def test_a_script_is_told_the_same_fields_by_the_server_and_by_this_client(self):
        lines = (
            b'{"fit": {"entty": "top"}}',
            b'{"fitt": {}}',
            b'{"rename": {"entity": 3}}',
            b'{"addPoints": {"points": [{}, {"position": {"x": "far"}}]}}',
            b'{"fit": {"degree": -1}}',
            b'{"fit": {"show": "SURFACE"}}',
            b'{"movePoints": {"region": {"box": {}, "sphere": {}}}}',
            b'{"query": {"surface": {"entty": "top"}}}',
            b'{"expect": {"query": {"evaluate": {"at": [{"z": 1}]}}, "count": 1}}',
        )

        class Nobody:
            submit = staticmethod(messages.operation_of)

        ours = io.StringIO()
        script.run(lines, ours, Nobody(), keep_going=True)
        theirs = subprocess.run([MODELD, "run", "-", "--keep-going"], input=b"\n".join(lines), stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, timeout=PATIENCE).stdout.decode()
        found = [[json.loads(line)["error"] for line in text.splitlines()] for text in (ours.getvalue(), theirs)]
        self.assertEqual(len(found[0]), len(lines))
        self.assertEqual(*[[(one["code"], one["field"]) for one in errors] for errors in found])

    def test_any_values_are_a_message_or_a_refusal_in_one_line(self):
        noise = random.Random(5)
        values = [None, True, -1, 3, 2.5, 1e300, float("nan"), "", "7", "top", "REPRESENTATION_BOTH", "YQ==", [], [1], ["a"], {},
                  {"x": 1}, {"no": 1}, (1, 2), b"x", object(), 10**5000, "\udcff"]
        lines = [said for said in scripts_lines() if not {"query", "expect"} & set(said)]
        refused = taken = 0

        def spoil(at):
            """Puts something else somewhere."""
            while isinstance(at, (dict, list)) and at:
                key = noise.choice(list(at)) if isinstance(at, dict) else noise.randrange(len(at))
                if noise.random() < 0.4:
                    at[key if noise.random() < 0.8 or isinstance(at, list) else "entty"] = noise.choice(values)
                    return
                at = at[key]

        for _ in range(4000):
            said = copy.deepcopy(noise.choice(lines))
            spoil(said)
            try:
                message = messages.operation_of(said)
            except handloft.Refused as problem:
                self.assertEqual(problem.code, "invalid_argument")
                self.assertTrue(problem.field)
                self.assertNotIn("\n", problem.message)
                refused += 1
            else:
                self.assertEqual(message, json_format.ParseDict(said, messages.Operation()), said)
                taken += 1
        self.assertGreater(refused, 500)
        self.assertGreater(taken, 500)


if __name__ == "__main__":
    unittest.main()
