"""What can go wrong. All of it is a HandloftError."""


class HandloftError(Exception):
    """Anything that this package raises on purpose."""


class _WithWords(HandloftError):
    def __init__(self, code, field, message):
        super().__init__("%s: %s%s" % (code, field + ": " if field else "", message))
        self.code, self.field, self.message = code, field, message


class Refused(_WithWords):
    """The server says no, and nothing has changed.

    code: for programs ("not_found", "invalid_argument", ...; proto/PROTOCOL.md lists them).
    field: which field it is about, as "add_points.points[3].pressure"; may be empty.
    message: for people: what was found, what was expected.
    """


class ConnectionLost(HandloftError):
    """The connection could not be made, or has ended. What was asked meanwhile may or may not have been done."""


class ServerClosed(_WithWords, ConnectionLost):
    """The server has ended the connection and said why: code, field and message as of Refused."""


class NotAdmitted(Refused, ServerClosed):
    """The server does not take this client in: it has no such model, or not with this role, pairing or version.

    connect() and what joins raise it. A refusal: nothing has changed. By the protocol the connection ends with it.
    """


class Timeout(HandloftError):
    """No answer within the time. What was asked may still be done."""


class ProtocolError(ConnectionLost):
    """The other side does not speak the protocol; the connection is closed."""
