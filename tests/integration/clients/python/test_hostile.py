"""A server that is none, or lies: an exception of ours within the time, and no memory taken on its word."""

import os
import random
import resource
import struct
import time
import unittest

import handloft
from handloft import mesh_codec, messages
from support import PATIENCE, FakeServer, ServerTest


class HostileServer(ServerTest):
    def against(self, behave):
        server = FakeServer(self.folder, behave)
        self.addCleanup(server.close)
        return server

    def refuses_to_begin(self, answer, error=handloft.ConnectionLost):
        def behave(peer, _):
            peer.receive()
            peer.send_bytes(answer)

        server = self.against(behave)
        with self.assertRaises(error):
            handloft.connect(server.endpoint, timeout=PATIENCE)
        server.close()
        os.remove(server.endpoint[len("unix:") :])

    def test_garbage_instead_of_a_welcome(self):
        noise = random.Random(7)
        for answer in (
            b"",
            b"HTTP/1.1 400 Bad Request\r\n\r\n",
            struct.pack("<I", 0xFFFFFFFF),
            struct.pack("<I", 4097) + bytes(4097),
            struct.pack("<I", 3) + b"\xff\xff\xff",
            struct.pack("<I", 0),
            noise.randbytes(5000),
        ):
            with self.subTest(answer=answer[:20]):
                self.refuses_to_begin(answer)

    def test_another_version_and_a_failure_are_told(self):
        other = messages.Envelope()
        other.welcome.protocol_major = 2
        payload = other.SerializeToString()
        self.refuses_to_begin(struct.pack("<I", len(payload)) + payload, handloft.ProtocolError)
        failure = messages.Envelope()
        failure.failure.code, failure.failure.message, failure.failure.closing = "permission_denied", "you may not", True
        payload = failure.SerializeToString()
        self.refuses_to_begin(struct.pack("<I", len(payload)) + payload, handloft.ServerClosed)

    def test_a_server_that_says_nothing_costs_the_timeout(self):
        server = self.against(lambda peer, _: peer.until_end())
        start = time.monotonic()
        with self.assertRaises(handloft.Timeout):
            handloft.connect(server.endpoint, timeout=0.3)
        self.assertLess(time.monotonic() - start, 5.0)

    def test_no_answer_costs_the_timeout_and_the_model_lives_on(self):
        def behave(peer, _):
            peer.welcome()
            peer.receive()  # and no word
            ask = peer.receive().ask
            answer = messages.Envelope()
            answer.answer.request = ask.request
            answer.answer.result.hash.sha256 = "ab"
            peer.send(answer)
            peer.until_end()

        server = self.against(behave)
        with handloft.connect(server.endpoint, timeout=PATIENCE) as model:
            with self.assertRaises(handloft.Timeout):
                model.submit({"undo": {}}, timeout=0.2)
            self.assertEqual(model.hash(), "ab")
        self.assertEqual(server.problems, [])

    def test_a_frame_that_promises_gigabytes_takes_none(self):
        def behave(peer, _):
            peer.welcome(max_frame_bytes=0xFFFFFFFF)
            peer.receive()
            peer.send_bytes(struct.pack("<I", 0xFFFFFFF0) + bytes(1000))
            peer.until_end()

        server = self.against(behave)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with handloft.connect(server.endpoint, timeout=PATIENCE, reconnect=False) as model:
            with self.assertRaises(handloft.ProtocolError):
                model.hash()
        self.assertLess(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, 64 << 10)  # KiB

    def test_lies_about_the_scene_end_the_watch(self):
        def cloud(entity):
            entity.points.total, entity.points.first = 5, 0
            entity.points.positions = bytes(12)

        def huge(entity):
            entity.points.total = 0xFFFFFFFF

        def tail_of_nothing(entity):
            entity.points.total, entity.points.first = 3, 2
            entity.points.positions, entity.points.styles = bytes(12), bytes(2)

        def style(entity):
            entity.points.total = 1
            entity.points.positions, entity.points.styles = bytes(12), b"\x07\x00"

        def unknown_triangles(entity):
            entity.surface_shown = True
            entity.surface.topology, entity.surface.index_count = 3, 300

        def curve(entity):
            entity.curves_shown = True
            entity.curves.add().points = b"12345"

        for lie in (cloud, huge, tail_of_nothing, style, unknown_triangles, curve):
            with self.subTest(lie=lie.__name__):

                def behave(peer, _, lie=lie):
                    peer.welcome()
                    peer.receive()
                    scene = messages.Envelope()
                    scene.snapshot.epoch = 1
                    lie(scene.snapshot.entities.add(id="a"))
                    peer.send(scene)
                    peer.until_end()

                server = self.against(behave)
                with handloft.connect(server.endpoint, timeout=PATIENCE, reconnect=False) as model:
                    with self.assertRaises(handloft.ProtocolError):
                        next(model.watch(timeout=PATIENCE))
                server.close()
                os.remove(server.endpoint[len("unix:") :])

    def test_random_frames_never_hang_or_crash_a_client(self):
        noise = random.Random(11)

        def behave(peer, _):
            peer.welcome()
            peer.receive()
            peer.send_bytes(noise.randbytes(noise.randrange(1, 400)))

        server = self.against(behave)
        for _ in range(60):
            with handloft.connect(server.endpoint, timeout=PATIENCE, reconnect=False) as model:
                with self.assertRaises((handloft.ConnectionLost, handloft.Refused)):
                    model.hash()
        self.assertEqual(server.problems, [])


class MeshCodec(unittest.TestCase):
    """Bytes from anybody."""

    def test_any_bytes_are_a_mesh_or_a_value_error(self):
        noise = random.Random(3)
        decoded = 0
        for _ in range(3000):
            size = noise.randrange(0, 120)
            data = bytearray(noise.randbytes(size))
            if data:
                data[0] = noise.choice((0xA0, 0xE0, 0xE1, data[0]))
            for decode in (
                lambda: mesh_codec.decode_vertices(bytes(data), noise.randrange(0, 40), 8),
                lambda: mesh_codec.decode_indices(bytes(data), 3 * noise.randrange(0, 12), 40),
            ):
                try:
                    decode()
                    decoded += 1
                except ValueError:
                    pass
        self.assertGreater(decoded, 0)
        with self.assertRaises(ValueError):
            mesh_codec.decode_vertices(b"\xa0" + bytes(40), 1 << 30, 8)
        with self.assertRaises(ValueError):
            mesh_codec.decode_indices(b"\xe1" + bytes(40), 3 << 30, 8)

    @unittest.skipUnless(mesh_codec.zstandard, "SKIPPED: Python's zstandard is not installed")
    def test_any_residuals_are_vertices_or_a_value_error(self):
        noise = random.Random(4)
        planes = bytes(noise.randrange(0, 3) for _ in range(10 * 12))
        good = mesh_codec.zstandard.ZstdCompressor().compress(planes)
        self.assertEqual([len(one) for one in mesh_codec.decode_residuals(good, 12, 4)], [12] * 5)
        decoded = 0
        for _ in range(2000):
            data = bytearray(good)
            for _ in range(noise.randrange(1, 4)):
                data[noise.randrange(0, len(data))] = noise.randrange(0, 256)
            try:
                mesh_codec.decode_residuals(bytes(data[: noise.randrange(1, len(data) + 9)]), 12, noise.randrange(0, 13))
                decoded += 1
            except ValueError:
                pass
        self.assertGreater(decoded, 0)
        for count, row in ((13, 4), (12, 13), (1 << 30, 0)):
            with self.assertRaises(ValueError):
                mesh_codec.decode_residuals(good, count, row)

    def test_octahedral_normals_by_hand(self):
        for coded, normal in (((0, 0), (0, 0, 1)), ((2047, 0), (1, 0, 0)), ((0, -2047), (0, -1, 0)), ((2047, 2047), (0, 0, -1))):
            for found, expected in zip(mesh_codec.octahedral(*coded), normal):
                self.assertAlmostEqual(found, expected, delta=1e-6)


if __name__ == "__main__":
    unittest.main()
