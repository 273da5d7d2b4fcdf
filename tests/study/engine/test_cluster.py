"""Blocks on a dask cluster: the same bytes, and nothing lost when a worker, the scheduler or the client is."""

import os
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from flexura.errors import OptionError, SolverError
from flexura.study.engine import open_study, run
from flexura.study.engine.work import Work
from flexura.study.engine.workers import on_cluster
from helpers.cheap_studies import ROOT, asked, files, space

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


DASK = str(Path(sys.executable).parent / "dask")


@contextmanager
def cluster(workers, tmp_path):
    """The address of a scheduler of its own processes, the process of the scheduler, and those of its workers."""
    with socket.socket() as own:
        own.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{own.getsockname()[1]}"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT / "tests")])}
    env |= {"OPENBLAS_NUM_THREADS": "1", "DASK_TEMPORARY_DIRECTORY": str(tmp_path), "HOME": str(tmp_path)}
    host, port = address.split(":")
    quiet = {"env": env, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    scheduler = subprocess.Popen([DASK, "scheduler", "--host", host, "--port", port, "--no-dashboard"], **quiet)
    started = [scheduler]
    try:
        for _ in range(workers):
            command = [DASK, "worker", f"tcp://{address}", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            started.append(subprocess.Popen(command, **quiet))
        with distributed.Client(f"tcp://{address}", timeout=30, set_as_default=False) as client:
            if workers:
                client.wait_for_workers(workers, timeout=60)
        yield f"tcp://{address}", scheduler, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def slow():
    """Questions of 5 s for all designs, and the same answers."""
    return asked(limit=0.9, seconds=5e-3)


def after(folder, shards, act):
    """Do something once so many shards are there."""

    def wait():
        while len(list(folder.glob("*.parquet"))) < shards:
            time.sleep(0.005)
        act()

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    return thread


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    run(asked(limit=0.9), space(), folder=folder, workers=1)
    return files(folder)


def test_a_cluster_gives_the_same_bytes(tmp_path, undisturbed):
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as own:
        table = run(asked(limit=0.9), space(), folder=tmp_path / "study", scheduler=own.scheduler_address)
        with pytest.raises(SolverError, match=r"designs .*: this cannot be"):
            run(asked(wrong=0.5), space(), scheduler=own.scheduler_address)
    assert len(table) == 1000
    assert files(tmp_path / "study") == undisturbed


@pytest.mark.slow
def test_a_worker_that_is_lost_is_said(tmp_path, undisturbed):
    with cluster(2, tmp_path) as (address, _, workers):
        lost = after(tmp_path / "study", 6, workers[0].kill)
        table = run(slow(), space(), folder=tmp_path / "study", scheduler=address)
        lost.join()
    assert files(tmp_path / "study") == undisturbed
    assert any("was lost" in note for note in table.notes)


@pytest.mark.slow
def test_a_scheduler_that_is_lost_keeps_what_is_done(tmp_path, undisturbed):
    with cluster(2, tmp_path) as (address, scheduler, _):
        lost = after(tmp_path / "study", 6, scheduler.kill)
        with pytest.raises(SolverError, match=r"the scheduler .* is lost\n *\d+ of 1000 designs are kept"):
            run(slow(), space(), folder=tmp_path / "study", scheduler=address)
        lost.join()
    assert 0 < len(open_study(tmp_path / "study")) < 1000
    run(asked(limit=0.9), space(), folder=tmp_path / "study", workers=2)
    assert files(tmp_path / "study") == undisturbed


@pytest.mark.parametrize("answered", range(5))
def test_a_scheduler_that_is_lost_at_any_exchange_is_said(answered):
    left = iter(range(answered))

    def exchange(given):
        if next(left, None) is None:
            raise distributed.comm.CommClosedError("closed")
        return given

    client = SimpleNamespace(
        status="running",
        scheduler=SimpleNamespace(address="tcp://127.0.0.1:8786"),
        submit=lambda *_, **__: exchange(Future()),
        get_executor=lambda **_: SimpleNamespace(submit=lambda *_: exchange(Future()), shutdown=exchange),
        nthreads=lambda: exchange({"worker": 1}),
        cancel=exchange,
    )
    with pytest.raises(SolverError, match=r"the scheduler tcp://127.0.0.1:8786 is lost"):
        list(on_cluster(client, Work(asked(), space(), {}), iter(range(9)), print))


@pytest.mark.slow
def test_all_workers_lost_keeps_what_is_done(tmp_path, monkeypatch):
    monkeypatch.setattr("flexura.study.engine.workers.LOST_SECONDS", 2.0)
    with cluster(1, tmp_path) as (address, _, workers):
        lost = after(tmp_path / "study", 6, workers[0].kill)
        with pytest.raises(SolverError, match=r"all workers of .* are lost\n *\d+ of 1000 designs are kept"):
            run(slow(), space(), folder=tmp_path / "study", scheduler=address)
        lost.join()


@pytest.mark.slow
@pytest.mark.parametrize("answer", [b"", b"SSH-2.0-OpenSSH_9.2"], ids=["silent", "other"])
def test_a_port_that_is_not_of_dask_is_said(monkeypatch, answer):
    monkeypatch.setattr(sys.modules["flexura.study.engine.workers"], "ANSWER_SECONDS", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as server:
        held = []

        def greet():
            held.append(server.accept()[0])
            held[0].sendall(answer)

        thread = threading.Thread(target=greet, daemon=True)
        thread.start()
        with pytest.raises(OptionError, match=r"no scheduler answers at tcp://127.*it is no dask"):
            run(asked(), space(), scheduler=f"tcp://127.0.0.1:{server.getsockname()[1]}")
        thread.join()
        held[0].close()


def test_a_scheduler_without_workers_is_said(tmp_path):
    with cluster(0, tmp_path) as (address, _, _), pytest.raises(OptionError, match="has no workers; start some with"):
        run(asked(), space(), folder=tmp_path / "study", scheduler=address)
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:1", "no scheduler answers at tcp://127.0.0.1:1 "),
        ("somewhere", "'somewhere' is no address"),
        ("tcp://somewhere", "is no address"),
        ("tcp://127.0.0.1:99999", "no scheduler answers|is no address"),
    ],
)
def test_a_scheduler_that_is_away_is_said_before_anything_is_made(tmp_path, address, said):
    with pytest.raises(OptionError, match=said):
        run(asked(), space(), folder=tmp_path / "study", scheduler=address)
    assert not (tmp_path / "study").exists()
