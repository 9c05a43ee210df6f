"""The server as a service (issue 7, part 6): systemd, metrics, health, logs, its end, backups, manual pages."""

import contextlib
import json
import os
import pwd
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import time
import unittest
import urllib.error
import urllib.request
from unittest import mock

import handloft
import handloft.connection
from handloft import messages
from support import MODELD, PATIENCE, PROGRAMS, SOURCES, FakeServer, Peer, ServerTest  # noqa: F401

UNITS = os.environ["HANDLOFT_UNITS"].split(":")


def login_name():
    """As the server names this process's user: by what the kernel says of it, whatever USER and LOGNAME say."""
    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return "uid-%d" % os.getuid()


def read_until(descriptor_of, wanted):
    """Datagrams until one holds the words."""
    heard = ""
    descriptor_of.settimeout(PATIENCE)
    while wanted not in heard:
        heard += descriptor_of.recv(4096).decode() + "\n"
    return heard


class Service(ServerTest):
    def get(self, address, page):
        try:
            with urllib.request.urlopen("http://%s%s" % (address, page), timeout=PATIENCE) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as answer:
            return answer.code, answer.read().decode()

    def serve_with_metrics(self, *options, **process_options):
        words = [MODELD, "serve", "--listen", self.endpoint, "--metrics", "127.0.0.1:0", "--write-folder", self.folder, *options]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **process_options)
        self.addCleanup(self.end, process)
        ready = json.loads(process.stdout.readline())
        return process, ready["metrics"][len("tcp:") :]

    def metrics_with(self, address, line):
        """Asks until `line` is among them; fails when it never is."""
        end = time.monotonic() + PATIENCE
        while True:
            status, text = self.get(address, "/metrics")
            self.assertEqual(status, 200)
            if line in text:
                return text
            self.assertLess(time.monotonic(), end, "%s is never in %s" % (line, text))

    def test_systemd_hears_of_it_and_hands_it_its_socket(self):
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        path = os.path.join(self.folder, "activated.sock")
        listener.bind(path)
        listener.listen(8)
        notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        notify.bind(os.path.join(self.folder, "notify.sock"))
        self.addCleanup(listener.close)
        self.addCleanup(notify.close)
        child = os.fork()
        if child == 0:
            try:
                os.dup2(listener.fileno(), 3)
                os.set_inheritable(3, True)  # also when it was 3 before
                null = os.open(os.devnull, os.O_WRONLY)
                os.dup2(null, 1)
                os.environ.update(
                    LISTEN_FDS="1", LISTEN_PID=str(os.getpid()), NOTIFY_SOCKET=os.path.join(self.folder, "notify.sock"),
                    WATCHDOG_USEC="300000", WATCHDOG_PID=str(os.getpid()),
                )
                os.execv(MODELD, [MODELD, "serve", "--log-level", "off"])
            finally:
                os._exit(127)
        try:
            read_until(notify, "READY=1")
            read_until(notify, "WATCHDOG=1")
            with handloft.connect("unix:" + path, timeout=PATIENCE) as model:
                self.assertEqual(model.entities(), [])
            os.kill(child, signal.SIGHUP)
            read_until(notify, "RELOADING=1")
            read_until(notify, "READY=1")
            read_until(notify, "WATCHDOG=1")
        finally:
            os.kill(child, signal.SIGTERM)
            _, status = os.waitpid(child, 0)
        self.assertEqual(status, 0)
        read_until(notify, "STOPPING=1")
        self.assertTrue(os.path.exists(path), "the socket is systemd's and stays")

    def test_metrics_tell_what_is_done_and_health_that_it_lives(self):
        _, address = self.serve_with_metrics("--store", os.path.join(self.folder, "seat.handloft"))
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model, handloft.connect(
            self.endpoint, role="viewer", timeout=PATIENCE
        ):
            model.dual_shape("a")
            model.add_points("a", [(0, 0, 0)])
            with self.assertRaises(handloft.Refused):
                model.do("fit", entity="nobody")
            with self.assertRaises(handloft.Refused):
                model.query("surface", entity="nobody")
            with self.assertRaises(handloft.Refused), model.lease("nobody"):
                pass
            with self.assertRaises(handloft.ServerClosed):  # of another version
                with mock.patch.object(handloft.connection, "PROTOCOL_MAJOR", 9):
                    handloft.connect(self.endpoint, timeout=PATIENCE)
            with self.assertRaises(handloft.ServerClosed):
                handloft.connect(self.endpoint, model="elsewhere", timeout=PATIENCE).people()
            # Who was refused is counted as there until the server has seen that end.
            text = self.metrics_with(address, 'handloft_clients{role="editor"} 1\n')
            for line in (
                'handloft_operations_total{kind="create_dual_shape"} 1',
                'handloft_operations_total{kind="add_points"} 1',
                'handloft_refusals_total{asked="operation",code="not_found"} 1',
                'handloft_refusals_total{asked="query",code="not_found"} 1',
                'handloft_refusals_total{asked="lease",code="not_found"} 1',
                'handloft_refusals_total{asked="hello",code="unsupported"} 1',
                'handloft_refusals_total{asked="join",code="not_found"} 1',
                'handloft_model_operations_total{model="main"} 2',
                'handloft_model_refusals_total{model="main"} 3',
                "handloft_operation_applied_seconds_count 2",
                "handloft_operation_durable_seconds_count 2",
                "handloft_store_commit_seconds_count 2",
                'handloft_clients{role="viewer"} 1',
                "handloft_clients_served_total 3",
                "handloft_models 1",
                'handloft_store_writable{model="main"} 1',
                'handloft_store_durable_sequence{model="main"} 2',
            ):
                self.assertIn(line + "\n", text)
            self.assertGreater(int(re.search(r"handloft_store_bytes\{.*\} (\d+)", text).group(1)), 10000)
            self.assertIn("handloft_store_recovery_seconds", text)
            # Every family is described once, and each line is a sample of one.
            families = re.findall(r"^# TYPE (\S+) (\S+)$", text, re.MULTILINE)
            self.assertEqual(len(families), len(set(families)))
            for line in text.splitlines():
                self.assertRegex(line, r'^(# (HELP|TYPE) handloft_.+|handloft_[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [-+.e0-9naif]+)$')
        self.assertEqual(self.get(address, "/healthz"), (200, "ok\n"))
        self.assertEqual(self.get(address, "/readyz"), (200, "ok\n"))
        self.assertEqual(self.get(address, "/")[0], 404)

    def test_stopping_answers_what_waits_says_why_and_takes_little_time(self):
        store = os.path.join(self.folder, "seat.handloft")
        server = self.serve("--store", store)
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.settimeout(PATIENCE)
        connection.connect(self.endpoint[len("unix:") :])
        peer = Peer(connection)
        hello = messages.Envelope()
        hello.hello.protocol_major, hello.hello.protocol_minor, hello.hello.role = 1, 2, messages.ROLES["editor"]
        peer.send(hello)
        self.assertTrue(peer.receive().HasField("welcome"))
        for i in range(50):
            submit = messages.Envelope()
            submit.submit.request = i + 1
            submit.submit.operation.create_dual_shape.id = "s%d" % i
            peer.send(submit)
        self.assertEqual(peer.receive().ack.request, 1)
        start = time.monotonic()
        server.send_signal(signal.SIGTERM)
        answered = 1
        while True:
            envelope = peer.receive()
            if envelope.WhichOneof("body") == "failure":
                break
            self.assertFalse(envelope.ack.HasField("failure"))
            answered += 1
        self.assertTrue(envelope.failure.closing)
        self.assertIn("stops", envelope.failure.message)
        with self.assertRaises(EOFError):
            peer.receive()
        connection.close()
        self.assertEqual(server.wait(PATIENCE), 0)
        self.assertLess(time.monotonic() - start, 12.0)
        # What was answered is there.
        with open(os.path.join(self.folder, "look.jsonl"), "w", encoding="utf-8") as script:
            script.write('{"query": {"entities": {}}}\n')
        self.serve("--store", store)
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            self.assertGreaterEqual(len(model.entities()), answered)

    def test_of_several_models_each_has_its_figures(self):
        models = os.path.join(self.folder, "models")
        process, address = self.serve_with_metrics("--models", models, "--create", "owners")
        with handloft.connect(self.endpoint, role="owner", model="seat", timeout=PATIENCE) as seat, handloft.connect(
            self.endpoint, role="owner", model="mouse", timeout=PATIENCE
        ) as mouse:
            self.assertEqual([one["name"] for one in seat.people()], [one["name"] for one in mouse.people()])
            seat.dual_shape("a")
            seat.dual_shape("b")
            mouse.dual_shape("c")
            with self.assertRaises(handloft.Refused):
                mouse.do("fit", entity="a")
            _, text = self.get(address, "/metrics")
            for line in (
                "handloft_models 3",
                'handloft_model_operations_total{model="seat"} 2',
                'handloft_model_operations_total{model="mouse"} 1',
                'handloft_model_refusals_total{model="mouse"} 1',
                'handloft_model_clients{model="seat"} 1',
                'handloft_model_clients{model="main"} 0',
                'handloft_store_writable{model="mouse"} 1',
                'handloft_store_durable_sequence{model="seat"} 2',
            ):
                self.assertIn(line + "\n", text)
            for name in ("main", "seat", "mouse"):
                self.assertRegex(text, r'handloft_model_silence_seconds\{model="%s"\} [-e.0-9]+\n' % name)
        self.assertEqual(self.get(address, "/readyz"), (200, "ok\n"))

    def test_a_model_that_cannot_be_kept_is_named_and_the_others_go_on(self):
        largest = 400_000  # bytes of any file: what a full disk is to this model

        def small_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

        _, address = self.serve_with_metrics("--models", os.path.join(self.folder, "models"), preexec_fn=small_files,
                                             restore_signals=False)
        connect = lambda name: handloft.connect(self.endpoint, role="owner", model=name, timeout=PATIENCE)
        with connect("seat") as seat, connect("mouse") as mouse:
            seat.dual_shape("a")
            self.assertEqual(self.get(address, "/readyz"), (200, "ok\n"))
            with self.assertRaises(handloft.Refused) as refused:
                for step in range(100):
                    seat.add_points("a", [(0.001 * i, 0.001 * step, 0.01) for i in range(1000)])
            self.assertEqual(refused.exception.code, "io")
            status, words = self.get(address, "/readyz")
            self.assertEqual(status, 503)
            self.assertIn('"seat"', words)
            self.assertNotIn("mouse", words)
            self.assertEqual(self.get(address, "/healthz"), (200, "ok\n"))
            mouse.dual_shape("b")
            _, text = self.get(address, "/metrics")
            for name, writable in (("seat", 0), ("mouse", 1), ("main", 1)):
                self.assertIn('handloft_store_writable{model="%s"} %d\n' % (name, writable), text)

    def test_logs_as_json_say_whose_line_it_is(self):
        models = os.path.join(self.folder, "models")
        process, _ = self.serve_with_metrics("--models", models, "--log-format", "json", "--log-level", "debug",
                                             "--listen", "tcp:127.0.0.1:0")
        with handloft.connect(self.endpoint, role="owner", model="seat", timeout=PATIENCE, name='A "quoted"\nname') as model:
            model.dual_shape("a")
            client = str(model.client_id)
        with self.assertRaises(handloft.ServerClosed):
            with mock.patch.object(handloft.connection, "PROTOCOL_MAJOR", 9):
                handloft.connect(self.endpoint, timeout=PATIENCE)
        process.terminate()
        _, errors = process.communicate(timeout=PATIENCE)
        lines = [json.loads(line) for line in errors.splitlines()]
        for line in lines:
            self.assertTrue(line["component"] and line["message"] and line["level"] and line["time"].endswith("Z"))
        about = [line for line in lines if line.get("client") == client]
        for words in ("connected as", "joined as owner", ") is gone: "):
            self.assertEqual(len([line for line in about if words in line["message"]]), 1, (words, about))
        for line in about:
            self.assertTrue(line["remote"].startswith("unix"), line)
            self.assertEqual(line["user"], login_name())
        self.assertIn("net", {line["component"] for line in about})
        self.assertEqual({line["model"] for line in about if "joined as" in line["message"]}, {"seat"})
        refused = [line for line in lines if "protocol version 9" in line["message"]]
        self.assertTrue(refused and all(line["client"] and line["remote"] for line in refused))
        of_models = {line["model"] for line in lines if "replayed" in line["message"]}
        self.assertEqual(of_models, {"main", "seat"})
        # What is about nobody and no model says so.
        ending = [line for line in lines if "stopping on signal" in line["message"]]
        self.assertEqual(len(ending), 1)
        self.assertNotIn("model", ending[0])
        self.assertNotIn("client", ending[0])

    def hang_up(self, process, wanted):
        """SIGHUP; the line that says what came of it."""
        process.send_signal(signal.SIGHUP)
        while True:
            line = json.loads(process.stderr.readline())
            if wanted in line["message"]:
                return line

    def test_the_configuration_is_read_again_while_people_work(self):
        config = os.path.join(self.folder, "modeld.toml")
        with open(os.path.join(SOURCES, "deploy/config/modeld.toml"), encoding="utf-8") as file:
            example = file.read()

        def write(*changes):
            text = example
            for before, after in changes:
                self.assertIn(before, text)
                text = text.replace(before, after)
            with open(config, "w", encoding="utf-8") as to:
                to.write(text)

        write()
        process, _ = self.serve_with_metrics("--config", config, "--log-format", "json", "--listen", "tcp:127.0.0.1:0")
        self.assertIn("changed: nothing; with the next start: nothing", self.hang_up(process, "read again")["message"])
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            model.dual_shape("a")
            write(("max_connections = 256", "max_connections = 1"), ("max_message_kib = 16384", "max_message_kib = 1024"),
                  ('tcp_role = "editor"', 'tcp_role = "viewer"'))
            told = self.hang_up(process, "read again")["message"]
            now, later = told.split("; with the next start: ")
            self.assertIn("--limits-max-connections: 256 before, 1 now", now)
            self.assertIn("--people-tcp-role: editor before, viewer now", now)
            self.assertNotIn("max-message", now)
            self.assertIn("--limits-max-message-kib: 16384 before, 1024 now", later)
            # It holds: one is there already, and stays.
            with self.assertRaises(handloft.ServerClosed) as refused:
                handloft.connect(self.endpoint, timeout=2.0, reconnect=False)
            self.assertEqual(refused.exception.code, "resource_exhausted")
            model.dual_shape("b")
            # A mistake is told by its field, and nothing changes: neither what is wrong nor what is right.
            write(("max_connections = 256", "max_connections = 0"), ("max_half_open = 64", "max_half_open = 1"))
            wrong = self.hang_up(process, "stays as it was")
            self.assertEqual(wrong["level"], "error")
            self.assertIn("limits.max_connections", wrong["message"])
            write(("max_connections = 256", "max_conections = 3"))
            self.assertIn("limits.max_conections", self.hang_up(process, "stays as it was")["message"])
            os.remove(config)
            self.assertIn("modeld.toml", self.hang_up(process, "stays as it was")["message"])
            model.dual_shape("c")
            # What needs a restart is told again as long as it has not had one.
            write(("max_message_kib = 16384", "max_message_kib = 1024"))
            told = self.hang_up(process, "read again")["message"]
            self.assertIn("--limits-max-connections: 1 before, 256 now", told)
            self.assertIn("with the next start: --limits-max-message-kib: 16384 before, 1024 now", told)
            with handloft.connect(self.endpoint, timeout=PATIENCE):
                pass
            write()
            with open(config, "a", encoding="utf-8") as to:
                to.write("")
            self.hang_up(process, "read again")

    def test_who_comes_by_tcp_is_told_of_another_role(self):
        config = os.path.join(self.folder, "modeld.toml")
        for role in ("editor", "viewer", "none"):
            with open(config, "w", encoding="utf-8") as to:
                to.write('log_format = "json"\n[people]\ntcp_role = "%s"\n' % role)
            if role == "editor":
                process = self.serve("--config", config, "--log-level", "info", endpoint="tcp:127.0.0.1:0")
                model = handloft.connect(process.endpoint, timeout=PATIENCE, reconnect=False)
                self.addCleanup(model.close)
                model.join()
                model.dual_shape("a")
            elif role == "viewer":
                self.hang_up(process, "read again")
                self.wait_until(lambda: model.role == "viewer")
                with self.assertRaises(handloft.Refused) as refused:
                    model.dual_shape("b")
                self.assertEqual(refused.exception.code, "permission_denied")
                self.assertEqual(len(model.entities()), 1)
            else:
                self.hang_up(process, "read again")
                with self.assertRaises(handloft.ServerClosed) as closed:
                    deadline = time.monotonic() + PATIENCE
                    while time.monotonic() < deadline:
                        with contextlib.suppress(handloft.Refused):  # at once; then the end
                            model.entities()
                self.assertEqual(closed.exception.code, "permission_denied")

    def wait_until(self, holds):
        deadline = time.monotonic() + PATIENCE
        while not holds():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    def test_a_backup_is_taken_while_people_work_and_restores(self):
        store, copy = os.path.join(self.folder, "seat.handloft"), os.path.join(self.folder, "copy.handloft")
        self.serve("--store", store)
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            model.dual_shape("a")
            model.add_points("a", [(0.01 * i, 0, 0) for i in range(50)])
            at_backup = model.hash()
            done = subprocess.run([MODELD, "backup", store, copy, "--json"], stdout=subprocess.PIPE, timeout=PATIENCE)
            self.assertEqual(done.returncode, 0)
            self.assertEqual(json.loads(done.stdout)["operations"], 2)
            model.do("rename", entity="a", name="Later")
            again = subprocess.run([MODELD, "backup", store, copy], stderr=subprocess.PIPE, timeout=PATIENCE)
            self.assertEqual(again.returncode, 1)
            self.assertIn(b"already_exists", again.stderr)
        restored = "unix:" + os.path.join(self.folder, "restored.sock")
        self.serve("--store", copy, endpoint=restored)
        with handloft.connect(restored, timeout=PATIENCE) as model:
            self.assertEqual(model.hash(), at_backup)
            model.do("rename", entity="a", name="Goes on")

    def test_the_unit_is_well_formed_and_hardly_exposed(self):
        analyze = shutil.which("systemd-analyze")
        if analyze is None:
            self.skipTest("systemd-analyze is not installed")
        for unit in UNITS:
            shutil.copy(unit, self.folder)
        service = os.path.join(self.folder, "handloft-modeld.service")
        with open(service, encoding="utf-8") as file:
            text = re.sub(r"ExecStart=\S+", "ExecStart=" + MODELD, file.read())
        with open(service, "w", encoding="utf-8") as file:
            file.write(text)
        judged = subprocess.run([analyze, "security", "--offline=yes", "--no-pager", "--threshold=25", service],
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE)
        self.assertEqual(judged.returncode, 0, judged.stdout)
        self.assertIn("Overall exposure level", judged.stdout)
        worse = text.replace("NoNewPrivileges=yes", "").replace("ProtectSystem=strict", "").replace("DynamicUser=yes", "")
        worse = worse.replace("CapabilityBoundingSet=\n", "").replace("SystemCallFilter=", "#").replace("PrivateUsers=yes", "")
        with open(service, "w", encoding="utf-8") as file:
            file.write(worse)
        judged = subprocess.run([analyze, "security", "--offline=yes", "--no-pager", "--threshold=25", service],
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE)
        self.assertNotEqual(judged.returncode, 0, "the judge lets everything pass")
        with open(service, "w", encoding="utf-8") as file:
            file.write(text)
        verified = subprocess.run([analyze, "verify", "--man=no", "--recursive-errors=no", service,
                                   os.path.join(self.folder, "handloft-modeld.socket")],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE)
        self.assertEqual(verified.returncode, 0, verified.stdout)
        self.assertNotIn("handloft", verified.stdout)


    def test_the_unit_starts_as_it_is_and_with_its_own_examples(self):
        service = next(unit for unit in UNITS if unit.endswith(".service"))
        with open(service, encoding="utf-8") as file:
            text = file.read()
        state = os.path.join(self.folder, "handloft")
        os.mkdir(state)
        for before, after in (("%S", self.folder), ("/var/lib", self.folder), ("0.0.0.0:7401", "127.0.0.1:0"), (":9465", ":0")):
            self.assertIn(before, text)
            text = text.replace(before, after)
        command = re.search(r"^ExecStart=\S+ (serve .*)$", text, re.MULTILINE).group(1)
        preset = dict(re.findall(r'^Environment="(\w+)=(.*)"$', text, re.MULTILINE))
        examples = dict(re.findall(r"^#   (HANDLOFT_\w+)=(.*)$", text, re.MULTILINE))
        self.assertEqual(set(examples), {"HANDLOFT_MODELD_MODELS", "HANDLOFT_MODELD_OPTIONS"})
        environment = dict(os.environ, XDG_RUNTIME_DIR=self.folder, XDG_CONFIG_HOME=self.folder)

        def start(file):
            """As systemd does: $NAME becomes any number of words, and a file beats what the unit says."""
            known, words = {**preset, **file}, []
            for word in command.split():
                words += known.get(word[1:], "").split() if word.startswith("$") else [word]
            self.assertNotIn("$", " ".join(words))
            process = subprocess.Popen([MODELD, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=state,
                                       env=environment, umask=0o077)
            self.addCleanup(self.end, process)
            line = process.stdout.readline()
            self.assertTrue(line, "" if line else process.stderr.read())
            return process, json.loads(line)

        process, _ = start({})
        self.assertEqual(sorted(os.listdir(state))[0], "main.handloft")
        process.terminate()
        self.assertEqual(process.wait(PATIENCE), 0)
        _, ready = start(examples)
        self.assertEqual(os.listdir(os.path.join(state, "models"))[0][:13], "main.handloft")
        invite = re.search(r"^#   handloft-modeld (invite .* --name \w+)", text, re.MULTILINE).group(1)
        invited = subprocess.run([MODELD, *invite.split(), "--json"], stdout=subprocess.PIPE, check=True, text=True, timeout=PATIENCE)
        answer = json.loads(invited.stdout)
        self.assertFalse(answer["new_file"])
        subprocess.run([MODELD, "pair", answer["code"], "--connect", ready["endpoints"][0]], stdout=subprocess.PIPE, check=True,
                       env=environment, timeout=PATIENCE)


class ScriptsThroughRestarts(ServerTest):
    """`handloft-modeld run --connect` goes on when the server is restarted, and nothing is done twice (H3)."""

    def run_script(self, endpoint, *options):
        process = subprocess.Popen([MODELD, "run", "-", "--connect", endpoint, *options], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1)
        self.addCleanup(self.end, process)
        self.addCleanup(process.stdin.close)
        return process

    @staticmethod
    def say(process, line):
        process.stdin.write(json.dumps(line) + "\n")
        process.stdin.flush()

    def ask(self, process, line):
        self.say(process, line)
        return json.loads(process.stdout.readline())

    def test_the_server_is_restarted_in_between(self):
        store = os.path.join(self.folder, "seat.handloft")
        server = self.serve("--store", store)
        script = self.run_script(self.endpoint)
        self.assertTrue(self.ask(script, {"createDualShape": {"id": "a"}})["ok"])
        for number, how in enumerate((signal.SIGTERM, signal.SIGKILL)):
            server.send_signal(how)
            server.wait(PATIENCE)
            self.say(script, {"createDualShape": {"id": "b%d" % number}})  # while there is none
            server = self.serve("--store", store)
            self.assertTrue(json.loads(script.stdout.readline())["ok"])
            self.assertTrue(self.ask(script, {"rename": {"entity": "a", "name": "A%d" % number}})["ok"])
        self.assertTrue(self.ask(script, {"undo": {}})["ok"], "the same client still, whose step that was")
        script.stdin.close()
        self.assertEqual(script.wait(PATIENCE), 0, script.stderr.read())
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            self.assertEqual([(one["id"], one.get("name", "")) for one in model.entities()][0], ("a", "A0"))
            self.assertEqual({one["id"] for one in model.entities()}, {"a", "b0", "b1"})

    def test_an_answer_that_was_lost_is_asked_for_again_and_nothing_done_twice(self):
        self.serve("--store", os.path.join(self.folder, "seat.handloft"))
        lost = []

        def between(peer, number):
            """Passes on what both say, but on the first connection not the answer to the second operation."""
            upstream = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            upstream.settimeout(PATIENCE)
            with upstream:
                upstream.connect(self.endpoint[len("unix:") :])
                server, submits = Peer(upstream), 0
                while True:
                    said = peer.receive()
                    submits += said.HasField("submit")
                    server.send(said)
                    answer = server.receive()
                    if number == 0 and submits == 2:
                        lost.append((said.submit.operation.client_op_id, answer.ack.sequence))
                        return
                    if number == 1 and said.HasField("submit") and len(lost) == 1:
                        lost.append((said.submit.operation.client_op_id, answer.ack.sequence))
                    peer.send(answer)

        fake = FakeServer(self.folder, between)
        self.addCleanup(fake.close)
        script = self.run_script(fake.endpoint)
        made = [self.ask(script, {"createDualShape": {}}) for _ in range(3)]
        self.assertEqual([one["result"]["sequence"] for one in made], [1, 2, 3])
        self.assertEqual(len(lost), 2)
        self.assertEqual(lost[0], lost[1], "asked for with the same number, and answered as the first time")
        script.stdin.close()
        self.assertEqual(script.wait(PATIENCE), 0, script.stderr.read())
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            self.assertEqual(len(model.entities()), 3)

    def test_where_nothing_is_kept_the_script_ends_rather_than_go_on_without_its_model(self):
        server = self.serve()
        script = self.run_script(self.endpoint)
        self.assertTrue(self.ask(script, {"createDualShape": {"id": "a"}})["ok"])
        server.kill()
        server.wait(PATIENCE)
        self.serve()
        self.assertFalse(self.ask(script, {"createDualShape": {"id": "b"}})["ok"])
        self.assertEqual(script.wait(PATIENCE), 1)
        with handloft.connect(self.endpoint, timeout=PATIENCE) as model:
            self.assertEqual(model.entities(), [])


class Installed(ServerTest):
    """`cmake --install` into a folder of its own: everything that belongs to the programs that were built."""

    def test_what_is_installed_is_whole_and_works(self):
        prefix = os.path.join(self.folder, "prefix")
        done = subprocess.run([os.environ["HANDLOFT_CMAKE"], "--install", os.environ["HANDLOFT_BUILD"], "--prefix", prefix],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE)
        if done.returncode != 0 and "cannot find" in done.stdout:
            self.skipTest("not all programs are built: " + done.stdout.splitlines()[-1])
        self.assertEqual(done.returncode, 0, done.stdout)

        def read(*path):
            with open(os.path.join(prefix, *path), encoding="utf-8") as file:
                return file.read()

        for program in map(os.path.basename, PROGRAMS):
            self.assertTrue(os.access(os.path.join(prefix, "bin", program), os.X_OK), program)
            self.assertIn(".TH", read("share", "man", "man1", program + ".1"))
            self.assertIn("complete ", read("share", "bash-completion", "completions", program))
            self.assertIn("#compdef ", read("share", "zsh", "site-functions", "_" + program))
            self.assertIn("complete ", read("share", "fish", "vendor_completions.d", program + ".fish"))
            unit_folder = {"handloft-modeld": "system", "handloft-trackd": "user"}.get(program)
            if unit_folder:
                unit = read("lib", "systemd", unit_folder, program + ".service")
                self.assertIn("ExecStart=%s/bin/%s" % (prefix, program), unit)
                self.assertNotIn("@", re.sub(r"[A-Za-z0-9]@|=~?@[a-z]|[ ]@[a-z]", "", unit), "all names are filled in")
                self.assertIn("[Socket]", read("lib", "systemd", unit_folder, program + ".socket"))
        docs = [folder for folder, _, files in os.walk(prefix) if "modeld.toml" in files]
        self.assertEqual([os.path.relpath(folder, prefix) for folder in docs], ["share/doc/handloft/examples"])
        with open(os.path.join(SOURCES, "deploy/config/modeld.toml"), encoding="utf-8") as file:
            self.assertEqual(read(docs[0], "modeld.toml"), file.read())
        server = subprocess.Popen([os.path.join(prefix, "bin", "handloft-modeld"), "serve", "--listen", self.endpoint,
                                   "--config", os.path.join(docs[0], "modeld.toml")], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, server)
        self.assertTrue(json.loads(server.stdout.readline())["ready"])


if __name__ == "__main__":
    unittest.main()
