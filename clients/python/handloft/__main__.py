"""python3 -m handloft run FILE|-: runs a script on a server."""

import argparse
import sys

import handloft
from handloft import script


def main(words=None):
    parser = argparse.ArgumentParser(prog="handloft", description="Drives a Handloft model server.")
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="run a script of operations, queries and expectations (proto/SCRIPT.md)")
    run.add_argument("script", metavar="FILE", help="the script, or - for standard input")
    run.add_argument("--connect", metavar="ENDPOINT", help="unix:PATH, tcp:HOST:PORT or tls:HOST:PORT; none: your own server")
    run.add_argument("--model", default="", help="which of the server's models; none: its first")
    run.add_argument("--credentials", metavar="FOLDER", help="of the paired server, for tls:")
    run.add_argument("--timeout", type=float, default=60.0, metavar="SECONDS", help="for each answer (default: 60)")
    run.add_argument("--keep-going", action="store_true", help="go on after a failed line; the exit status is 1 all the same")
    given = parser.parse_args(words)
    try:
        lines = sys.stdin.buffer if given.script == "-" else open(given.script, "rb")
        with lines, handloft.connect(
            given.connect, model=given.model, credentials=given.credentials, timeout=given.timeout
        ) as model:
            failed = script.run(lines, sys.stdout, model, keep_going=given.keep_going)
    except (OSError, ValueError, handloft.HandloftError) as problem:
        print("handloft run: %s" % problem, file=sys.stderr)
        return 2
    for number, words_of in failed[:1]:
        print("handloft run: line %d: %s" % (number, words_of), file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
