"""Manual pages and completion of every program that was built, as man and the shells read them (U7)."""

import os
import pty
import re
import select
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from support import PATIENCE, PROGRAMS


class Terminal:
    """A program at a terminal of its own."""

    def __init__(self, words, environment):
        self.pid, self.master = pty.fork()
        if self.pid == 0:
            os.execve(words[0], words, environment)
        self.seen = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self.master)

    def type(self, text):
        self.seen = ""
        os.write(self.master, text.encode())

    def wait_for(self, text):
        until = time.monotonic() + PATIENCE
        while text not in self.seen:
            ready, _, _ = select.select([self.master], [], [], max(0.0, until - time.monotonic()))
            if not ready:
                raise AssertionError("no %r in %r" % (text, self.seen))
            self.seen += os.read(self.master, 65536).decode(errors="replace")


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
            page = self.say(program, "--man")
            completion = {shell: self.say(program, "--completion=" + shell) for shell in ("bash", "zsh", "fish")}
            plain = page.replace("\\-", "-")
            for flag in flags:
                self.assertIn(flag, plain, program)
                for shell, written in {"bash": r"[ ']--%s[ ']", "zsh": r"--%s\b", "fish": r" -l %s\b"}.items():
                    self.assertRegex(completion[shell], written % flag[2:], program)
            for command in commands:
                self.assertIn("\\fB%s\\fR" % command.replace("-", "\\-"), page)
                self.assertIn("    %s) words=" % command, completion["bash"])

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

    def begun(self, program):
        """The words up to a flag that is half written, and that flag."""
        commands, flags = self.flags(program)
        wanted = "--log-level" if "--log-level" in flags else max(flags)
        return [os.path.basename(program), *commands[1:2], wanted[:-2]], wanted

    def test_bash_completes(self):
        def completed(program, words):
            function = "_" + os.path.basename(program).replace("-", "_")
            script = self.say(program, "--completion=bash") + (
                "COMP_WORDS=(%s); COMP_CWORD=%d; %s; printf '%%s\\n' \"${COMPREPLY[@]}\"\n"
                % (" ".join(words), len(words) - 1, function)
            )
            done = subprocess.run(["bash", "-euc", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PATIENCE)
            self.assertEqual(done.stderr, "")
            return done.stdout.split()

        for program in PROGRAMS:
            words, wanted = self.begun(program)
            self.assertIn(wanted, completed(program, words))
            if wanted == "--log-level":
                self.assertEqual(completed(program, words[:-1] + [wanted, "=", "de"]), ["debug"])
                self.assertEqual(completed(program, words[:-1] + [wanted, "de"]), ["debug"])

    def test_fish_completes(self):
        fish = shutil.which("fish")
        if fish is None:
            self.skipTest("fish is not installed")

        def completed(program, words):
            script = self.say(program, "--completion=fish") + "\ncomplete -C '%s'\n" % " ".join(words)
            with tempfile.TemporaryDirectory() as home:
                done = subprocess.run([fish, "--no-config", "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                      timeout=PATIENCE, env={**os.environ, "HOME": home})
            self.assertEqual(done.stderr, "")
            return [line.split("\t")[0] for line in done.stdout.splitlines()]

        for program in PROGRAMS:
            words, wanted = self.begun(program)
            self.assertIn(wanted, completed(program, words))
            if wanted == "--log-level":
                self.assertIn("debug", completed(program, words[:-1] + [wanted, "de"]))

    def test_zsh_completes(self):
        zsh = shutil.which("zsh")
        if zsh is None:
            self.skipTest("zsh is not installed")
        for program in PROGRAMS:
            words, wanted = self.begun(program)
            with tempfile.TemporaryDirectory() as folder:
                with open(os.path.join(folder, "_" + os.path.basename(program)), "w", encoding="utf-8") as file:
                    file.write(self.say(program, "--completion=zsh"))
                with Terminal([zsh, "-f", "-i"], {**os.environ, "TERM": "dumb", "HOME": folder}) as terminal:
                    # The echo of the line is not what it prints.
                    terminal.type("fpath=(%s $fpath); autoload -U compinit; compinit -u -D; PS1=rea'dy> '\n" % folder)
                    terminal.wait_for("ready> ")
                    terminal.type(" ".join(words) + "\t")
                    terminal.wait_for(wanted)
                    if wanted == "--log-level":
                        terminal.type("deb\t")
                        terminal.wait_for("debug")
