"""The process that runs what students wrote: it holds no solution, no hidden test, and little of the machine.

`judge.py` starts one, which runs the set-up of the assignment once and then forks a child for each reading of a
notebook. A child gives up its rights first (`confine`), runs cells, and calls functions on inputs that come down a
socket. What goes back is plain data (`encode`): numbers, text, arrays, sparse matrices, and lists of them.
"""

from __future__ import annotations

import base64
import builtins
import contextlib
import ctypes
import io
import json
import os
import pickle
import resource
import signal
import socket
import struct
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

import spectral_notes
from spectral_notes.checking.answers import is_stub

LARGEST = 64 * 2**20  # bytes of an answer
MEMORY = 2 * 2**30  # bytes above what the process starts with
CPU_SECONDS = 600
REFUSED = frozenset(
    {"os.exec", "os.fork", "os.forkpty", "os.kill", "os.killpg", "os.posix_spawn", "os.spawn", "os.system"}
    | {"pty.spawn", "socket.bind", "socket.connect", "socket.sendto", "subprocess.Popen"}
)
READING = frozenset(
    {"open", "os.listdir", "os.scandir", "os.chdir", "os.rename", "os.remove", "os.rmdir", "os.link", "os.symlink"}
)


# --- messages -------------------------------------------------------------------------------------------------------


def send(connection: socket.socket, message: bytes) -> None:
    """Send a message with its length before it."""
    connection.sendall(struct.pack("!Q", len(message)) + message)


def receive(connection: socket.socket) -> bytes:
    """Return the next message; EOFError when there is none, ValueError when it is too long."""
    (length,) = struct.unpack("!Q", _exactly(connection, 8))
    if length > 2 * LARGEST:
        raise ValueError(f"a message of {length} bytes")
    return _exactly(connection, length)


def _exactly(connection: socket.socket, length: int) -> bytes:
    """Return the next bytes."""
    parts = []
    while length:
        part = connection.recv(min(length, 2**20))
        if not part:
            raise EOFError("the other process ended")
        parts.append(part)
        length -= len(part)
    return b"".join(parts)


def encode(value: Any, depth: int = 0) -> Any:
    """Return a value as JSON holds it; what is no plain data becomes the name of its type."""
    if value is None or isinstance(value, bool | str) or type(value) in (int, float):
        return value
    if value is Ellipsis or value is NotImplemented:
        return {"dots": True}
    if isinstance(value, complex | np.generic):
        value = np.asarray(value)
    if sp.issparse(value):
        entries = sp.coo_array(value)
        parts = [encode(np.asarray(part)) for part in (entries.data, entries.row, entries.col)]
        return {"sparse": parts, "shape": [int(n) for n in entries.shape]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufcUS":
        if value.nbytes > LARGEST // 2:
            return {"other": f"array of {value.nbytes} bytes"}
        file = io.BytesIO()
        np.lib.format.write_array(file, np.asarray(value), allow_pickle=False)
        return {"array": base64.b64encode(file.getvalue()).decode()}
    if isinstance(value, np.ndarray):
        value = list(value) if value.ndim else value.item()
        return encode(value, depth + 1) if depth < 4 else {"other": "ndarray"}
    if isinstance(value, list | tuple) and depth < 4:
        return {"list" if type(value) is list else "tuple": [encode(x, depth + 1) for x in value]}
    if isinstance(value, int | float):  # a subclass
        return encode(np.asarray(value))
    return {"other": type(value).__name__}


class Unreadable:
    """What an answer was that is no plain data."""

    def __init__(self, name: str) -> None:
        self.name = name


def decode(value: Any) -> Any:
    """Return what `encode` was given."""
    if not isinstance(value, dict):
        return value
    (kind, content), *_ = value.items()
    if kind == "dots":
        return Ellipsis
    if kind == "array":
        return np.lib.format.read_array(io.BytesIO(base64.b64decode(content)), allow_pickle=False)
    if kind == "sparse":
        data, row, col = map(decode, content)
        return sp.coo_array((data, (row, col)), shape=tuple(value["shape"])).tocsr()
    if kind in ("list", "tuple"):
        return [*map(decode, content)] if kind == "list" else tuple(map(decode, content))
    return Unreadable(str(content))


# --- giving up rights -----------------------------------------------------------------------------------------------


def confine(scratch: Path) -> None:
    """Limit memory, time and files, and close the rest of the machine, as far as the system lets a process do it."""
    os.setsid()
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    if pages:  # elsewhere than on Linux the limit of memory is the machine's
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**24, 2**24))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(scratch)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    system = ["/usr", "/lib", "/lib64", "/etc", "/dev", "/sys/devices", "/proc/cpuinfo", "/proc/meminfo"]
    python = [sys.prefix, sys.base_prefix, *(path for path in sys.path if "site-packages" in path)]
    readable = [*system, *python, f"/proc/{os.getpid()}", os.path.dirname(spectral_notes.__file__)]
    places = [os.path.realpath(place) for place in readable if os.path.exists(place)]
    landlock(places, os.path.realpath(scratch))
    watch([*places, os.path.realpath(scratch)])


def landlock_version() -> int:
    """Return the version of Landlock that the kernel has (Linux 5.13 or later); 0 for none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(0, ctypes.CDLL(None).syscall(444, None, ctypes.c_size_t(0), 1))


def landlock(readable: list[str], writable: str) -> bool:
    """Let the kernel refuse every other file, program, connection and signal; say if it does."""
    version = landlock_version()
    if not version:
        return False
    libc = ctypes.CDLL(None)
    files = (1 << (13 + (version >= 2) + (version >= 3) + (version >= 5))) - 1
    rules = struct.pack("=QQQ", files, 3 if version >= 4 else 0, 3 if version >= 6 else 0)
    size = 8 if version < 4 else 16 if version < 6 else 24
    ruleset = libc.syscall(444, rules, ctypes.c_size_t(size), 0)
    for place in [*readable, "/dev/null", writable]:
        handle = os.open(place, os.O_PATH)
        allowed = files if place == writable else 1 << 2 | 1 << 3  # read a file, list a folder; no program starts
        if place == "/dev/null":
            allowed = 1 << 1 | 1 << 2
        elif not os.path.isdir(place):
            allowed &= ~(1 << 3)
        libc.syscall(445, ruleset, 1, struct.pack("=Qi", allowed, handle), 0)
        os.close(handle)
    libc.prctl(38, 1, 0, 0, 0)  # no new privileges, which the next call asks for
    return libc.syscall(446, ruleset, 0) == 0


def watch(places: list[str]) -> None:
    """Refuse the same in Python, for systems whose kernel does not."""
    inside = tuple(places)

    def refuse(event: str, arguments: tuple[Any, ...]) -> None:
        if event in REFUSED:
            raise PermissionError(f"{event} is refused while work is marked")
        if event in READING and isinstance(arguments[0], str | bytes):
            path = os.path.realpath(os.fsdecode(arguments[0]))
            if not any(path == place or path.startswith(place + os.sep) for place in inside):
                raise PermissionError(f"this file is refused while work is marked: {os.path.basename(path)}")

    sys.addaudithook(refuse)


# --- running cells and calling functions ----------------------------------------------------------------------------


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after some seconds."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"no end after {seconds:g} seconds")

    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


class Magic:
    """What stands for IPython where a cell uses a magic command: nothing happens."""

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_, **__: None


def run(source: str, names: dict[str, Any], seconds: float) -> str:
    """Run a cell and return what it raised, '' for nothing."""
    from IPython.core.inputtransformer2 import TransformerManager

    try:
        code = compile(TransformerManager().transform_cell(source), "cell", "exec")
        with time_limit(seconds):
            exec(code, names)
    except BaseException as error:  # SystemExit and KeyboardInterrupt too
        return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return ""


@contextlib.contextmanager
def without(modules: list[str]) -> Iterator[None]:
    """Refuse every call into the given modules."""

    def look(frame: Any, event: str, _: object) -> None:
        name = frame.f_globals.get("__name__") or ""
        if event == "call" and any(name == module or name.startswith(module + ".") for module in modules):
            sys.setprofile(None)
            raise PermissionError(f"it calls {name}, which this question does without")

    sys.setprofile(look if modules else None)
    try:
        yield
    finally:
        sys.setprofile(None)


def answer(names: dict[str, Any], job: dict[str, Any]) -> dict[str, Any]:
    """Call a function of the notebook and return what came of it."""
    function = names.get(job["call"])
    if not callable(function):
        return {"missing": True}
    try:
        with time_limit(job["seconds"]), np.errstate(all="ignore"), without(job["without"]):
            value = function(*job["inputs"])
        return {"value": encode(value), "stub": is_stub(function)}
    except BaseException as error:
        own = error.__traceback__ and error.__traceback__.tb_next and error.__traceback__.tb_next.tb_next is None
        stub = isinstance(error, NotImplementedError) and bool(own) and not str(error)
        return {"raised": [type(error).__name__, " ".join(str(error).split())[:200]], "stub": stub}


def serve(connection: socket.socket, names: dict[str, Any]) -> None:
    """Run the cells of a notebook, then answer calls until the other side hangs up."""
    first = pickle.loads(receive(connection))
    confine(Path(first["scratch"]))

    def ask(name: str) -> Callable[..., Any]:
        def asked(*inputs: Any) -> Any:
            send(connection, json.dumps({"ask": name, "inputs": encode(tuple(inputs))}).encode())
            return pickle.loads(receive(connection))

        return asked

    faults = [run(source, names, first["seconds"]) for source in first["cells"]]
    names.update({name: ask(name) for name in first["reference"]})
    send(connection, json.dumps({"faults": faults}).encode())
    while True:
        send(connection, json.dumps(answer(names, pickle.loads(receive(connection)))).encode())


def main() -> None:
    """Run the set-up of an assignment, then fork a child for each connection that comes."""
    socket_to_judge = socket.socket(fileno=int(sys.argv[1]))
    names: dict[str, Any] = {"__name__": "__main__", "get_ipython": Magic, "display": lambda *_, **__: None}
    builtins.input = lambda *_: (_ for _ in ()).throw(EOFError("nobody answers while work is marked"))  # type: ignore[assignment]
    fault = run(receive(socket_to_judge).decode(), names, 300)
    send(socket_to_judge, fault.encode())
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    while True:
        data, handles, *_ = socket.recv_fds(socket_to_judge, 1, 1)
        if not data:
            return
        child = os.fork()
        if not child:
            socket_to_judge.close()
            with contextlib.suppress(EOFError, OSError):
                serve(socket.socket(fileno=handles[0]), names)
            os._exit(0)
        os.close(handles[0])
        send(socket_to_judge, struct.pack("!Q", child))


if __name__ == "__main__":
    main()
