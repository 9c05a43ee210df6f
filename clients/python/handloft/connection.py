"""One connection: frames, the handshake, and a thread that reads (proto/PROTOCOL.md, "Framing", "Handshake")."""

import os
import select
import socket
import ssl
import struct
import threading
import time

from google.protobuf.message import DecodeError

from handloft import endpoint as endpoints
from handloft import mesh_codec, messages
from handloft.errors import ConnectionLost, ProtocolError, Refused, ServerClosed, Timeout

# Since 1.3 meshes come packed with Zstandard.
PROTOCOL_MAJOR, PROTOCOL_MINOR = 1, 2 if mesh_codec.zstandard is None else 3
HEAD = struct.Struct("<I")
MAX_BYTES_BEFORE_WELCOME = 4096
# Of one frame that we take, whatever the server says that it may send.
MAX_FRAME_BYTES = 64 << 20
CHUNK_BYTES = 1 << 16
AGAIN = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)


def encode(envelope):
    payload = envelope.SerializeToString()
    return HEAD.pack(len(payload)) + payload


class Decoder:
    """Frames out of a stream of bytes. What a length promises is not allocated before it has come."""

    def __init__(self, limit=MAX_BYTES_BEFORE_WELCOME):
        self.limit = limit
        self._bytes = bytearray()

    def feed(self, data):
        self._bytes += data

    def next(self):
        """An Envelope, or None until more bytes come. ProtocolError for a frame that is too large or is none."""
        if len(self._bytes) < HEAD.size:
            return None
        (size,) = HEAD.unpack_from(self._bytes)
        if size > self.limit:
            raise ProtocolError("found a frame of %d bytes, expected at most %d" % (size, self.limit))
        if len(self._bytes) < HEAD.size + size:
            return None
        payload = bytes(self._bytes[HEAD.size : HEAD.size + size])
        del self._bytes[: HEAD.size + size]
        try:
            return messages.Envelope.FromString(payload)
        except DecodeError as problem:
            raise ProtocolError("found bytes that are no message of the protocol: %s" % problem) from problem


class _Waiting:
    """Somebody who waits for the answer to a request."""

    def __init__(self):
        self.event = threading.Event()
        self.answer = None
        self.again = False  # the server has dropped what it had queued for us: ask once more


class Connection:
    """Thread-safe: several threads may exchange() at a time.

    on_message(envelope): every message that answers no request, from the reading thread; must not block and must not call
    this object's exchange(). on_lost(error): once, when the connection has ended by itself.
    """

    def __init__(self, endpoint, role, name, client_key, credentials, timeout, on_message, on_lost):
        self._on_message, self._on_lost = on_message, on_lost
        self._lock = threading.Lock()  # of the socket: one TLS object can't read and write at the same time
        self._send_lock = threading.Lock()  # a frame is sent whole
        self._state = threading.Lock()
        self._waiting = {}
        self._next_request = 1
        self._error = None
        self._join_answered = threading.Event()  # or the end has come
        self.admitted = False
        self._decoder = Decoder()
        self._wake_read, self._wake_write = os.pipe()
        deadline = time.monotonic() + timeout
        try:
            self._socket = endpoints.open_socket(endpoint, timeout, credentials)
        except BaseException:
            os.close(self._wake_read)
            os.close(self._wake_write)
            raise
        try:
            self._socket.setblocking(False)
            self.welcome = self._shake_hands(role, name, client_key, deadline)
        except BaseException:
            self._close_descriptors()
            raise
        self._decoder.limit = min(self.welcome.max_frame_bytes or MAX_FRAME_BYTES, MAX_FRAME_BYTES)
        self._thread = threading.Thread(target=self._read_all, name="handloft", daemon=True)
        self._thread.start()

    # --- asking

    def exchange(self, envelope, fill, timeout):
        """Sends with a new request number (fill(number) writes it) and waits for its answer.

        Timeout, ConnectionLost; (answer, again): `again` when the server may have dropped the answer.
        """
        waiting = _Waiting()
        with self._state:
            if self._error:
                raise self._error
            request = self._next_request
            self._next_request += 1
            self._waiting[request] = waiting
        deadline = time.monotonic() + timeout
        try:
            fill(request)
            self.send(envelope, timeout)
            if not waiting.event.wait(max(0.0, deadline - time.monotonic())):
                raise Timeout("the server has not answered within %g s" % timeout)
        finally:
            with self._state:
                self._waiting.pop(request, None)
        if waiting.answer is not None:
            return waiting.answer, False
        if waiting.again:
            return None, True
        raise self._error

    def wait_admitted(self, timeout):
        """After a Join was sent, until the server has taken us in. ServerClosed when it does not; Timeout, ConnectionLost."""
        if not self._join_answered.wait(timeout):
            raise Timeout("the server has not answered to the join within the time")
        if not self.admitted:
            raise self._error

    def send(self, envelope, timeout):
        frame = encode(envelope)
        if len(frame) - HEAD.size > self._decoder.limit and hasattr(self, "welcome"):
            raise Refused(
                "resource_exhausted",
                "",
                "found a message of %d bytes, the server takes at most %d" % (len(frame) - HEAD.size, self._decoder.limit),
            )
        deadline = time.monotonic() + timeout
        view = memoryview(frame)
        with self._send_lock:
            while view:
                with self._lock:
                    if self._error:
                        raise self._error
                    try:
                        view = view[self._socket.send(view) :]
                        continue
                    except AGAIN as wants:
                        events = select.POLLIN if isinstance(wants, ssl.SSLWantReadError) else select.POLLOUT
                    except OSError as problem:
                        raise self._reason_to_end(problem) from problem
                if not self._poll(events, deadline):
                    # Half a frame is on its way: nothing sensible can follow it.
                    error = Timeout("the server has read nothing for %g s" % timeout)
                    self._end(ConnectionLost(str(error)))
                    raise error

    def answers_may_be_gone(self):
        """Who waits shall ask again: the server begins anew with us."""
        with self._state:
            waiting = list(self._waiting.values())
        for one in waiting:
            if not one.event.is_set():
                one.again = True
                one.event.set()

    @property
    def closed(self):
        return self._error is not None

    def close(self):
        self._end(ConnectionLost("the connection is closed"), ours=True)
        if threading.current_thread() is not self._thread:
            self._thread.join()

    # --- inside

    def _poll(self, events, deadline, also_wake=False):
        poll = select.poll()
        poll.register(self._socket, events)
        if also_wake:
            poll.register(self._wake_read, select.POLLIN)
        left = None if deadline is None else max(0.0, (deadline - time.monotonic()) * 1000)
        return bool(poll.poll(left))

    def _receive(self):
        """Bytes, b"" at the end, or None and what to wait for."""
        with self._lock:
            try:
                return self._socket.recv(CHUNK_BYTES), 0
            except AGAIN as wants:
                return None, select.POLLOUT if isinstance(wants, ssl.SSLWantWriteError) else select.POLLIN

    def _shake_hands(self, role, name, client_key, deadline):
        envelope = messages.Envelope()
        hello = envelope.hello
        hello.protocol_major, hello.protocol_minor = PROTOCOL_MAJOR, PROTOCOL_MINOR
        hello.role, hello.name, hello.program = messages.ROLES[role], name, "handloft-python 0.1.0"
        hello.client_key = client_key
        hello.sent_ns = time.monotonic_ns()
        self.send(envelope, max(0.0, deadline - time.monotonic()))
        while True:
            answer = self._decoder.next()
            if answer is not None:
                break
            try:
                data, events = self._receive()
            except OSError as problem:
                raise ConnectionLost(str(problem)) from problem
            if data is None:
                if not self._poll(events, deadline):
                    raise Timeout("the server has not answered to the hello")
            elif not data:
                raise ConnectionLost("the server has ended the connection during the handshake")
            else:
                self._decoder.feed(data)
        if answer.HasField("failure"):
            raise ServerClosed(answer.failure.code, answer.failure.field, answer.failure.message)
        if not answer.HasField("welcome"):
            raise ProtocolError("found %s, expected welcome" % answer.WhichOneof("body"))
        if answer.welcome.protocol_major != PROTOCOL_MAJOR:
            raise ProtocolError("the server speaks version %d, expected %d" % (answer.welcome.protocol_major, PROTOCOL_MAJOR))
        return answer.welcome

    def _read_all(self):
        try:
            while not self._error:
                envelope = self._decoder.next()
                if envelope is not None:
                    self._handle(envelope)
                    continue
                data, events = self._receive()
                if data is None:
                    self._poll(events, None, also_wake=True)
                elif not data:
                    raise ConnectionLost("the server has ended the connection")
                else:
                    self._decoder.feed(data)
        except ConnectionLost as error:
            self._end(error)
        except OSError as problem:
            self._end(ConnectionLost(str(problem)))
        except Exception as problem:  # of on_message: nobody would ever hear of it, and all would wait
            self._end(ProtocolError("%s: %s" % (type(problem).__name__, problem)))
        finally:
            with self._lock:
                self._close_descriptors()

    def _handle(self, envelope):
        kind = envelope.WhichOneof("body")
        if kind in ("ack", "answer"):
            body = getattr(envelope, kind)
            with self._state:
                waiting = self._waiting.get(body.request)
            if waiting is not None:
                waiting.answer = body
                waiting.event.set()
        elif kind == "ping":
            pong = messages.Envelope()
            pong.pong.id, pong.pong.sent_ns = envelope.ping.id, envelope.ping.sent_ns
            pong.pong.received_ns = pong.pong.replied_ns = time.monotonic_ns()
            try:
                self.send(pong, 1.0)
            except Timeout:
                pass
        elif kind == "failure" and envelope.failure.closing:
            raise ServerClosed(envelope.failure.code, envelope.failure.field, envelope.failure.message)
        else:
            self._on_message(envelope)
            # A server before 1.2 knows no Joined: its answer is the scene.
            if kind in ("joined", "snapshot", "delta") and not self.admitted:
                self.admitted = True
                self._join_answered.set()

    def _reason_to_end(self, problem):
        """Of a failed send. The server may have said why, and the reading thread is about to find it."""
        if hasattr(self, "_thread") and threading.current_thread() is not self._thread:
            deadline = time.monotonic() + 1.0
            while not self._error and time.monotonic() < deadline:
                self._lock.release()
                time.sleep(0.005)
                self._lock.acquire()
        return self._error or ConnectionLost(str(problem))

    def _end(self, error, ours=False):
        with self._state:
            if self._error:
                return
            os.write(self._wake_write, b"x")  # before: who reads closes it when it sees the error
            self._error = error
            waiting = list(self._waiting.values())
        for one in waiting:
            one.event.set()
        self._join_answered.set()
        if not ours:
            self._on_lost(self, error)

    def _close_descriptors(self):
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._socket.close()
        os.close(self._wake_read)
        os.close(self._wake_write)
