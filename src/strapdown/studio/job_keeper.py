"""Runs the command of a job, keeps the last of what it prints, and writes how it ended.

A program of its own, started by path with only the standard library: it lives on when the
server of the studio ends, and a server that is started again reads what it wrote.

Arguments: file of the output, file of the end, and the words of the command.
"""

import json
import os
import signal
import subprocess
import sys

#: Bytes of output that are kept twice: in the file, and in the one before it.
MOST = 1 << 20


def keep(output: str, end: str, command: list[str]) -> None:
    """Run the command to its end."""
    # An interrupt is for the command; this process says how that ended.
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    code = -1
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            preexec_fn=_listen_again if os.name == "posix" else None,
        )
        assert process.stdout is not None
        stream = open(output, "ab", buffering=0)  # noqa: SIM115, PTH123
        while part := os.read(process.stdout.fileno(), 1 << 16):
            if stream.tell() + len(part) > MOST:
                stream.close()
                os.replace(output, output + ".before")  # noqa: PTH105
                stream = open(output, "ab", buffering=0)  # noqa: SIM115, PTH123
            stream.write(part)
        code = process.wait()
    finally:
        with open(end + ".partial", "w") as told:  # noqa: PTH123
            json.dump({"code": code}, told)
        os.replace(end + ".partial", end)  # noqa: PTH105


def _listen_again() -> None:
    """Give the command the usual answers to signals: ignored ones are inherited."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        signal.signal(getattr(signal, name), signal.SIG_DFL)


if __name__ == "__main__":
    keep(sys.argv[1], sys.argv[2], sys.argv[3:])
