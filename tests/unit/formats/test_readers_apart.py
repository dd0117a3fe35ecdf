"""Files that a library parses are read in a process of their own, which may die."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import signal
import sqlite3
import struct
import subprocess
import sys
import textwrap
import threading
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from tests.coded import coded
from tests.fuzz import readers as fuzz

from strapdown.errors import DataError, Finding
from strapdown.formats import (
    TABLE,
    files_of,
    open_stream,
    read_raw,
    reader_of,
    sensor_folder,
    toolboxes,
)
from strapdown.formats import hdf5 as hdf5_files
from strapdown.formats.aid_table import read_control_points
from strapdown.parsers import in_place, parse, process, start_for, wire
from strapdown.parsers.limits import declared_most

ZOO = ("garmin_fit/garmin-fr935-cr.fit", "novatel_span/ins2.bag", "xio/short_walk.csv")
posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")
linux = pytest.mark.skipif(sys.platform != "linux", reason="/proc, limits of Linux")


@pytest.fixture
def log(tmp_path):
    """An HDF5 file that is in order."""
    return hdf5(tmp_path / "log.h5", fuzz.signals())


def hdf5(path, arrays):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
    return path


@pytest.fixture
def fifo(tmp_path):
    """A file whose parsing does not end: opening it waits for somebody who writes."""
    path = tmp_path / "track.gpx"
    os.mkfifo(path)
    return path


def running():
    """The process that parses, started if there is none."""
    process.start()
    assert process._process is not None
    return process._process


def ended(pid, within=5.0):
    """Whether a process is gone, or is but waited for, after a while."""
    end = time.monotonic() + within
    while time.monotonic() < end:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except FileNotFoundError:
            return True
        if state == "Z":
            return True
        time.sleep(0.02)
    return False


def script(text, *arguments, **how):
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(text), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        **how,
    )


# --- what dies there --------------------------------------------------------------------


def with_complex_flag(path):
    """A MATLAB file of which one variable is said to be complex, and is not."""
    savemat(path, fuzz.signals(), oned_as="column")
    data = bytearray(path.read_bytes())
    # Header of 128 bytes, tag of the variable, tag of its flags; class, then the flags.
    assert struct.unpack_from("<II", data, 136) == (6, 8)
    data[145] |= 0x08
    path.write_bytes(data)
    return path


@posix
def test_a_file_that_ends_the_library_by_a_signal_is_an_error_that_names_it(tmp_path, log):
    path = with_complex_flag(tmp_path / "one.mat")
    with pytest.raises(DataError, check=coded("io.parser-crashed", signal="SIGSEGV")) as caught:
        read_raw(path)
    assert caught.value.finding.file == "one.mat" and "CSV" in str(caught.value.finding.remedy)
    process._forget()
    with pytest.raises(DataError, check=coded("io.parser-crashed", signal="SIGSEGV")):
        read_raw(path)
    assert process._process is None  # it is known, and not tried again
    savemat(path, fuzz.signals(), oned_as="column")
    assert read_raw(path).columns["time_s"].size == 60
    assert read_raw(log).columns["time_s"].size == 60


@posix
@pytest.mark.parametrize(("number", "code"), [(9, "io.parser-killed"), (6, "io.parser-crashed")])
def test_the_next_file_is_read_after_a_kill_in_the_middle(log, fifo, number, code):
    pid = running().pid
    killer = threading.Timer(0.5, os.kill, (pid, number))
    killer.start()
    with pytest.raises(DataError, check=coded(code)) as caught:
        read_gpx(fifo)
    assert caught.value.finding.file == "track.gpx"
    assert read_raw(log).columns["time_s"].size == 60
    assert process._process.pid != pid


def read_gpx(path):
    return parse("recorders.gpx", path)


@posix
def test_what_comes_on_its_input_while_it_parses_does_not_end_it(log, fifo):
    """A signal that tells of it, or of the request itself when that comes late."""
    pid = running().pid

    def more():
        process._process.stdin.write(b" ")  # of the next request
        with Path(fifo).open("w", encoding="utf-8") as file:
            file.write('<gpx version="1.1"></gpx>')

    soon = threading.Timer(0.3, more)
    soon.start()
    with contextlib.suppress(DataError):  # no point is in it
        read_gpx(fifo)
    soon.join()
    assert process._process.pid == pid
    assert read_raw(log).columns["time_s"].size == 60
    assert process._process.pid == pid


@posix
def test_one_that_was_ended_while_it_was_idle_is_replaced_in_silence(log):
    running().kill()
    time.sleep(0.1)
    assert read_raw(log).columns["time_s"].size == 60


def zeros(path, count, **how):
    with h5py.File(path, "w") as file:
        how = {"chunks": (1 << 20,), "compression": "gzip"} | how
        file.create_dataset("time", shape=(count,), dtype="f8", **how)[:] = 0.0
    return path


@linux
def test_memory_is_limited(tmp_path, log):
    path = zeros(tmp_path / "zeros.h5", 20_000_000)
    assert parse("hdf5.arrays", path)["arrays"]["time"].size == 20_000_000
    with pytest.raises(DataError, check=coded("io.parser-out-of-memory", memory=100.0)):
        parse("hdf5.arrays", path, memory=100 << 20)
    assert read_raw(log).columns["time_s"].size == 60


@posix
def test_time_on_a_clock_is_limited(fifo, log, monkeypatch):
    monkeypatch.setattr(process, "PATIENCE", 0.1)
    begun = time.monotonic()
    with pytest.raises(DataError, check=coded("io.parser-out-of-time", seconds=10.0)):
        read_gpx(fifo)
    assert time.monotonic() - begun < process.LATE  # by its own clock
    assert read_raw(log).columns["time_s"].size == 60


@posix
def test_one_that_cannot_end_itself_is_ended_from_outside(fifo, monkeypatch):
    monkeypatch.setattr(process, "PATIENCE", 0.05)
    monkeypatch.setattr(process, "LATE", 0.3)
    os.kill(running().pid, signal.SIGSTOP)
    with pytest.raises(DataError, check=coded("io.parser-out-of-time")):
        read_gpx(fifo)


@posix
def test_processor_time_is_limited(tmp_path, monkeypatch):
    """A table of many texts, which costs some seconds to take apart."""
    monkeypatch.setattr(process, "seconds_most", lambda size: 0.0)
    path = tmp_path / "track.gpx"
    point = '<trkpt lat="1" lon="2"><time>2024-01-01T00:00:00Z</time></trkpt>'
    path.write_text(f'<gpx version="1.1"><trk><trkseg>{point * 60_000}</trkseg></trk></gpx>')
    monkeypatch.setattr(process, "PATIENCE", 0.0)  # no alarm: the limit of the processor alone
    monkeypatch.setattr(process, "LATE", 60.0)
    with pytest.raises(DataError, check=coded("io.parser-out-of-time")):
        read_gpx(path)


def test_an_interrupt_ends_what_was_asked(log, fifo, monkeypatch):
    before = running().pid

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(wire, "decode", interrupted)
        read_gpx(fifo)
    assert read_raw(log).columns["time_s"].size == 60
    assert process._process.pid != before


def test_without_a_python_to_start_it_says_so(log, monkeypatch):
    process._forget()
    monkeypatch.setattr(sys, "executable", "")
    with pytest.raises(DataError, check=coded("io.parser-not-started")):
        read_raw(log)


@posix
def test_it_writes_nothing(tmp_path):
    """Neither a new file, nor into one, nor away with one."""
    there = tmp_path / "there"
    there.write_text("kept")
    done = script(
        """
        import os, sys
        from strapdown.parsers import worker
        worker._lock()
        there = sys.argv[1]
        acts = [
            lambda: open(there, "a").write("more"),
            lambda: open(there + "2", "w").write("a"),
            lambda: os.remove(there),
        ]
        for act in acts:
            try:
                act()
                print("done")
            except OSError as error:
                print(type(error).__name__)
        """,
        there,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "there2").exists() is False or (tmp_path / "there2").read_text() == ""
    if sys.platform == "linux" and landlocked():
        assert done.stdout.split() == ["PermissionError"] * 3
        assert there.read_text() == "kept"


def landlocked():
    import ctypes

    return ctypes.CDLL(None).syscall(444, None, ctypes.c_size_t(0), ctypes.c_uint(1)) > 0


# --- when it is started, and when it ends -----------------------------------------------


def test_a_text_table_needs_none(tmp_path, monkeypatch):
    process._forget()
    started = []
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(a))
    held = fuzz.signals()
    path = tmp_path / "log.csv"
    pd.DataFrame(held).to_csv(path, index=False)
    assert read_raw(path).columns["time_s"].size == 60
    start_for(["attitude", "log.csv", "--out", "zip"])
    assert not started
    start_for(["attitude", "LOG.H5"])
    assert started


def test_the_only_file_of_a_command_is_read_beside_the_imports(tmp_path, log, monkeypatch):
    """Asked for once; another file that is asked for in between gets its own answer."""
    path = tmp_path / "log.parquet"
    pd.DataFrame({"time_s": np.arange(90.0), "gyro_x": np.arange(90.0)}).to_parquet(path)
    lines, asked = [], process._asked

    def noted(line, label):
        lines.append(line)
        return asked(line, label)

    monkeypatch.setattr(process, "_asked", noted)
    process._forget()
    start_for(["allan", str(path), "--out", "of-log"])
    assert len(lines) == 1
    begun = running().pid
    for _ in range(2):
        assert read_raw(path).columns["time_s"].size == 90
    assert running().pid == begun
    assert len(lines) == 2
    start_for(["allan", str(path)])
    assert read_raw(log).columns["time_s"].size == 60
    assert read_raw(path).columns["time_s"].size == 90
    lines.clear()
    for names in ([str(path), str(log)], [str(log)], [str(tmp_path / "missing.parquet")]):
        start_for(["allan", *names])
    assert not lines


@linux
def test_none_is_left_when_its_caller_is_killed(tmp_path, log, fifo):
    """Neither an idle one nor one that parses."""
    text = """
        import sys
        from pathlib import Path
        from strapdown.formats import read_raw
        from strapdown.parsers import parse, process
        read_raw(sys.argv[1])
        print(process._process.pid, flush=True)
        parse("recorders.gpx", Path(sys.argv[2])) if len(sys.argv) > 2 else sys.stdin.read()
    """
    for more in ([], [str(fifo)]):
        caller = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(text), str(log), *more],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        pid = int(caller.stdout.readline())
        time.sleep(0.3)
        assert Path(f"/proc/{pid}").exists()
        caller.kill()
        caller.wait()
        assert ended(pid)
        caller.stdin.close()
        caller.stdout.close()


def test_a_script_without_a_guard_reads(tmp_path, log):
    path = tmp_path / "script.py"
    path.write_text(
        "import sys\nfrom strapdown.formats import read_raw\n"
        "print('begun', read_raw(sys.argv[1]).columns['time_s'].size)\n"
    )
    done = subprocess.run(
        [sys.executable, str(path), str(log)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (0, "begun 60\n"), done.stderr


def test_threads_take_turns(tmp_path):
    paths = [hdf5(tmp_path / f"{k}.h5", fuzz.signals(60 + k)) for k in range(12)]
    with ThreadPoolExecutor(6) as pool:
        counts = list(pool.map(lambda p: read_raw(p).columns["time_s"].size, paths))
    assert counts == [60 + k for k in range(12)]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_after_a_fork_both_read(log):
    read_raw(log)
    mine, pipe = process._process.pid, process._process.stdin.fileno()
    asks, done = threading.Event(), threading.Event()

    def ask():
        with process._lock:
            asks.set()
            done.wait(30)

    other = threading.Thread(target=ask)
    other.start()
    asks.wait()
    child = os.fork()
    if not child:
        signal.alarm(20)
        try:
            with contextlib.suppress(OSError):
                os.fstat(pipe)
                os._exit(3)  # it would keep the other process alive
            same = read_raw(log).columns["time_s"].size == 60 and process._process.pid != mine
            process._forget()
            os._exit(0 if same else 1)
        finally:
            os._exit(2)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    done.set()
    other.join()
    assert code == 0
    assert read_raw(log).columns["time_s"].size == 60
    assert process._process.pid == mine


@pytest.mark.parametrize("name", ["a 'b' \"c\".h5", "line\nbreak.h5", "ünï€.h5", "-c.h5"])
def test_any_name_of_a_file(tmp_path, name):
    path = hdf5(tmp_path / name, fuzz.signals())
    assert read_raw(path).name == name
    (tmp_path / "link.h5").symlink_to(path)
    assert read_raw(tmp_path / "link.h5").columns["time_s"].size == 60
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(DataError, check=coded("io.hdf5-unreadable")) as caught:
        read_raw(path)
    assert caught.value.finding.file == name


def test_the_folder_of_the_caller_may_change(tmp_path, log, monkeypatch):
    read_raw(log)
    monkeypatch.chdir(tmp_path)
    assert read_raw("log.h5").columns["time_s"].size == 60


# --- what comes back --------------------------------------------------------------------


def plain(value):
    """Anything that a reader returns, as text with every bit of its numbers."""
    if isinstance(value, np.ndarray):
        body = value.tolist() if value.dtype.kind in "OU" else value.tobytes().hex()
        return f"{value.dtype.str} {value.shape} {body}"
    if hasattr(value, "to_numpy"):
        parts = [plain(value[c].to_numpy()) for c in value.columns]
        return "\n".join([*parts, plain(value.index.to_numpy()), plain(dict(value.attrs))])
    if isinstance(value, dict):
        return "\n".join(f"{k}: {plain(v)}" for k, v in value.items())
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(plain, value))}]"
    if hasattr(value, "__dataclass_fields__"):
        return plain({k: getattr(value, k) for k in value.__dataclass_fields__})
    return repr(value)


def streams_of(path):
    _, reader = reader_of(path)
    assert reader is not None, path.name
    found = {}
    for stream in reader.streams:
        try:
            found[stream] = plain(open_stream(path, "imu" if stream == TABLE else stream))
        except DataError as error:
            found[stream] = repr(error.finding)
    return found


def forget_what_was_read():
    for cached in (hdf5_files.outline, hdf5_files.contents_of_matlab, toolboxes._names):
        cached.cache_clear()
    sensor_folder._names.cache_clear()
    sensor_folder._heads.cache_clear()


def test_results_are_those_of_reading_in_place(tmp_path, recordings):
    paths = fuzz.seeds(tmp_path) + [recordings(f"zoo/{name}") for name in ZOO]
    assert len({reader_of(p)[0] for p in paths}) >= 18
    read = []
    for path in paths:
        apart = streams_of(path)
        forget_what_was_read()
        with in_place():
            assert streams_of(path) == apart, path.name
        forget_what_was_read()
        read += [f"{path.name}: {s}" for s, v in apart.items() if not v.startswith("Finding")]
        assert files_of(path) == (path,)
    assert len(read) > 30, read


ARRAYS = [
    np.arange(6.0).reshape(2, 3),
    np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    np.arange(6.0)[::2],
    np.array(3.5),
    np.empty((0, 3)),
    np.array([np.nan, -0.0, np.inf], dtype=">f4"),
    np.array([True, False]),
    np.array(["a", "größer"]),
    np.array([b"a", b"bc"]),
    np.array(["2024-01-01T00:00:00.5"], dtype="datetime64[ns]"),
    np.array([1 + 2j]),
]


@pytest.mark.parametrize("value", ARRAYS, ids=lambda a: f"{a.dtype}{a.shape}")
def test_an_array_keeps_every_bit_and_its_layout(value):
    back = wire.decode(io.BytesIO(b"".join(wire.encode({"a": [value]}))), 1 << 20)["a"][0]
    assert (back.dtype, back.shape, back.tobytes()) == (value.dtype, value.shape, value.tobytes())
    assert back.flags.f_contiguous or not value.flags.f_contiguous or value.ndim < 2


def test_trees_come_back():
    tree = {"a": [1, 2.5, None, True, "ü\ud800"], "b": b"\0\xff", "n": float("inf"), "": {}}
    assert wire.decode(io.BytesIO(b"".join(wire.encode(tree))), 1 << 20) == tree
    texts = wire.decode(io.BytesIO(b"".join(wire.encode(np.array(["a", None], "O")))), 1 << 20)
    assert texts.tolist() == ["a", "None"]


@pytest.mark.parametrize("roomy", [False, True])
def test_what_is_no_answer_is_refused(roomy):
    """Nothing but an end or a refusal: no other exception, no memory, no object."""
    taken = [0]

    def taking(shape):
        taken.append(8 * shape[0] * shape[1])
        return np.empty(shape)

    room = taking if roomy else None
    good = b"".join(wire.encode({"a": np.arange(3.0), "b": np.array(["a"]), "c": b"abc"}))
    draw = random.Random(1)
    for _ in range(3000):
        data = bytearray(good)
        for _ in range(1 + draw.randrange(3)):
            data[draw.randrange(len(data))] = draw.randrange(256)
        with contextlib.suppress(wire.BrokenAnswerError, EOFError):
            wire.decode(io.BytesIO(bytes(data)), 1 << 16, room=room)
    for dtype, shape, size in (("|O", [1], 8), ("<f8", [-1], -8), ("<f8", [2], 8), ("<U1", [1], 4)):
        body = b"\xff" * 8
        head = f'[[["{dtype}", {shape}, false, {size}]], "{{}}"]'.encode()
        answer = struct.pack("<QQ", len(head), max(size, 0)) + head + body
        with pytest.raises((wire.BrokenAnswerError, EOFError)):
            wire.decode(io.BytesIO(answer), 1 << 16, room=room)
    # Sizes that together are as announced, of which one is not.
    parts = [["<f8", [1 << 40], False, 1 << 43], ["<f8", [1], False, 8 - (1 << 43)]]
    head = json.dumps([parts, "{}"]).encode()
    with pytest.raises(wire.BrokenAnswerError):
        wire.decode(io.BytesIO(struct.pack("<QQ", len(head), 8) + head + body), 1 << 16, room=room)
    assert max(taken) <= 1 << 16


@pytest.mark.parametrize(
    "answer",
    [
        {"error": "DataError", "finding": {"code": "io.no-such-code", "data": {}}},
        {"error": "DataError", "finding": {"code": "io.claims-bytes-stored", "data": {}}},
        {"error": "DataError", "finding": 3},
        {"failed": {"a": 1}},
        [1],
    ],
)
def test_an_error_that_is_none_is_refused(answer):
    with pytest.raises(DataError, check=coded("io.parser-failed")) as caught:
        process._taken(answer, "log.h5", 1)
    assert isinstance(caught.value.finding, Finding) and str(caught.value)


def test_an_answer_that_is_none_ends_the_process(log, monkeypatch):
    before = running().pid

    def broken(*_):
        raise wire.BrokenAnswerError("sizes")

    with monkeypatch.context() as patch:
        patch.setattr(wire, "decode", broken)
        with pytest.raises(DataError, check=coded("io.parser-failed")):
            read_raw(log)
    assert read_raw(log).columns["time_s"].size == 60
    assert process._process.pid != before


@pytest.mark.parametrize("function", ["hdf5._links", "os.system", "worker.main", "hdf5.nothing"])
def test_only_functions_of_parsers_are_called(log, function):
    with pytest.raises(DataError, check=coded("io.parser-failed")):
        parse(function, log)


# --- HDF5: values of another file -------------------------------------------------------

SECRET = 271828.18284


def elsewhere(folder, kind):
    """A log of which the gyro is in another file, with a value that must appear nowhere."""
    secret, path, held = folder / "secret.bin", folder / "log.h5", fuzz.signals()
    gyro = held.pop("gyro_x_rad_s")
    np.full(gyro.size, SECRET).tofile(secret)
    hdf5(folder / "secret.h5", {"s": np.full(gyro.size, SECRET)})
    hdf5(path, held)
    with h5py.File(path, "a") as file:
        if kind == "external":
            outside = [(str(secret), 0, secret.stat().st_size)]
            file.create_dataset("gyro_x_rad_s", gyro.shape, "f8", external=outside)
        elif kind == "virtual":
            layout = h5py.VirtualLayout(gyro.shape, "f8")
            layout[:] = h5py.VirtualSource(folder / "secret.h5", "s", gyro.shape)
            file.create_virtual_dataset("gyro_x_rad_s", layout)
        elif kind == "link":
            file["gyro_x_rad_s"] = h5py.ExternalLink(folder / "secret.h5", "s")
        elif kind == "deep link":
            file["a/b/gyro_x_rad_s"] = h5py.ExternalLink(folder / "secret.h5", "/")
        elif kind == "soft":
            file["out"] = h5py.ExternalLink(folder / "secret.h5", "/")
            file["gyro_x_rad_s"] = h5py.SoftLink("/out/s")
    return path


@pytest.mark.parametrize("kind", ["external", "virtual", "link", "deep link", "soft"])
@pytest.mark.parametrize("form", [None, "hdf5", "broad", "ronin", "apdm", "navego"])
def test_values_of_another_file_are_refused(tmp_path, kind, form):
    path = elsewhere(tmp_path, kind)
    if form == "navego":
        path = path.rename(tmp_path / "log.mat")
    with pytest.raises(DataError) as caught:
        open_stream(path, "imu", form)
    error = caught.value
    if form in (None, "hdf5", "broad"):
        assert error.finding.code == "io.hdf5-elsewhere" and "one file" in str(error)
        name = {"deep link": "a/b/gyro_x_rad_s", "soft": "out"}.get(kind, "gyro_x_rad_s")
        assert error.finding.quantity == name
    assert str(SECRET)[:6] not in f"{error} {error.finding!r}"


def test_a_folder_is_listed_beside_such_a_file(tmp_path, log):
    log.rename(tmp_path / "good.h5")
    elsewhere(tmp_path, "link")
    with pytest.raises(DataError, check=coded("io.folder-of-one-recording", names="good.h5")):
        read_raw(tmp_path)


def test_a_soft_link_within_the_file_is_none(tmp_path):
    held = fuzz.signals()
    path = hdf5(tmp_path / "log.h5", held)
    with h5py.File(path, "a") as file:
        file["alias"] = h5py.SoftLink("/time_s")
        file["broken"] = h5py.SoftLink("/nothing")
    assert set(read_raw(path).columns) == set(held)


def test_many_objects_are_refused(tmp_path, monkeypatch):
    from strapdown.parsers import hdf5

    path = hdf5_of_groups(tmp_path / "log.h5", 50)
    assert len(parse("hdf5.outline", path)["names"]) == 50
    monkeypatch.setattr(hdf5, "MOST_LINKS", 40)
    with in_place(), pytest.raises(DataError, check=coded("io.hdf5-too-many-objects", most=40)):
        parse("hdf5.outline", path)


def hdf5_of_groups(path, count):
    with h5py.File(path, "w") as file:
        for k in range(count):
            file.create_group(f"g{k}")
    return path


def test_a_database_with_names_in_no_encoding_is_no_bag(tmp_path):
    path = tmp_path / "log.db3"
    with contextlib.closing(sqlite3.connect(path)) as base:
        base.execute("create table messages (a)")
        base.commit()
    path.write_bytes(path.read_bytes().replace(b"messages", b"mess\xe5\xff\xffs"))
    with pytest.raises(DataError, check=coded("io.foreign-format")):
        read_raw(path)


# --- what unpacks too far ---------------------------------------------------------------


def test_arrays_that_fill_the_memory_together_are_refused(tmp_path):
    """None of them declares a thousand times what is stored."""
    path = tmp_path / "zeros.h5"
    block = np.random.default_rng(0).integers(0, 2, 4_000_000) * 0.0
    block[::400] = np.random.default_rng(1).normal(size=10_000)
    with h5py.File(path, "w") as file:
        for k in range(12):
            file.create_dataset(f"a{k}", data=block, chunks=(1 << 20,), compression="gzip")
    declared = 12 * block.nbytes
    assert declared > declared_most(path.stat().st_size)
    begun = time.monotonic()
    with pytest.raises(DataError, check=coded("io.unpacks-too-far", declared=declared)):
        read_raw(path)
    assert time.monotonic() - begun < 5.0


def test_an_archive_of_that_much_is_refused_before_a_member_is_opened(tmp_path):
    path = tmp_path / "log.zip"
    noise = random.Random(1).randbytes(1 << 17)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for k in range(10):
            archive.writestr(f"Gyroscope{k}.csv", noise + bytes(40 << 20))
    with pytest.raises(DataError, check=coded("io.unpacks-too-far")):
        read_raw(path)
    path.rename(tmp_path / "log.npz")
    with pytest.raises(DataError, check=coded("io.unpacks-too-far")):
        read_raw(tmp_path / "log.npz")


def test_many_columns_of_parquet_are_refused(tmp_path, monkeypatch):
    import pyarrow as pa
    import pyarrow.parquet as pq

    from strapdown.parsers import parquet

    pq.write_table(pa.table({f"c{k}": [1.0, 2.0] for k in range(30)}), tmp_path / "a.parquet")
    monkeypatch.setattr(parquet, "MOST_COLUMNS", 20)
    expected = coded("io.too-many-columns-of-table", count=30, most=20)
    with in_place(), pytest.raises(DataError, check=expected):
        read_raw(tmp_path / "a.parquet")


@pytest.mark.parametrize("ending", ["csv", "json", "txt", "bin", ""])
def test_eight_thousand_empty_members_are_answered_soon(tmp_path, ending):
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(8000):
            archive.writestr(f"a{k}.{ending}".rstrip("."), b"")
    begun = time.monotonic()
    with pytest.raises(DataError) as caught:
        read_raw(path)
    assert time.monotonic() - begun < 5.0
    assert caught.value.finding.file == "log.zip"


def test_an_archive_of_many_members_is_refused(tmp_path, monkeypatch):
    from strapdown.parsers import archives

    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(30):
            archive.writestr(f"a{k}", b"")
    monkeypatch.setattr(archives, "MOST_MEMBERS", 20)
    forget_what_was_read()
    expected = coded("io.too-many-archived", count=30, most=20)
    with in_place(), pytest.raises(DataError, check=expected):
        parse("archives.names", path)


def test_a_drawn_set_of_damaged_files_is_read_or_refused(tmp_path):
    found = fuzz.main(104, seed=5, keep=tmp_path)
    assert found["read"] > 10 and found["refused"] > 40
    assert not found["traceback"] and not found["slow"]


def test_a_reader_of_another_distribution_asks_for_it(tmp_path, monkeypatch):
    """It names a function of its own module, which the other process finds where this one does."""
    (tmp_path / "my_parser.py").write_text(
        "import os\ndef values(path, scale):\n"
        "    return {'pid': os.getpid(), 'values': [scale * b for b in path.read_bytes()]}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    process._forget()
    (tmp_path / "log.bin").write_bytes(b"\x01\x02")
    found = parse("my_parser:values", tmp_path / "log.bin", scale=2)
    assert found["values"] == [2, 4] and found["pid"] != os.getpid()
    process._forget()


def test_an_answer_larger_than_the_file_allows_is_refused(tmp_path):
    answer = b"".join(wire.encode({"a": np.zeros(1000)}))
    for most in ((7999, 1000), (8000, 10)):
        with pytest.raises(wire.BrokenAnswerError):
            wire.decode(io.BytesIO(answer), *most)
    assert wire.decode(io.BytesIO(answer), 8000, 1000)["a"].size == 1000


def test_a_control_point_file_says_why_it_is_refused(tmp_path):
    """Not that its ending is not one of a table."""
    with pytest.raises(DataError, check=coded("io.hdf5-elsewhere")):
        read_control_points(elsewhere(tmp_path, "external"))


def test_stamps_that_are_no_dataset_are_missed_by_name(tmp_path):
    held = fuzz.signals()
    three = np.column_stack([held[f"gyro_{a}_rad_s"] for a in "xyz"])
    path = hdf5(tmp_path / "data.hdf5", {"synced/gyro": three, "synced/acce": three})
    with h5py.File(path, "a") as file:
        file.create_group("synced/time")
    with pytest.raises(DataError, check=coded("io.no-such-array", name="synced/time")):
        read_raw(path)


def test_an_archive_of_another_version_is_refused(tmp_path):
    np.savez(tmp_path / "log.npz", **fuzz.signals())
    data = bytearray((tmp_path / "log.npz").read_bytes())
    data[data.index(b"PK\x01\x02") + 6] = 255  # version that is needed
    (tmp_path / "log.npz").write_bytes(data)
    with pytest.raises(DataError, check=coded("io.npz-unreadable")):
        read_raw(tmp_path / "log.npz")
