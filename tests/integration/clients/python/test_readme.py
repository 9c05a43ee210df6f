"""Every example of clients/python/README.md, in order, as a reader would try it: installed by pip, on a real server."""

import os
import re
import subprocess
import sys
import unittest

from support import PATIENCE, SOURCES, ServerTest


class Readme(ServerTest):
    def test_every_example_runs(self):
        with open(os.path.join(SOURCES, "clients", "python", "README.md"), encoding="utf-8") as page:
            text = page.read()
        examples = re.findall(r"^```(sh|python)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        self.assertEqual(text.count("```"), 2 * len(examples), "an example of another kind is not run")
        self.assertGreaterEqual(len(examples), 7)
        os.makedirs(os.path.join(self.folder, "run", "handloft"), mode=0o700)
        os.symlink(os.path.join(SOURCES, "clients"), os.path.join(self.folder, "clients"))
        self.serve(endpoint="unix:" + os.path.join(self.folder, "run", "handloft", "model.sock"))
        venv = os.path.join(self.folder, "venv", "bin")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        environment["XDG_RUNTIME_DIR"] = os.path.join(self.folder, "run")
        # The interpreter that this test has, until the examples have made their own.
        tools = os.path.join(self.folder, "tools")
        os.makedirs(tools)
        os.symlink(sys.executable, os.path.join(tools, "python3"))
        environment["PATH"] = os.pathsep.join((venv, tools, environment["PATH"]))
        environment["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
        for kind, code in examples:
            words = ["bash", "-euc", code] if kind == "sh" else [os.path.join(venv, "python3"), "-c", code]
            if kind == "python":
                words[2] = "import handloft\n" + code
            done = subprocess.run(words, cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  timeout=4 * PATIENCE, text=True)
            self.assertEqual(done.returncode, 0, "%s\n%s" % (code, done.stdout))
        self.assertTrue(os.path.exists(os.path.join(self.folder, "top.step")))


if __name__ == "__main__":
    unittest.main()
