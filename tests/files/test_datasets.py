"""Downloads, from a server of the test's own that sends good, truncated, corrupted, slow and missing files."""

from __future__ import annotations

import hashlib
import threading
import time
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from spectral_notes.files.datasets import DATASETS, Dataset, fetch_mesh

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
GROUPS = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\ng helper\nf 1 2 5\ng body\nf 1/1 2/2 3/3 4/4\n"
requests_seen = []


class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        requests_seen.append(self.path)
        body = GROUPS if self.path == "/groups.obj" else TRIANGLE
        if self.path == "/missing.obj":
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.path == "/slow.obj":
            time.sleep(3.0)
            return
        if self.path == "/truncated.obj":
            body = body[:-9]
        if self.path == "/corrupted.obj":
            body = body.replace(b"1", b"7")
        self.wfile.write(body)

    def log_message(self, *args):
        pass


@pytest.fixture(scope="module")
def server():
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as running:
        running.daemon_threads = True
        threading.Thread(target=running.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{running.server_port}"
        running.shutdown()


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SPECTRAL_NOTES_CACHE", str(tmp_path))
    return tmp_path


def record_of(server, name, content=TRIANGLE):
    url = f"{server}/{name}.obj"
    return {name: Dataset(url, len(content), hashlib.sha256(content).hexdigest(), "CC0", "the test")}


def files_in(folder):
    return [path for path in folder.rglob("*") if path.is_file()]


def test_a_good_file_is_fetched_once_and_its_terms_are_printed(server, cache, capsys):
    requests_seen.clear()
    for _ in range(2):
        mesh = fetch_mesh("good", datasets=record_of(server, "good"))
    assert (mesh.name, mesh.n_vertices, mesh.n_faces) == ("good", 3, 1)
    assert requests_seen == ["/good.obj"]
    assert capsys.readouterr().out.count("good: CC0; credit: the test. http://127.0.0.1") == 2
    assert len(files_in(cache)) == 1


def test_one_group_of_a_file_is_kept_and_cut_into_triangles(server, cache):
    records = record_of(server, "groups", GROUPS)
    mesh = fetch_mesh("groups", datasets={"groups": replace(records["groups"], group="body")})
    assert (mesh.n_vertices, mesh.n_faces) == (4, 2)
    assert mesh.area == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("missing", ConnectionError, "name 'missing' could not be downloaded from http://127.0.0.1.*404"),
        ("truncated", (ConnectionError, ValueError), "name 'truncated' (could not be downloaded|came with the wrong hash)"),
        ("corrupted", ValueError, "name 'corrupted' came with the wrong hash .* nothing was kept"),
        ("slow", ConnectionError, "name 'slow' could not be downloaded .*timed out"),
    ],
)
def test_a_bad_download_leaves_nothing_behind(server, cache, name, error, message):
    with pytest.raises(error, match=message):
        fetch_mesh(name, timeout=0.5, datasets=record_of(server, name))
    assert files_in(cache) == []


def test_an_unreachable_host_says_so(cache):
    record = Dataset("http://127.0.0.1:9/a.obj", 1, "0" * 64, "CC0", "nobody")
    with pytest.raises(ConnectionError, match="name 'a' could not be downloaded from http://127.0.0.1:9/a.obj"):
        fetch_mesh("a", datasets={"a": record})
    assert files_in(cache) == []


def test_a_damaged_copy_in_the_cache_is_fetched_again(server, cache):
    records = record_of(server, "good")
    fetch_mesh("good", datasets=records)
    (path,) = files_in(cache)
    path.write_bytes(b"v 0 0")
    assert fetch_mesh("good", datasets=records).n_faces == 1
    assert path.read_bytes() == TRIANGLE


def test_arguments_are_checked(cache):
    with pytest.raises(ValueError, match="name must be one of 'spot', 'bunny'.*; got 'teapot'"):
        fetch_mesh("teapot")
    with pytest.raises(ValueError, match="timeout must be greater than 0"):
        fetch_mesh("spot", timeout=0)


def test_the_table_is_pinned_and_complete():
    for name, record in DATASETS.items():
        assert record.url.startswith("https://"), name
        assert len(record.url.split("/")[5]) == 40, f"{name} is not pinned to a commit"
        assert len(bytes.fromhex(record.sha256)) == 32
        assert record.licence
        assert record.credit
    assert len(np.unique([record.sha256 for record in DATASETS.values()])) == len(DATASETS)
