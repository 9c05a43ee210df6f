"""The Python client on a real server (U7)."""

import io
import json
import os
import re
import socket
import subprocess
import sys
import threading
import unittest
from unittest import mock

import handloft
from handloft import connection, mesh_codec, script
from support import MODELD, PATIENCE, SOURCES, FakeServer, Peer, ServerTest
from handloft import messages

BOWL = [(0.01 * i, 0.01 * j, 0.4 * (0.01 * i) ** 2 + 0.3 * (0.01 * j) ** 2) for i in range(-4, 5) for j in range(-4, 5)]


class ConnectedTest(ServerTest):
    def setUp(self):
        super().setUp()
        self.serve()

    def connect(self, **options):
        model = handloft.connect(self.endpoint, timeout=PATIENCE, **options)
        self.addCleanup(model.close)
        return model


class OnAServer(ConnectedTest):
    def test_a_shape_is_fitted_looked_at_and_exported(self):
        model = self.connect()
        bowl = model.dual_shape("bowl", name="Bowl", degree=2)
        self.assertEqual(bowl.add_points(BOWL, pressure=0.5).entities, ["bowl"])
        self.assertEqual(bowl.fit().sequence, 3)
        surface = bowl.surface()
        self.assertEqual(surface["degree"], 2)
        self.assertLess(surface["residuals"]["rms_m"], 1e-12)
        positions, pressures = bowl.points()
        self.assertEqual([tuple(one) for one in positions], BOWL)  # to the last bit
        self.assertEqual(set(pressures), {0.5})
        model.export("bowl.step")
        with open(os.path.join(self.folder, "bowl.step"), encoding="ascii") as file:
            self.assertTrue(file.readline().startswith("ISO-10303-21"))

    def test_who_asks_is_among_the_people(self):
        model = self.connect(name="Ann")
        self.assertEqual([one["name"] for one in model.people()], ["Ann"])
        other = self.connect(name="Bob", role="viewer")
        self.assertEqual([(one["name"], one["role"]) for one in other.people()], [("Ann", "editor"), ("Bob", "viewer")])

    def test_who_only_asks_is_not_among_the_people(self):
        ann, script = self.connect(name="Ann"), self.connect(name="A script")
        script.dual_shape("a")
        self.assertEqual(script.query("people")["people"], [])
        self.assertEqual([one["name"] for one in ann.people()], ["Ann"])
        self.assertEqual([one["people"] for one in script.models()], [1])
        script.join()
        self.assertEqual([one["name"] for one in ann.people()], ["Ann", "A script"])
        self.assertEqual([one["people"] for one in script.models()], [2])

    def test_a_user_without_a_name_is_called_by_number(self):
        with mock.patch("getpass.getuser", side_effect=KeyError("getpwuid(): uid not found: 4711")):
            model = self.connect()
        self.assertEqual([one["name"] for one in model.people()], ["uid-%d" % os.getuid()])

    def test_a_program_with_a_key_runs_again_and_all_of_it_is_done(self):
        # A number of an operation is applied once for each key: another start must not begin where the last one did.
        key = handloft.new_client_key()
        program = (
            "import sys, handloft\n"
            "with handloft.connect(sys.argv[1], client_key=bytes.fromhex(sys.argv[2])) as model:\n"
            "    done = [model.do('create_dual_shape').sequence for _ in range(3)]\n"
            "    print(model.client_id, *done)\n"
        )
        told = [
            subprocess.run([sys.executable, "-c", program, self.endpoint, key.hex()], stdout=subprocess.PIPE, check=True,
                           text=True, timeout=PATIENCE).stdout.split()
            for _ in range(2)
        ]
        self.assertEqual(told[0][0], told[1][0], "the same client")
        self.assertEqual(told[0][1:] + told[1][1:], ["1", "2", "3", "4", "5", "6"])
        self.assertEqual(len(self.connect().entities()), 6)
        # The control: the same number again is the same operation.
        model = self.connect(client_key=key)
        operation = messages.operation_of({"createDualShape": {}})
        operation.client_op_id = 7
        self.assertEqual(model.submit(operation).sequence, 7)
        self.assertEqual(model.submit(operation).sequence, 7)

    def test_numbers_may_be_arrays(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed")
        model = self.connect()
        shape = model.dual_shape()
        shape.add_points(numpy.array(BOWL), pressure=numpy.linspace(0.1, 1.0, len(BOWL)))
        positions, pressures = shape.points()
        self.assertEqual(positions.shape, (81, 3))
        self.assertEqual(pressures[-1], 1.0)

    def test_a_refusal_names_field_and_code_and_changes_nothing(self):
        model = self.connect()
        before = model.hash()
        for bad, code, field in (
            (lambda: model.do("fit", entity="nobody"), "not_found", "fit.entity"),
            (lambda: model.do("no_such_operation"), "invalid_argument", "no_such_operation"),
            (lambda: model.do("rename", entity=3), "invalid_argument", "rename.entity"),
            (lambda: model.query("surface", entty="top"), "invalid_argument", "surface.entty"),
            (lambda: model.add_points(3, [(0, 0, 0)]), "invalid_argument", "add_points.entity"),
            (lambda: model.add_points("x", [(0, 0, 0)], strke=1), "invalid_argument", "add_points.strke"),
            (lambda: model.add_points("x", [(0, 0, 0)], pressure="high"), "invalid_argument", "pressure"),
            (lambda: model.query("surface", entity="nobody"), "not_found", "surface.entity"),
            (lambda: model.add_points("x", [(0, 0)]), "invalid_argument", "points[0]"),
            (lambda: model.add_points("x", [(0, 0, 0)], pressure=[1, 1]), "invalid_argument", "pressure"),
            (lambda: model.undo(), "failed_precondition", None),
        ):
            with self.assertRaises(handloft.Refused) as caught:
                bad()
            self.assertEqual(caught.exception.code, code)
            if field is not None:
                self.assertEqual(caught.exception.field, field)
            self.assertTrue(caught.exception.message)
        nan = float("nan")
        model.dual_shape("x")
        with self.assertRaises(handloft.Refused) as caught:
            model.add_points("x", [(0, nan, 0)])
        self.assertEqual(caught.exception.field, "add_points.points[0].position.y")
        model.undo()
        self.assertEqual(model.hash(), before)

    def test_a_viewer_may_look_and_not_touch(self):
        viewer = self.connect(role="viewer")
        self.assertEqual(viewer.entities(), [])
        with self.assertRaises(handloft.Refused) as caught:
            viewer.dual_shape("x")
        self.assertEqual(caught.exception.code, "permission_denied")
        self.assertEqual(caught.exception.message, "viewer may not do create_dual_shape, expected editor")

    def compare_with_older_viewer(self, surface):
        """One that knows no residuals (or has no zstandard) is sent the same numbers otherwise."""
        with mock.patch.object(connection, "PROTOCOL_MINOR", 2):
            older = self.connect(role="viewer")
        theirs = next(older.watch(timeout=PATIENCE)).scene.entity("bowl").surface
        self.assertFalse(theirs._message.residuals)
        self.assertEqual(bool(surface._message.residuals), mesh_codec.zstandard is not None)
        for ours, other in ((surface.vertices, theirs.vertices), (surface.normals, theirs.normals)):
            self.assertEqual([tuple(one) for one in ours], [tuple(one) for one in other])
        self.assertEqual(surface.opacity, theirs.opacity)

    def test_watching_gives_the_whole_scene_and_then_what_changes(self):
        model, viewer = self.connect(), self.connect(role="viewer")
        bowl = model.dual_shape("bowl", degree=2)
        changes = viewer.watch(timeout=PATIENCE)
        first = next(changes)
        self.assertTrue(first.whole)
        self.assertEqual(list(first.scene.entities), ["bowl"])
        bowl.add_points(BOWL, pressure=0.5)
        bowl.fit()
        for change in changes:
            entity = change.scene.entity("bowl")
            if entity.surface is not None:
                break
        self.assertFalse(change.whole)
        self.assertEqual(len(entity.points), 81)
        for found, laid in zip(entity.points, BOWL):
            for a, b in zip(found, laid):
                self.assertAlmostEqual(a, b, delta=1e-4)
        # The mesh lies on the fitted surface, and its triangles look where the normals do.
        vertices, normals, triangles = entity.surface.vertices, entity.surface.normals, entity.surface.triangles
        self.assertGreater(len(triangles), 100)
        for x, y, z in vertices[:: max(1, len(vertices) // 50)]:
            self.assertAlmostEqual(z, 0.4 * x * x + 0.3 * y * y, delta=1e-4)
        for a, b, c in triangles:
            u = [vertices[b][i] - vertices[a][i] for i in range(3)]
            v = [vertices[c][i] - vertices[a][i] for i in range(3)]
            cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
            self.assertGreater(sum(cross[i] * normals[a][i] for i in range(3)), -1e-12)
        self.compare_with_older_viewer(entity.surface)
        bowl.delete()
        for change in changes:
            if "bowl" in change.removed:
                break
        self.assertEqual(change.scene.entities, {})
        viewer.close()
        self.assertEqual(list(changes), [])

    def test_several_threads_may_use_one_model(self):
        model = self.connect()
        made = []

        def work(number):
            for i in range(20):
                made.append(model.do("create_dual_shape", id="s-%d-%d" % (number, i)).sequence)

        threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(sorted(made), list(range(1, 81)))
        self.assertEqual(len(model.entities()), 80)

    def test_over_tcp(self):
        server = self.serve(endpoint="tcp:127.0.0.1:0")
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            self.assertEqual(model.entities(), [])

    def test_nobody_listens(self):
        with self.assertRaises(handloft.ConnectionLost):
            handloft.connect("unix:" + os.path.join(self.folder, "nobody.sock"), timeout=1.0)
        for bad in ("", "unix:", "tcp:host", "tcp:host:99999", "carrier:pigeon", "unix:" + 200 * "x"):
            with self.assertRaises(ValueError):
                handloft.Model(bad)


class Joining(ServerTest):
    """join() says whether the server has taken one in, and what has not come in goes on."""

    def connect(self, endpoint, **options):
        model = handloft.connect(endpoint, timeout=PATIENCE, **options)
        self.addCleanup(model.close)
        return model

    def fake(self, behave):
        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        return server

    @staticmethod
    def say(peer, kind, **fields):
        envelope = messages.Envelope()
        getattr(envelope, kind).SetInParent()
        for name, value in fields.items():
            setattr(getattr(envelope, kind), name, value)
        peer.send(envelope)

    def test_a_role_that_is_not_had_is_refused_by_join_itself(self):
        server = self.serve(endpoint="tcp:127.0.0.1:0")  # whose users are editors
        model = self.connect(server.endpoint, role="owner")
        for come in (model.join, model.people, lambda: next(model.watch()), lambda: model.lease("a").__enter__()):
            with self.assertRaises(handloft.Refused) as refused:
                come()
            self.assertIsInstance(refused.exception, handloft.NotAdmitted)
            self.assertIsInstance(refused.exception, handloft.ServerClosed)  # as it was before
            self.assertEqual((refused.exception.code, refused.exception.field), ("permission_denied", "hello.role"))
            self.assertEqual(refused.exception.message, '"tcp" is editor of "main" and cannot come as owner')
            self.assertEqual(model.role, "")
        # It has not come, and does what an editor does.
        model.dual_shape("a")
        self.assertEqual([one["id"] for one in model.entities()], ["a"])
        editor = self.connect(server.endpoint)
        editor.join()
        self.assertEqual(editor.role, "editor")
        self.assertEqual(len(editor.people()), 1)

    def test_a_model_that_is_not_there_and_another_version_are_refusals(self):
        self.serve()
        with self.assertRaises(handloft.Refused) as refused:
            handloft.connect(self.endpoint, model="elsewhere", timeout=PATIENCE)
        self.assertEqual(refused.exception.code, "not_found")
        self.assertIn("elsewhere", refused.exception.message)
        with self.assertRaises(handloft.Refused) as refused, mock.patch.object(connection, "PROTOCOL_MAJOR", 9):
            handloft.connect(self.endpoint, timeout=PATIENCE)
        self.assertEqual(refused.exception.code, "unsupported")

    def test_over_tls_a_paired_device_is_refused_what_its_user_is_not_and_all_when_revoked(self):
        people = os.path.join(self.folder, "people.sqlite")

        def command(*words):
            environment = dict(os.environ, XDG_CONFIG_HOME=self.folder)
            return subprocess.run([MODELD, *words], stdout=subprocess.PIPE, check=True, text=True, timeout=PATIENCE,
                                  env=environment).stdout

        server = self.serve("--access", people, endpoint="tls:127.0.0.1:0")
        invited = command("invite", "--access", people, "--name", "Ann", "--role", "editor")
        command("pair", re.search(r"\w{5}(-\w{5}){7}", invited).group(), "--connect", server.endpoint)
        servers = os.path.join(self.folder, "handloft", "servers")
        credentials = os.path.join(servers, os.listdir(servers)[0])
        model = self.connect(server.endpoint, credentials=credentials)
        changes = model.watch(timeout=PATIENCE)
        next(changes)
        self.assertEqual([(one["user"], one["role"]) for one in model.people()], [("Ann", "editor")])
        with self.assertRaises(handloft.NotAdmitted) as refused:
            self.connect(server.endpoint, credentials=credentials, role="owner").join()
        self.assertEqual(refused.exception.message, '"Ann" is editor of "main" and cannot come as owner')
        command("revoke", "--access", people, "Ann")
        with self.assertRaises(handloft.ServerClosed) as closed:
            for _ in changes:
                pass
        self.assertEqual(closed.exception.message, "your access to this server was revoked")
        with self.assertRaises(handloft.NotAdmitted) as refused:
            self.connect(server.endpoint, credentials=credentials)
        self.assertEqual((refused.exception.code, refused.exception.field), ("permission_denied", "user"))

    def test_an_end_without_words_is_no_refusal(self):
        def behave(peer, _):
            peer.welcome()
            peer.receive()

        server = self.fake(behave)
        model = self.connect(server.endpoint, reconnect=False)
        with self.assertRaises(handloft.ConnectionLost) as lost:
            model.join()
        self.assertNotIsInstance(lost.exception, handloft.Refused)

    def test_a_server_that_stops_is_no_refusal_and_is_joined_when_it_is_back(self):
        def behave(peer, number):
            peer.welcome()
            peer.receive()
            if number < 2:
                self.say(peer, "failure", code="cancelled", message="the server stops", closing=True)
            else:
                self.say(peer, "joined", role=messages.ROLES["editor"])
            peer.until_end()

        server = self.fake(behave)
        with self.assertRaises(handloft.ServerClosed) as closed:
            self.connect(server.endpoint, reconnect=False).join()
        self.assertNotIsInstance(closed.exception, handloft.Refused)
        model = self.connect(server.endpoint)
        model.join()
        self.assertEqual(model.role, "editor")
        self.assertEqual(server.problems, [])

    def test_no_answer_costs_the_timeout(self):
        server = self.fake(lambda peer, _: (peer.welcome(), peer.until_end()))
        with handloft.connect(server.endpoint, timeout=0.3) as model, self.assertRaises(handloft.Timeout):
            model.join()

    def test_a_server_of_an_earlier_version_answers_with_the_scene(self):
        def behave(peer, _):
            peer.welcome(minor=1)
            peer.receive()
            self.say(peer, "snapshot", epoch=1)
            peer.until_end()

        model = self.connect(self.fake(behave).endpoint)
        model.join()
        self.assertEqual(model.role, "")

    def test_who_was_refused_and_is_let_in_later_watches(self):
        def behave(peer, number):
            peer.welcome()
            peer.receive()
            if number == 0:
                self.say(peer, "failure", code="permission_denied", message="you may not", closing=True)
            else:
                self.say(peer, "joined", role=messages.ROLES["editor"])
                self.say(peer, "snapshot", epoch=1)
            peer.until_end()

        model = self.connect(self.fake(behave).endpoint)
        with self.assertRaises(handloft.NotAdmitted):
            model.join()
        self.assertTrue(next(model.watch(timeout=PATIENCE)).whole)

    def test_what_has_a_name_never_means_the_first_model(self):
        joins = []

        def behave(peer, number):
            peer.welcome()
            first = peer.receive()
            joins.append(first.WhichOneof("body"))
            if number == 0:
                self.say(peer, "joined", role=messages.ROLES["editor"])
                peer.receive()
                return  # the connection is lost, and by now the role as well
            self.say(peer, "failure", code="permission_denied", message="you may not", closing=True)
            peer.until_end()

        model = self.connect(self.fake(behave).endpoint, model="seat")
        for ask in (model.hash, model.hash, model.people, model.hash):
            with self.assertRaises(handloft.ServerClosed) as closed:
                ask()
            self.assertEqual(closed.exception.code, "permission_denied")
        self.assertEqual(set(joins), {"join"})

    def test_a_watch_whose_client_has_come_anew_elsewhere_ends(self):
        self.serve()
        key = handloft.new_client_key()
        before = self.connect(self.endpoint, client_key=key)
        changes = before.watch(timeout=PATIENCE)
        next(changes)
        after = self.connect(self.endpoint, client_key=key)
        after.join()
        with self.assertRaises(handloft.ServerClosed) as closed:
            for _ in changes:
                pass
        self.assertEqual(closed.exception.field, "hello.client_key")
        self.assertEqual(after.entities(), [])


class SameOperations(ServerTest):
    """From a file, from standard input, over the socket by either client: one model."""

    def test_file_standard_input_and_socket_give_equal_hashes(self):
        design = os.path.join(SOURCES, "tests", "data", "scripts", "bicycle_saddle.jsonl")
        ask = b'\n{"query": {"hash": {}}}\n'
        with open(design, "rb") as file:
            text = file.read() + ask
        path = os.path.join(self.folder, "design.jsonl")
        with open(path, "wb") as file:
            file.write(text)

        def hash_of(output):
            lines = [json.loads(line) for line in output.splitlines()]
            self.assertTrue(all(line["ok"] for line in lines), lines[-1])
            return lines[-1]["result"]["hash"]["sha256"]

        def run(words, given=None):
            done = subprocess.run(words, input=given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=4 * PATIENCE)
            self.assertEqual(done.returncode, 0, done.stderr)
            return hash_of(done.stdout)

        there = ["--input-dir", self.folder, "--output-dir", self.folder]
        hashes = {
            "file": run([MODELD, "run", path, *there]),
            "standard input": run([MODELD, "run", "-", *there], text),
        }
        python = [sys.executable, "-m", "handloft", "run"]
        for name, words, given in (
            ("socket", [MODELD, "run", path, *there], None),
            ("standard input to socket", [MODELD, "run", "-", *there], text),
            ("python, file", [*python, path], None),
            ("python, standard input", [*python, "-"], text),
        ):
            server = self.serve()
            hashes[name] = run([*words, "--connect", self.endpoint], given)
            self.end(server)
        self.assertEqual(len(set(hashes.values())), 1, hashes)

    def test_the_examples_of_the_scripts_page_hold(self):
        self.serve()
        with open(os.path.join(SOURCES, "proto", "SCRIPT.md"), encoding="utf-8") as page:
            blocks = page.read().split("```jsonl\n")[1:]
        lines = "\n".join(block.split("```")[0] for block in blocks).encode().splitlines(keepends=True)
        # What reads files is the server's and run's own affair.
        lines = [line for line in lines if b'"path": "' not in line or b'"expect"' in line]
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            out = io.StringIO()
            failed = script.run(lines[:60], out, model)
        self.assertEqual(failed, [], out.getvalue().splitlines()[-1])
        self.assertGreaterEqual(len(out.getvalue().splitlines()), 40)

    def test_a_script_of_several_clients_is_refused_where_undo_would_take_back_another_step(self):
        self.serve()
        lines = [b'{"createDualShape": {"id": "one"}, "clientId": "7"}\n', b'{"undo": {}, "clientId": "7"}\n',
                 b'{"redo": {}, "clientId": "7"}\n', b'{"createDualShape": {"id": "two"}, "clientId": "8"}\n',
                 b'{"undo": {}, "clientId": "7"}\n']
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            out = io.StringIO()
            failed = script.run(lines, out, model)
        self.assertEqual([line for line, _ in failed], [5])
        self.assertEqual(json.loads(out.getvalue().splitlines()[-1])["error"]["field"], "client_id")

    def test_the_sign_of_a_zero_reaches_the_model(self):
        self.serve()
        lines = [b'{"addPoints": {"entity": "a", "create": {}, "stroke": -0, "points": [{"position": {"x": -0, "y": -0.0}, "pressure": 1}]}}',
                 b'{"query": {"points": {"entity": "a"}}}']
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            out = io.StringIO()
            self.assertEqual(script.run(lines, out, model), [])
        self.assertIn('"position":{"x":-0.0,"y":-0.0,"z":0.0}', out.getvalue())

    def test_a_failing_line_ends_a_script_and_says_why(self):
        self.serve()
        text = b'# begins\n{"createDualShape": {"id": "a"}}\n{"fit": {"entity": "b"}}\n{"query": {"hash": {}}}\n'
        command = [sys.executable, "-m", "handloft", "run", "-", "--connect", self.endpoint]
        done = subprocess.run(command, input=text, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=PATIENCE)
        self.assertEqual(done.returncode, 1)
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual([(one["line"], one["ok"]) for one in answers], [(2, True), (3, False)])
        self.assertEqual(answers[1]["error"]["field"], "fit.entity")
        self.assertIn(b"line 3", done.stderr)
        going = subprocess.run([*command, "--keep-going"], input=b"{\n[]\n" + text, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, timeout=PATIENCE)
        self.assertEqual(going.returncode, 1)
        self.assertEqual([json.loads(line)["ok"] for line in going.stdout.splitlines()], [False] * 4 + [True])
        nobody = subprocess.run([*command[:-1], "unix:/nowhere"], input=b"", stderr=subprocess.PIPE, timeout=PATIENCE)
        self.assertEqual(nobody.returncode, 2)


class Together(ConnectedTest):
    """What people do with each other's work (U1, U6)."""

    def test_the_same_key_is_the_same_client_and_undoes_only_its_own(self):
        key = handloft.new_client_key()
        with handloft.connect(self.endpoint, client_key=key, timeout=PATIENCE) as ann:
            identity = ann.client_id
            ann.dual_shape("of-ann")
        bob = self.connect(name="Bob")
        bob.dual_shape("of-bob")
        ann = self.connect(client_key=key)
        self.assertEqual(ann.client_id, identity)
        self.assertNotEqual(bob.client_id, identity)
        ann.undo()
        self.assertEqual([one["id"] for one in bob.entities()], ["of-bob"])
        with self.assertRaises(handloft.Refused):
            ann.undo()

    def test_a_lease_keeps_others_from_what_is_shaped_and_ends(self):
        ann, bob = self.connect(name="Ann"), self.connect(name="Bob")
        ann.join()
        bob.join()
        ann.dual_shape("seat")
        with ann.lease("seat") as seat:
            seat.add_points([(0, 0, 0)])
            with self.assertRaises(handloft.Refused) as caught:
                with bob.lease("seat"):
                    pass
            self.assertTrue(caught.exception.message)
            with self.assertRaises(handloft.Refused) as caught:
                bob.shape("seat").move((0, 0, 0.01))
            self.assertEqual(caught.exception.code, "failed_precondition")
            self.assertIn("Ann", caught.exception.message)
            bob.shape("seat").rename("Bob's")  # which is no shaping
        bob.shape("seat").move((0, 0, 0.01))
        with bob.lease("seat") as seat:
            seat.add_points([(0, 0, 1)])

    def test_versions_say_what_was_done_and_come_back(self):
        model = self.connect()
        seat = model.dual_shape("seat", name="Seat")
        seat.add_points(BOWL)
        model.name_version("first", note="before the meeting")
        then = [tuple(one) for one in seat.points()[0]]
        seat.move((0.0, 0.0, 0.012))
        model.name_version("second")
        self.assertEqual([one["name"] for one in model.versions()], ["first", "second"])
        self.assertTrue(any("eat" in sentence for sentence in model.difference("first", "second")))
        model.restore_version("first")
        self.assertEqual([tuple(one) for one in seat.points()[0]], then)

    def test_comments_are_pinned_answered_and_resolved(self):
        model = self.connect(name="Ann")
        model.dual_shape("seat").add_points(BOWL)
        first = model.comment("Too high here", entity="seat", place=BOWL[0])
        model.comment("By 5 mm", reply_to=first)
        self.assertEqual([one["text"] for one in model.comments()], ["Too high here", "By 5 mm"])
        model.resolve_comment(first)
        self.assertNotIn(first, [one["id"] for one in model.comments()])
        self.assertIn(first, [one["id"] for one in model.comments(resolved=True)])

    def test_people_and_roles_are_told(self):
        ann, bob = self.connect(name="Ann"), self.connect(name="Bob", role="viewer")
        ann.join()
        next(bob.watch(timeout=PATIENCE))
        self.assertEqual(bob.role, "viewer")
        self.assertEqual(sorted(one["name"] for one in ann.people()), ["Ann", "Bob"])
        self.assertEqual([one["name"] for one in ann.models()], ["main"])


class Proxy:
    """Between a client and a server: cuts a connection when the server's answer to a submit comes."""

    def __init__(self, folder, server, cuts):
        self.cut = 0

        def behave(peer, number):
            onward = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            onward.settimeout(PATIENCE)
            onward.connect(server[len("unix:") :])
            there = Peer(onward)

            def forward():
                try:
                    while True:
                        there.send(peer.receive())
                except (OSError, EOFError):
                    pass

            thread = threading.Thread(target=forward, daemon=True)
            thread.start()
            with onward:
                while True:
                    envelope = there.receive()
                    if envelope.HasField("ack") and self.cut < cuts:
                        self.cut += 1
                        for end in (onward, peer.connection):  # which wakes who reads there
                            end.shutdown(socket.SHUT_RDWR)
                        thread.join(PATIENCE)
                        return
                    peer.send(envelope)

        self.server = FakeServer(folder, behave)


class Lost(ServerTest):
    """Connections end; operations happen once (H3)."""

    def test_what_was_not_answered_is_sent_again_as_the_same_operation(self):
        seen = []

        def behave(peer, number):
            key = peer.welcome().client_key
            submit = peer.receive().submit
            seen.append((key, submit.operation.client_op_id))
            if number < 2:
                return  # cut off before the answer
            answer = messages.Envelope()
            answer.ack.request, answer.ack.sequence = submit.request, 5
            peer.send(answer)
            peer.until_end()

        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            self.assertEqual(model.do("rename", entity="a", name="b").sequence, 5)
        self.assertEqual(server.problems, [])
        self.assertEqual(len(seen), 3)
        self.assertEqual(len(set(seen)), 1)
        key, operation = seen[0]
        self.assertTrue(16 <= len(key) <= 64 and operation > 0)

    def test_h3_operations_whose_answers_are_lost_apply_once(self):
        for options in ([], ["--store", os.path.join(self.folder, "seat.handloft")]):
            with self.subTest(options=options):
                server = self.serve(*options)
                proxy = Proxy(self.folder, self.endpoint, cuts=20)
                with handloft.connect(proxy.server.endpoint, timeout=PATIENCE) as model:
                    model.dual_shape("a")
                    for i in range(40):
                        model.add_points("a", [(0.001 * i, 0, 0)])
                    self.assertEqual(len(model.shape("a").points()[0]), 40)
                self.assertEqual(proxy.cut, 20)
                proxy.server.close()
                os.remove(proxy.server.endpoint[len("unix:") :])
                self.end(server)

    def test_a_server_that_does_not_know_clients_again_is_not_asked_twice(self):
        submits = []

        def behave(peer, _):
            peer.welcome(minor=1)
            submits.append(peer.receive())

        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            with self.assertRaises(handloft.ConnectionLost):
                model.do("rename", entity="a", name="b")
        self.assertEqual(len(submits), 1)

    def test_answers_that_the_server_has_dropped_are_asked_for_again(self):
        def behave(peer, _):
            peer.welcome()
            submits = []
            while len(submits) < 2:
                envelope = peer.receive()
                kind = envelope.WhichOneof("body")
                if kind == "join" or (kind == "submit" and not submits):
                    scene = messages.Envelope()
                    scene.snapshot.epoch = 1
                    peer.send(scene)
                if kind == "submit":
                    submits.append(envelope.submit)
            assert submits[0].operation == submits[1].operation
            answer = messages.Envelope()
            answer.ack.request, answer.ack.sequence = submits[1].request, 9
            peer.send(answer)
            peer.until_end()

        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            next(model.watch(timeout=PATIENCE))
            self.assertEqual(model.do("rename", entity="a", name="b").sequence, 9)
        self.assertEqual(server.problems, [])

    def test_what_comes_of_others_before_the_scene_is_told_with_it(self):
        def behave(peer, _):
            peer.welcome()
            self.assertEqual(peer.receive().WhichOneof("body"), "join")
            joined = messages.Envelope()
            joined.joined.epoch = 1
            peer.send(joined)
            first = messages.Envelope()
            first.people.people.add(client_id=8, name="Ann")
            peer.send(first)
            early = messages.Envelope()
            early.presence.client_id, early.presence.name = 8, "Ann"
            peer.send(early)
            submit = peer.receive().submit  # Until then nothing else: the watch has had time to be wrong.
            scene = messages.Envelope()
            scene.snapshot.epoch = 1
            peer.send(scene)
            answer = messages.Envelope()
            answer.ack.request, answer.ack.sequence = submit.request, 1
            peer.send(answer)
            peer.until_end()

        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        seen = []
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            watching = threading.Thread(target=lambda: seen.append(next(model.watch(timeout=PATIENCE))))
            model.join()
            watching.start()
            model.do("rename", entity="a", name="b")
            watching.join(PATIENCE)
        self.assertEqual(server.problems, [])
        self.assertEqual([change.whole for change in seen], [True])
        self.assertEqual([one["name"] for one in seen[0].presences], ["Ann"])
        self.assertEqual([one["name"] for one in seen[0].scene.people], ["Ann"])

    def test_a_watch_goes_on_with_a_server_that_has_come_again(self):
        store = os.path.join(self.folder, "seat.handloft")
        server = self.serve("--store", store)
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            model.dual_shape("before")
            changes = model.watch(timeout=PATIENCE)
            self.assertIn("before", next(changes).scene.entities)
            server.kill()
            server.wait()
            self.serve("--store", store)
            model.dual_shape("after")
            for change in changes:
                if set(change.scene.entities) == {"before", "after"}:
                    break
            self.assertEqual(set(change.scene.entities), {"before", "after"})

    def test_without_reconnect_the_end_is_told(self):
        server = self.serve()
        with handloft.connect(self.endpoint, timeout=PATIENCE, reconnect=False) as model:
            server.kill()
            server.wait()
            with self.assertRaises(handloft.ConnectionLost):
                model.hash()


if __name__ == "__main__":
    unittest.main()
