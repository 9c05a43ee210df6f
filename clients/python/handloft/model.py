"""A model behind a server: what a program does with it (proto/PROTOCOL.md, "A model")."""

import contextlib
import getpass
import itertools
import os
import secrets
import threading
import time

from handloft import fields, messages
from handloft.connection import Connection
from handloft.endpoint import default_endpoint
from handloft.errors import ConnectionLost, HandloftError, NotAdmitted, ProtocolError, Refused, ServerClosed, Timeout
from handloft.scene import Change, Scene
from handloft.shapes import DualShape, add_point_messages

RECONNECT_FIRST_S, RECONNECT_MOST_S = 0.05, 1.0
LEASE_RENEWED_EVERY_S = 2.0  # the server forgets one after five seconds
# Since this minor version a client has an identity of its own, so that what was lost can be sent again.
MINOR_WITH_CLIENT_KEYS = 2


def new_client_key():
    """Random bytes by which a server knows this client again. Whoever has them can undo in its name: keep them to yourself."""
    return secrets.token_bytes(32)


def _users_name():
    """What this user is called; in a container the user may have a number and no name, which is no reason not to work."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # Python says the one before 3.13 and the other since
        return "uid-%d" % os.getuid()


def connect(endpoint=None, **options):
    """A Model: see there for the options. Without an endpoint this user's own server."""
    return Model(endpoint or default_endpoint(), **options)


def _worth_another_try(lost):
    """Whether the server might take us again: one that stops comes back, who was asleep too long may go on, who is no
    longer known may not."""
    if not isinstance(lost, ServerClosed):
        return not isinstance(lost, ProtocolError)
    if lost.field == "hello.client_key":
        return False  # the same client has connected anew; the two would close each other for ever
    return lost.code in ("unavailable", "resource_exhausted", "cancelled", "timeout")


def _refusal(closed):
    """What connect() and join() raise when the server has ended the connection: whether that was about us."""
    about_us = closed.code not in ("cancelled", "timeout")  # else it stops, or has not heard of us in time
    return NotAdmitted(closed.code, closed.field, closed.message) if about_us else closed


class Outcome:
    """What an operation did. sequence: its place in the order of all, 0 when nothing changed."""

    def __init__(self, ack):
        self.sequence = ack.sequence
        self.entities, self.notes = list(ack.entities), list(ack.notes)
        self.level = messages.name_of(messages.LEVELS, ack.level)

    def __repr__(self):
        return "<Outcome sequence=%d entities=%s>" % (self.sequence, self.entities)


class Model:
    """Blocks until what it asks is answered. Thread-safe, but for watch(), which one thread at a time may use.

    endpoint      "unix:PATH", "tcp:HOST:PORT" or "tls:HOST:PORT"
    model         which of the server's; empty: its first
    role          "viewer", "commenter", "editor" or "owner": what to ask for. Whose user is less there may not join; who
                  does not join does what both allow
    name          what others see
    client_key    new_client_key() of an earlier time: to be the same client again, with its undo; else a new one
    credentials   for tls: the folder of a paired server; else it is looked for among those of this user
    timeout       seconds for each answer, for the connection too
    answer_when   "applied" or "durable": how safe an operation shall be before it is answered; None: as the server likes
    reconnect     after a lost connection, connect again for up to `timeout`, and send again what was not answered: it is
                  applied once
    """

    def __init__(
        self,
        endpoint,
        *,
        model="",
        role="editor",
        name=None,
        client_key=None,
        credentials=None,
        timeout=30.0,
        answer_when=None,
        reconnect=True,
    ):
        if role not in messages.ROLES:
            raise ValueError("role: found %r, expected one of %s" % (role, ", ".join(messages.ROLES)))
        if answer_when not in messages.LEVELS:
            raise ValueError('answer_when: found %r, expected "applied", "durable" or None' % (answer_when,))
        self.endpoint, self.model, self.timeout = endpoint, model, timeout
        self.client_key = client_key or new_client_key()
        self._role, self._credentials, self._answer_when = role, credentials, answer_when
        self._name = name if name is not None else _users_name()
        self._reconnect = reconnect
        # Never from 1: a client with a key of an earlier time has used that, and a number is applied once.
        self._operations = itertools.count(secrets.randbits(62) + 1)
        self._live = threading.RLock()  # of the connection itself
        self._closed = False
        self._watch = threading.Condition()
        self._scene, self._joined = Scene(), False
        self._join_facts = None
        self._whole, self._changed, self._removed = False, {}, {}
        self._presences, self._lost, self._capture_ns, self._anything = {}, None, 0, False
        self._first_scene, self._ever_scene = True, False
        try:
            self._connection = self._new_connection(time.monotonic() + timeout)
        except ServerClosed as closed:
            raise _refusal(closed) from None
        if model:  # who has not joined means the server's first one
            try:
                self.join()
            except BaseException:
                self.close()
                raise

    # --- the connection

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._closed = True
        self._connection.close()
        with self._watch:
            self._watch.notify_all()

    @property
    def client_id(self):
        return self._connection.welcome.client_id

    @property
    def server(self):
        """The server's program and version."""
        return self._connection.welcome.program

    @property
    def role(self):
        """What this client may do; known after join() and what joins, else ""."""
        return messages.name_of(messages.ROLES, self._join_facts.role) if self._join_facts else ""

    def _new_connection(self, deadline):
        connection = Connection(
            self.endpoint,
            self._role,
            self._name,
            self.client_key,
            self._credentials,
            max(0.001, deadline - time.monotonic()),
            self._on_message,
            self._on_lost,
        )
        return connection

    def _live_connection(self, deadline):
        """The present one, or after its end a new one, which takes until the deadline at most."""
        with self._live:
            pause = RECONNECT_FIRST_S
            while self._connection.closed:
                if self._closed or not self._reconnect:
                    raise self._connection._error
                try:
                    self._connection = self._new_connection(deadline)
                    if self._joined:
                        self._send_join(self._connection, deadline)
                except ServerClosed as error:
                    if not _worth_another_try(error) or time.monotonic() + pause > deadline:
                        raise
                    time.sleep(pause)
                    pause = min(2 * pause, RECONNECT_MOST_S)
                except (ConnectionLost, Timeout):
                    if time.monotonic() + pause > deadline:
                        raise
                    time.sleep(pause)
                    pause = min(2 * pause, RECONNECT_MOST_S)
            return self._connection

    def _exchange(self, make, repeatable, timeout):
        """The answer to make(envelope) -> the message with `request`; asked again where that is safe."""
        timeout = self.timeout if timeout is None else timeout
        deadline = time.monotonic() + timeout
        while True:
            connection = self._live_connection(deadline)
            envelope = messages.Envelope()
            body = make(envelope)
            safe = repeatable or connection.welcome.protocol_minor >= MINOR_WITH_CLIENT_KEYS
            try:
                answer, again = connection.exchange(
                    envelope, lambda number: setattr(body, "request", number), max(0.0, deadline - time.monotonic())
                )
            except ConnectionLost as lost:
                if self._closed or not self._reconnect or not safe or time.monotonic() >= deadline:
                    raise
                if not _worth_another_try(lost):
                    raise
                continue
            if again:
                if not safe:
                    raise ConnectionLost("the server has dropped its answer")
                continue
            if answer.HasField("failure"):
                raise Refused(answer.failure.code, answer.failure.field, answer.failure.message)
            return answer

    # --- operations and queries

    def submit(self, operation, *, answer_when=None, timeout=None):
        """One operation: a dict in the JSON form of scripts (proto/SCRIPT.md), or a message. An Outcome; Refused."""
        message = messages.operation_of(operation)
        if not message.client_op_id:
            message.client_op_id = next(self._operations)
        level = messages.LEVELS[answer_when or self._answer_when]

        def make(envelope):
            envelope.submit.operation.CopyFrom(message)
            envelope.submit.answer_when = level
            return envelope.submit

        # Exports change nothing, so that they may be asked for twice.
        return Outcome(self._exchange(make, message.WhichOneof("body") == "export", timeout))

    def do(self, operation, /, **members):
        """The operation of this name with these fields: model.do("rename", entity="top", name="Lid")."""
        return self.submit({operation: members})

    def ask(self, query, *, timeout=None):
        """The answer to a query, a dict {"surface": {"entity": "top"}} or a message: a QueryResult's body."""
        message = messages.query_of(query)

        def make(envelope):
            envelope.ask.query.CopyFrom(message)
            return envelope.ask

        result = self._exchange(make, True, timeout).result
        kind = result.WhichOneof("body")
        return getattr(result, kind) if kind else None

    def query(self, what, /, **members):
        """The answer as a dict: model.query("surface", entity="top")["degree"]."""
        return messages.plain(self.ask({what: members}))

    # --- the model

    def dual_shape(self, identifier="", *, name="", degree=0):
        """Makes a shape that is points and surface at once."""
        made = self.submit({"createDualShape": {"id": identifier, "name": name, "degree": degree}})
        return DualShape(self, identifier or made.entities[0])

    def shape(self, identifier):
        """A shape that is there already."""
        return DualShape(self, identifier)

    def entities(self):
        return self.query("entities")["entities"]

    def hash(self):
        """SHA-256 of the whole document: equal for equal models."""
        return self.ask({"hash": {}}).sha256

    def history(self):
        return self.query("history")

    def undo(self):
        """Takes back the newest step of this client."""
        return self.submit({"undo": {}})

    def redo(self):
        return self.submit({"redo": {}})

    def export(self, path, *, entities=(), untrimmed=False):
        """Writes STEP, IGES, glTF (.glb) or OBJ, by the name's ending, on the server's side."""
        return self.submit({"export": {"path": str(path), "entities": list(entities), "untrimmed": untrimmed}})

    def add_points(self, identifier, points, pressure=1.0, **options):
        operation = messages.Operation()
        fields.fill(operation.add_points, {"entity": identifier}, "add_points")
        add_point_messages(operation.add_points.points, points, pressure)
        if options:
            fields.fill(operation.add_points, options, "add_points")
        return self.submit(operation)

    # --- versions and comments (U6)

    def name_version(self, name, note=""):
        return self.submit({"nameVersion": {"name": name, "note": note}})

    def restore_version(self, name):
        return self.submit({"restoreVersion": {"name": name}})

    def versions(self):
        return self.query("versions")["versions"]

    def difference(self, since, until=""):
        """What was done from one version to another, or to the present: sentences."""
        return self.query("difference", **{"from": since, "to": until})["sentences"]

    def comment(self, text, *, entity="", place=None, reply_to=""):
        """Pins words to an entity, a place or another comment. Its id."""
        operation = messages.Operation()
        request = operation.add_comment
        request.id = "comment-" + secrets.token_hex(8)
        request.text, request.entity, request.reply_to = text, entity, reply_to
        if place is not None:
            messages.vec3(request.place, place)
        self.submit(operation)
        return request.id

    def resolve_comment(self, identifier):
        return self.submit({"changeComment": {"id": identifier, "resolved": True}})

    def comments(self, *, resolved=False):
        return self.query("comments", resolved=resolved)["comments"]

    # --- people

    def people(self):
        """Who works on this model now, this client among them; joins it, since only then one is there."""
        self.join()
        return self.query("people")["people"]

    def models(self):
        """Of the server, those that this client may see."""
        return self.query("models")["models"]

    @contextlib.contextmanager
    def lease(self, identifier):
        """While it lasts, others are told that this client shapes the entity. Refused while it is somebody else's."""
        self.join()  # a lease ends with who is there
        over = threading.Event()

        def ask(release):
            def make(envelope):
                envelope.lease.entity, envelope.lease.release = identifier, release
                return envelope.lease

            return self._exchange(make, True, None)

        def renew():
            while not over.wait(LEASE_RENEWED_EVERY_S):
                try:
                    ask(False)
                except HandloftError:
                    return

        ask(False)
        thread = threading.Thread(target=renew, name="handloft lease", daemon=True)
        thread.start()
        try:
            yield self.shape(identifier)
        finally:
            over.set()
            thread.join()
            with contextlib.suppress(HandloftError):
                ask(True)

    # --- what others see

    def join(self):
        """Comes to the model: from now on the server sends the scene, and the others see who is there.

        watch(), people(), lease() and connect(model=...) do this by themselves. NotAdmitted when the server has no such
        model or this user may less on it than `role`: then one has not come, and what needs no join goes on.
        """
        deadline = time.monotonic() + self.timeout
        pause = RECONNECT_FIRST_S
        while True:
            try:
                with self._live:
                    if self._joined and self._connection.admitted:
                        return  # A connection that was lost since is made again, and joins, when it is needed.
                    connection = self._live_connection(deadline)
                    if not self._joined:
                        self._send_join(connection, deadline)
                        self._joined = True
                return connection.wait_admitted(max(0.0, deadline - time.monotonic()))
            except ConnectionLost as lost:
                again = self._reconnect and not self._closed and _worth_another_try(lost)
                if not again or time.monotonic() + pause > deadline:
                    if not isinstance(lost, ServerClosed):
                        raise
                    refusal = _refusal(lost)
                    if isinstance(refusal, NotAdmitted):
                        # Without a name, what needs no join still means the first model; else it would mean another.
                        self._joined, self._join_facts = bool(self.model), None
                    raise refusal from None
                time.sleep(pause)
                pause = min(2 * pause, RECONNECT_MOST_S)

    def _send_join(self, connection, deadline):
        envelope = messages.Envelope()
        envelope.join.model = self.model
        with self._watch:
            self._first_scene = True
            if self._scene.epoch and connection.welcome.protocol_minor >= MINOR_WITH_CLIENT_KEYS:
                self._scene._held(envelope.join)
        connection.send(envelope, max(0.0, deadline - time.monotonic()))

    def watch(self, timeout=None):
        """Yields a Change whenever the scene has changed, the first with all of it, until close().

        Who is slow misses steps between, never the newest state. With a timeout it ends after so many seconds without a
        change. What it yields are values: they stay as they are.
        """
        self.join()
        while True:
            deadline = None if timeout is None else time.monotonic() + timeout
            change = lost = None
            with self._watch:
                while not (self._anything or self._lost or self._closed):
                    left = None if deadline is None else deadline - time.monotonic()
                    if left is not None and left <= 0:
                        return
                    self._watch.wait(left)
                if self._anything:
                    change = self._take_change()
                elif self._closed:
                    return
                else:
                    (connection, lost), self._lost = self._lost, None
            if change is not None:
                yield change
            elif connection is not self._connection:
                pass  # There is a newer one already.
            elif not self._reconnect or not _worth_another_try(lost):
                raise lost
            else:
                self._live_connection(time.monotonic() + self.timeout)

    def _take_change(self):
        """With the lock held: what has come since the last one."""
        change = Change(
            self._scene._still(),
            self._whole,
            list(self._changed),
            list(self._removed),
            self._capture_ns,
            list(self._presences.values()),
        )
        self._whole, self._changed, self._removed, self._anything = False, {}, {}, False
        self._presences = {}
        return change

    def _on_message(self, envelope):
        kind = envelope.WhichOneof("body")
        if kind == "snapshot" and not self._first_scene:
            # A whole scene that nobody asked for: the server has dropped what waited for us, answers too.
            self._connection.answers_may_be_gone()
        with self._watch:
            if kind == "snapshot":
                self._first_scene = False
                before = set(self._scene.entities)
                self._changed = dict.fromkeys(self._scene._take_snapshot(envelope.snapshot))
                self._removed = dict.fromkeys(before - set(self._changed))
                self._whole = self._anything = self._ever_scene = True
            elif kind == "delta":
                self._first_scene = False
                self._scene._take_delta(envelope.delta)
                for state in envelope.delta.changed:
                    self._changed[state.id] = None
                    self._removed.pop(state.id, None)
                for identifier in envelope.delta.removed:
                    self._removed[identifier] = None
                    self._changed.pop(identifier, None)
                self._capture_ns = envelope.delta.capture_time_ns or self._capture_ns
                self._anything = self._ever_scene = True
            elif kind == "presence":
                key = (envelope.presence.client_id, envelope.presence.name)
                self._presences[key] = messages.plain(envelope.presence)
                self._anything = self._ever_scene  # what comes of others before the scene is told with it
            elif kind == "people":
                self._scene.people = messages.plain(envelope.people)["people"]
                self._anything = self._ever_scene
            elif kind == "joined":
                self._join_facts = envelope.joined
                return
            else:
                return  # a word without `closing`, or something of a later version
            self._watch.notify_all()

    def _on_lost(self, connection, error):
        with self._watch:
            self._lost = connection, error
            self._watch.notify_all()
