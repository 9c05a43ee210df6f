"""Servers under test: the real one as a process, and one that misbehaves as it is told."""

import json
import os
import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import unittest

from handloft import messages

MODELD = os.environ["HANDLOFT_MODELD"]
SOURCES = os.environ["HANDLOFT_SOURCES"]
PROGRAMS = os.environ["HANDLOFT_PROGRAMS"].split(":")  # All that were built.
PATIENCE = 30.0


class ServerTest(unittest.TestCase):
    """A folder of its own, and servers on sockets in it that end with the test."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="handloft-python-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.endpoint = "unix:" + os.path.join(self.folder, "model.sock")

    def serve(self, *options, endpoint=None):
        words = [MODELD, "serve", "--listen", endpoint or self.endpoint, "--write-folder", self.folder]
        words += ["--read-folder", self.folder, "--log-level", "warning", *options]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        line = process.stdout.readline()
        self.assertTrue(line, process.stderr.read() if not line else "")
        process.endpoint = json.loads(line)["endpoints"][0]
        return process

    @staticmethod
    def end(process):
        if process.poll() is None:
            process.terminate()
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
            process.stdout.close()
            process.stderr.close()


class FakeServer:
    """Accepts one connection after another and gives each to `behave(connection, number)`, in a thread of its own."""

    def __init__(self, folder, behave):
        self.endpoint = "unix:" + os.path.join(folder, "fake.sock")
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(self.endpoint[len("unix:") :])
        self._listener.listen(8)
        self._behave = behave
        self._threads = []
        self.problems = []
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def _accept(self):
        number = 0
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            thread = threading.Thread(target=self._serve, args=(connection, number), daemon=True)
            thread.start()
            self._threads.append(thread)
            number += 1

    def _serve(self, connection, number):
        connection.settimeout(PATIENCE)
        with connection:
            try:
                self._behave(Peer(connection), number)
            except (OSError, EOFError):
                pass  # the client has gone, as it may
            except Exception as problem:
                self.problems.append(problem)

    def close(self):
        try:
            self._listener.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._listener.close()
        self._accepting.join(PATIENCE)


class Peer:
    """The server's end of a connection."""

    def __init__(self, connection):
        self.connection = connection

    def _exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.connection.recv(count - len(data))
            if not more:
                raise EOFError
            data += more
        return data

    def receive(self):
        (size,) = struct.unpack("<I", self._exactly(4))
        return messages.Envelope.FromString(self._exactly(size))

    def send_bytes(self, data):
        self.connection.sendall(data)

    def send(self, envelope):
        payload = envelope.SerializeToString()
        self.send_bytes(struct.pack("<I", len(payload)) + payload)

    def welcome(self, minor=2, max_frame_bytes=1 << 20):
        """Takes the hello and answers. The hello."""
        hello = self.receive().hello
        envelope = messages.Envelope()
        envelope.welcome.protocol_major, envelope.welcome.protocol_minor = 1, minor
        envelope.welcome.client_id, envelope.welcome.max_frame_bytes = 7, max_frame_bytes
        envelope.welcome.program = "fake 1"
        self.send(envelope)
        return hello

    def until_end(self):
        while self.connection.recv(1 << 16):
            pass
