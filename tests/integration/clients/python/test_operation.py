"""The server as a service (issue 7, part 6): systemd, metrics, health, logs, its end, backups, manual pages."""

import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import time
import unittest
import urllib.error
import urllib.request

import handloft
from handloft import messages
from support import MODELD, PATIENCE, SOURCES, FakeServer, Peer, ServerTest  # noqa: F401

PROGRAMS = os.environ["HANDLOFT_PROGRAMS"].split(":")
UNITS = os.environ["HANDLOFT_UNITS"].split(":")


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

    def serve_with_metrics(self, *options):
        words = [MODELD, "serve", "--listen", self.endpoint, "--metrics", "127.0.0.1:0", "--write-folder", self.folder, *options]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        ready = json.loads(process.stdout.readline())
        return process, ready["metrics"][len("tcp:") :]

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
            status, text = self.get(address, "/metrics")
            self.assertEqual(status, 200)
            for line in (
                'handloft_operations_total{kind="create_dual_shape"} 1',
                'handloft_operations_total{kind="add_points"} 1',
                'handloft_refusals_total{code="not_found"} 1',
                "handloft_operation_applied_seconds_count 2",
                "handloft_operation_durable_seconds_count 2",
                "handloft_store_commit_seconds_count 2",
                'handloft_clients{role="editor"} 1',
                'handloft_clients{role="viewer"} 1',
                "handloft_clients_served_total 2",
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

    def test_logs_as_json_say_component_and_model(self):
        process, _ = self.serve_with_metrics("--log-format", "json")
        with handloft.connect(self.endpoint, timeout=PATIENCE, name='A "quoted"\nname'):
            pass
        process.terminate()
        _, errors = process.communicate(timeout=PATIENCE)
        lines = [json.loads(line) for line in errors.splitlines()]
        self.assertGreaterEqual(len(lines), 3)
        for line in lines:
            self.assertEqual(line["model"], "main")
            self.assertTrue(line["component"] and line["message"] and line["level"] and line["time"].endswith("Z"))

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


class Pages(unittest.TestCase):
    """Of every program that was built: what --help says is in its manual page and its completion."""

    @staticmethod
    def say(program, *words):
        return subprocess.run([program, *words], stdout=subprocess.PIPE, check=True, text=True, timeout=PATIENCE).stdout

    def flags(self, program):
        pages = [self.say(program, "--help")]
        commands = re.findall(r"^  ([a-z-]+) .*", pages[0].split("Commands:")[1].split("Options:")[0], re.MULTILINE) \
            if "Commands:" in pages[0] else []
        pages += [self.say(program, command, "--help") for command in commands]
        return commands, set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", "\n".join(pages)))

    def test_pages_and_completion_have_every_option(self):
        self.assertGreaterEqual(len(PROGRAMS), 1)
        for program in PROGRAMS:
            commands, flags = self.flags(program)
            page, completion = self.say(program, "--man"), self.say(program, "--completion=bash")
            plain = page.replace("\\-", "-")
            for flag in flags:
                self.assertIn(flag, plain, program)
                self.assertRegex(completion, r"[ ']%s[ ']" % flag, program)
            for command in commands:
                self.assertIn("\\fB%s\\fR" % command.replace("-", "\\-"), page)
                self.assertIn("    %s) words=" % command, completion)

    def test_man_reads_the_pages_without_a_warning(self):
        man = shutil.which("man")
        if man is None:
            self.skipTest("man is not installed")
        for program in PROGRAMS:
            page = self.say(program, "--man")
            read = subprocess.run([man, "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-"], input=page, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, timeout=PATIENCE)
            self.assertEqual((read.returncode, read.stderr), (0, ""), program)
            self.assertIn("SYNOPSIS", re.sub(".\x08", "", read.stdout))  # bold is printed twice

    def test_bash_completes(self):
        for program in PROGRAMS:
            name = os.path.basename(program)
            commands, _ = self.flags(program)
            words = [name, commands[1], "--l"] if commands else [name, "--l"]
            script = self.say(program, "--completion=bash") + (
                "COMP_WORDS=(%s); COMP_CWORD=%d; _%s; printf '%%s\\n' \"${COMPREPLY[@]}\"\n"
                % (" ".join(words), len(words) - 1, name.replace("-", "_"))
            )
            done = subprocess.run(["bash", "-euc", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PATIENCE)
            self.assertEqual(done.stderr, "")
            self.assertIn("--log-level", done.stdout.split())


if __name__ == "__main__":
    unittest.main()
