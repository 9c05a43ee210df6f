"""Makes a wheel of the package (PEP 517) with protoc and the standard library only, so that

    pip install ./clients/python

works without a network. The messages are generated from the repository's proto/ (or from the copy of it that an sdist
has) into handloft/_proto.

    python3 build_backend.py FOLDER     the same as a folder that can be put on PYTHONPATH
"""

import base64
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile

HERE = os.path.dirname(os.path.realpath(__file__))
SETTINGS = open(os.path.join(HERE, "pyproject.toml"), encoding="utf-8").read()


def _setting(key):
    return re.search(r'^%s = "(.*)"$' % re.escape(key), SETTINGS, re.MULTILINE).group(1)


NAME, VERSION = _setting("name"), _setting("version")
DEPENDENCIES = re.findall(r'"([^"]+)"', re.search(r"^dependencies = \[(.*)\]$", SETTINGS, re.MULTILINE).group(1))
METADATA = (
    "Metadata-Version: 2.1\nName: %s\nVersion: %s\nSummary: %s\nRequires-Python: %s\n"
    % (NAME, VERSION, _setting("description"), _setting("requires-python"))
    + "".join("Requires-Dist: %s\n" % one for one in DEPENDENCIES)
)
ENTRY_POINTS = "[console_scripts]\nhandloft-script = handloft.__main__:main\n"


def _proto_folder():
    for folder in (os.path.join(HERE, "proto"), os.path.join(HERE, "..", "..", "proto")):
        if os.path.exists(os.path.join(folder, "session.proto")):
            return os.path.realpath(folder)
    raise RuntimeError("proto/session.proto is neither here nor two folders up: build from a checkout")


def _messages():
    """The .proto files that session.proto needs."""
    folder, wanted, found = _proto_folder(), ["session.proto"], []
    while wanted:
        name = wanted.pop()
        if name in found:
            continue
        found.append(name)
        with open(os.path.join(folder, name), encoding="utf-8") as text:
            wanted += re.findall(r'^import "proto/(.+)";', text.read(), re.MULTILINE)
    return sorted(found)


def make_tree(folder):
    """The package, messages and all, as folder/handloft."""
    package = os.path.join(folder, "handloft")
    shutil.copytree(
        os.path.join(HERE, "handloft"), package, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__", "_proto")
    )
    generated = os.path.join(package, "_proto")
    os.makedirs(generated, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        names = _messages()
        subprocess.run(
            ["protoc", "--python_out", scratch, "-I", os.path.dirname(_proto_folder())]
            + ["proto/" + name for name in names],
            check=True,
            cwd=os.path.dirname(_proto_folder()),
        )
        for name in names:
            module = name[: -len(".proto")] + "_pb2.py"
            with open(os.path.join(scratch, "proto", module), encoding="utf-8") as text:
                # Others have packages called "proto", too.
                code = re.sub(r"^from proto import", "from handloft._proto import", text.read(), flags=re.MULTILINE)
            with open(os.path.join(generated, module), "w", encoding="utf-8") as out:
                out.write(code)
    with open(os.path.join(generated, "__init__.py"), "w", encoding="utf-8") as out:
        out.write('"""Generated from proto/ by build_backend.py."""\n')


def _files(folder):
    for path, folders, names in sorted(os.walk(folder)):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for name in sorted(names):
            full = os.path.join(path, name)
            with open(full, "rb") as file:
                yield os.path.relpath(full, folder), file.read()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = "%s-%s-py3-none-any.whl" % (NAME, VERSION)
    facts = "%s-%s.dist-info" % (NAME, VERSION)
    wheel = "Wheel-Version: 1.0\nGenerator: handloft\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    with tempfile.TemporaryDirectory() as scratch:
        make_tree(scratch)
        files = list(_files(scratch))
    files += [
        (facts + "/METADATA", METADATA.encode()),
        (facts + "/WHEEL", wheel.encode()),
        (facts + "/entry_points.txt", ENTRY_POINTS.encode()),
    ]
    record = ""
    for path, content in files:
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += "%s,sha256=%s,%d\n" % (path, digest, len(content))
    record += "%s/RECORD,,\n" % facts
    files.append((facts + "/RECORD", record.encode()))
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in files:
            # A fixed time: the same sources give the same wheel.
            archive.writestr(zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0)), content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    base = "%s-%s" % (NAME, VERSION)
    content = [("PKG-INFO", METADATA.encode())]
    for name in ("pyproject.toml", "build_backend.py", "README.md"):
        with open(os.path.join(HERE, name), "rb") as file:
            content.append((name, file.read()))
    for name in _messages():
        with open(os.path.join(_proto_folder(), name), "rb") as file:
            content.append(("proto/" + name, file.read()))
    content += [("handloft/" + path, data) for path, data in _files(os.path.join(HERE, "handloft")) if "_proto" not in path]
    with tarfile.open(os.path.join(sdist_directory, base + ".tar.gz"), "w:gz") as archive:
        for path, data in content:
            entry = tarfile.TarInfo(base + "/" + path)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return base + ".tar.gz"


if __name__ == "__main__":
    make_tree(sys.argv[1])
