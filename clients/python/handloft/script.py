"""Runs a script (proto/SCRIPT.md) on a server: each line of JSON is answered by one line of JSON."""

import json
import math
import re

from google.protobuf import json_format

from handloft import fields, messages
from handloft.errors import HandloftError, Refused

MAX_LINE_BYTES = 256 << 20


def _json_of(message):
    return json_format.MessageToDict(message, including_default_value_fields=True)


def _refuse(code, field, message):
    raise Refused(code, field, message)


def _unique(pairs):
    members = dict(pairs)
    if len(members) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        _refuse("invalid_argument", twice, "found twice, expected once")
    return members


def _number(value):
    """Protobuf's JSON writes 64-bit numbers as texts; they count as numbers."""
    if isinstance(value, bool):
        return None
    if isinstance(value, (int, float)):
        return float(value)
    try:
        number = float(value) if isinstance(value, str) and value == value.strip() else math.nan
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _alike(found, expected, tolerance):
    if isinstance(expected, dict) and isinstance(found, dict):
        return found.keys() == expected.keys() and all(_alike(found[k], v, tolerance) for k, v in expected.items())
    if isinstance(expected, list) and isinstance(found, list):
        return len(found) == len(expected) and all(_alike(f, e, tolerance) for f, e in zip(found, expected))
    if isinstance(expected, (int, float)) and not isinstance(expected, bool):
        number = _number(found)
        return number is not None and abs(number - expected) <= tolerance
    return type(expected) is type(found) and expected == found


def _camel(name):
    return re.sub(r"_([a-z])", lambda match: match.group(1).upper(), name).replace("_", "")


def _find(whole, path):
    if not path:
        return whole
    steps = path[1:].split("/") if path.startswith("/") else path.split(".")
    at = whole
    for step in steps:
        if isinstance(at, list) and step.isascii() and step.isdigit() and int(step) < len(at):
            at = at[int(step)]
        elif isinstance(at, dict) and (step in at or _camel(step) in at):
            at = at[step] if step in at else at[_camel(step)]
        else:
            _refuse("failed_precondition", path, "found nothing there, expected a value")
    return at


def _integer(text):
    """The sign of a zero is one of a double; a whole number of Python has none."""
    return -0.0 if text == "-0" else int(text)


class Runner:
    def __init__(self, model):
        self.model = model
        self.remembered = {}
        self.clients = set()  # Who of the script has made steps.

    def result_of(self, line):
        """What the line's answer has as "result"; Refused and the like for "error"."""
        try:
            said = json.loads(line, object_pairs_hook=_unique, parse_int=_integer)
        except ValueError as problem:
            _refuse("invalid_argument", "", "found no well-formed JSON: %s" % problem)
        except RecursionError:
            _refuse("invalid_argument", "", "found too many levels")
        if not isinstance(said, dict):
            _refuse("invalid_argument", "", "found no object, expected one")
        for special in ("query", "expect"):
            if special in said:
                if len(said) > 1:
                    _refuse("invalid_argument", special, "found other members beside it, expected none")
                return self._ask(said["query"], "query") if special == "query" else self._expect(said["expect"])
        done = self._submit(said)
        result = {"sequence": done.sequence, "entities": done.entities}
        if done.notes:
            result["notes"] = done.notes
        return result

    def _submit(self, said):
        """To a server all lines are of one client, whose steps undo takes back."""
        operation = messages.operation_of(said)
        client, kind = operation.client_id, operation.WhichOneof("body")
        other = next((one for one in sorted(self.clients) if one != client), None)
        if kind in ("undo", "redo") and other is not None:
            found = "%s by client %d after steps by client %d" % ("an undo" if kind == "undo" else "a redo", client, other)
            _refuse("failed_precondition", "client_id",
                    "found %s, expected one client: a server takes all lines as one client's" % found)
        done = self.model.submit(operation)
        if done.sequence:
            self.clients.add(client)
        return done

    def _ask(self, query, field):
        if not isinstance(query, dict):
            _refuse("invalid_argument", field, "found no object, expected one")
        message = messages.Query()
        fields.fill(message, query, field)
        answer = self.model.ask(message)
        kind = message.WhichOneof("body") or ""
        return {_camel(kind): _json_of(answer)} if answer is not None else {}

    def _expect(self, wanted):
        if not isinstance(wanted, dict):
            _refuse("invalid_argument", "expect", "found no object, expected one")
        wanted = {_camel(name): value for name, value in wanted.items()}
        if "fails" in wanted:
            return self._expect_failure(wanted)
        known = {"query", "path", "equals", "near", "tolerance", "atMost", "atLeast", "count", "remember", "equalsRemembered"}
        if "query" not in wanted:
            _refuse("invalid_argument", "expect", 'found neither "query" nor "fails", expected one')
        for name in wanted:
            if name not in known:
                _refuse("invalid_argument", "expect." + name, 'found the unknown field "%s"' % name)
        if not wanted.keys() - {"query", "path", "tolerance"}:
            _refuse("invalid_argument", "expect", "found nothing to compare with")
        path = wanted.get("path", "")
        found = _find(self._ask(wanted["query"], "expect.query"), path)
        self._compare(found, wanted, path)
        if "remember" in wanted:
            self.remembered[wanted["remember"]] = found
        return found

    def _expect_failure(self, wanted):
        what = wanted["fails"]
        if not isinstance(what, dict):
            _refuse("invalid_argument", "expect.fails", "found no object, expected an operation or a query")
        try:
            if what.keys() == {"query"}:
                self._ask(what["query"], "expect.query")
            else:
                self._submit(what)
        except Refused as refusal:
            for name in ("code", "field"):
                if wanted.get(name, getattr(refusal, name)) != getattr(refusal, name):
                    found = "found %r, expected %r" % (getattr(refusal, name), wanted[name])
                    raise Refused("failed_precondition", "expect." + name, found) from refusal
            return {"code": refusal.code, "field": refusal.field, "message": refusal.message}
        return _refuse("failed_precondition", "expect.fails", "it succeeded, expected a failure")

    def _compare(self, found, wanted, path):
        def differs(expected):
            _refuse("failed_precondition", path, "found %s, expected %s" % (json.dumps(found)[:200], expected))

        def number(name):
            value = wanted[name]
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                _refuse("invalid_argument", "expect." + name, "found %r, expected a number" % (value,))
            return value

        if "equals" in wanted and not _alike(found, wanted["equals"], 0.0):
            differs(json.dumps(wanted["equals"]))
        if "near" in wanted:
            if "tolerance" not in wanted:
                _refuse("invalid_argument", "expect.tolerance", "found none, expected a number")
            if not _alike(found, wanted["near"], number("tolerance")):
                differs("%s within %s" % (json.dumps(wanted["near"]), wanted["tolerance"]))
        if "atMost" in wanted and not (_number(found) is not None and _number(found) <= number("atMost")):
            differs("at most %s" % wanted["atMost"])
        if "atLeast" in wanted and not (_number(found) is not None and _number(found) >= number("atLeast")):
            differs("at least %s" % wanted["atLeast"])
        if "count" in wanted and not (isinstance(found, list) and len(found) == number("count")):
            differs("a list of %s elements" % wanted["count"])
        if "equalsRemembered" in wanted:
            name = wanted["equalsRemembered"]
            if name not in self.remembered:
                _refuse("invalid_argument", "expect.equalsRemembered", "found %r, which no line has remembered" % (name,))
            if found != self.remembered[name]:
                differs("%s as remembered" % json.dumps(self.remembered[name])[:200])


def run(lines, out, model, keep_going=False):
    """lines: of bytes. Writes the answers; returns (line, words) of those that failed."""
    runner, failed = Runner(model), []
    for number, raw in enumerate(lines, 1):
        if number == 1 and raw.startswith(b"\xef\xbb\xbf"):
            raw = raw[3:]
        text = raw.strip(b" \t\r\n")
        if not text or text.startswith((b"#", b"//")):
            continue
        try:
            if len(raw) > MAX_LINE_BYTES:
                _refuse("resource_exhausted", "", "found a line of more than %d bytes" % MAX_LINE_BYTES)
            answer = {"line": number, "ok": True, "result": runner.result_of(text.decode("utf-8", "strict"))}
        except UnicodeDecodeError as problem:
            answer = _failure(number, "invalid_argument", "", "found no UTF-8: %s" % problem)
        except Refused as refusal:
            answer = _failure(number, refusal.code, refusal.field, refusal.message)
        except HandloftError as problem:
            answer = _failure(number, "io", "", str(problem))
        out.write(json.dumps(answer, separators=(",", ":"), ensure_ascii=False) + "\n")
        out.flush()
        if not answer["ok"]:
            error = answer["error"]
            failed.append((number, "%s: %s: %s" % (error["code"], error["field"], error["message"])))
            if not keep_going:
                break
    return failed


def _failure(number, code, field, message):
    return {"line": number, "ok": False, "error": {"code": code, "field": field, "message": message}}
