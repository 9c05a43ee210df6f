"""Where a server listens: "unix:PATH", "tcp:HOST:PORT", "tls:HOST:PORT" (proto/PROTOCOL.md, "Endpoints")."""

import json
import os
import re
import socket
import ssl

from handloft.errors import ConnectionLost, HandloftError

# What every server's certificate is for, whatever its host is called.
TLS_SERVER_NAME = "modeld.handloft.invalid"
MAX_UNIX_PATH_BYTES = 107
# In the folder of a server that this device was paired with (common/net/paired_server.h).
AUTHORITY, CERTIFICATE, KEY, FACTS = "authority.pem", "certificate.pem", "key.pem", "server.json"


def default_endpoint():
    """The model socket of this user."""
    folder = os.environ.get("XDG_RUNTIME_DIR")
    folder = os.path.join(folder, "handloft") if folder else "/tmp/handloft-%d" % os.getuid()
    return "unix:" + os.path.join(folder, "model.sock")


def parse(text):
    """("unix", path) or ("tcp" | "tls", (host, port))."""
    kind, _, rest = text.partition(":")
    if kind == "unix" and rest:
        if len(os.fsencode(rest)) > MAX_UNIX_PATH_BYTES:
            raise ValueError("endpoint: a socket's path has at most %d bytes: %r" % (MAX_UNIX_PATH_BYTES, text))
        return kind, rest
    match = re.fullmatch(r"(?:\[([^\]]+)\]|([^:\[\]]+)):([0-9]{1,5})", rest) if kind in ("tcp", "tls") else None
    if not match or int(match.group(3)) > 65535:
        raise ValueError('endpoint: found %r, expected "unix:PATH", "tcp:HOST:PORT" or "tls:HOST:PORT"' % text)
    return kind, (match.group(1) or match.group(2), int(match.group(3)))


def paired_folder(endpoint):
    """The folder of the paired server that was last found at this endpoint, or of the only one there is."""
    config = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    servers = os.path.join(config, "handloft", "servers")
    names = sorted(os.listdir(servers)) if os.path.isdir(servers) else []
    folders = [os.path.join(servers, name) for name in names if os.path.exists(os.path.join(servers, name, FACTS))]
    for folder in folders:
        try:
            with open(os.path.join(folder, FACTS), encoding="utf-8") as file:
                if json.load(file).get("endpoint") == endpoint:
                    return folder
        except (OSError, ValueError, AttributeError):
            continue
    if len(folders) == 1:
        return folders[0]
    raise HandloftError("credentials: this device was not paired with %s: ask its owner for a code" % endpoint)


def tls_context(folder):
    """TLS 1.3 as a paired device: the server must show a certificate of the one authority, we show ours."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_verify_locations(os.path.join(folder, AUTHORITY))
        context.load_cert_chain(os.path.join(folder, CERTIFICATE), os.path.join(folder, KEY))
    except (OSError, ssl.SSLError) as problem:
        raise HandloftError("credentials: %s: %s" % (folder, problem)) from problem
    return context


def open_socket(endpoint, timeout, credentials=None):
    """A connected socket with this timeout on it."""
    kind, address = parse(endpoint)
    context = tls_context(credentials or paired_folder(endpoint)) if kind == "tls" else None
    try:
        if kind == "unix":
            plain = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                plain.settimeout(timeout)
                plain.connect(address)
            except BaseException:
                plain.close()
                raise
            return plain
        plain = socket.create_connection(address, timeout)
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if context is None:
            return plain
        try:
            return context.wrap_socket(plain, server_hostname=TLS_SERVER_NAME)
        except BaseException:
            plain.close()
            raise
    except OSError as problem:  # ssl.SSLError is one, too
        raise ConnectionLost("%s: %s" % (endpoint, problem)) from problem
