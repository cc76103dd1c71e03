"""The work of a run in other processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from conftest import bumps, write_ply

import outcrop

# A cloud with five blocks.
POINTS = 300_000


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    return write_ply(tmp_path / "cloud.ply", bumps(POINTS))


@pytest.fixture
def expected(cloud: Path) -> bytes:
    return Path(outcrop.reconstruct(cloud, memory="256MiB", output=cloud.with_name("one.ply")).path).read_bytes()


def processes(count: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"))


def leftovers(folder: Path) -> list[str]:
    return [name for name in os.listdir(folder) if "outcrop" in name]


def test_a_pool_of_processes_makes_the_same_mesh(cloud: Path, expected: bytes, tmp_path: Path) -> None:
    stages: list[str] = []
    report = tmp_path / "report.json"
    with processes(2) as pool:
        mesh = outcrop.reconstruct(
            cloud,
            output=tmp_path / "mesh.ply",
            memory="256MiB",
            executor=pool,
            shards=3,
            report=report,
            progress=lambda stage, done, total: stages.append(stage),
        )
        points = outcrop.reconstruct(bumps(POINTS), memory="256MiB", executor=pool, shards=2)
    assert Path(mesh.path).read_bytes() == expected
    assert Path(points.path).read_bytes() == expected
    assert mesh.report["mesh"]["vertices"] == len(mesh.vertices) and report.exists()
    assert "cells" in stages
    assert not leftovers(tmp_path)


def test_scratch_is_elsewhere(cloud: Path, expected: bytes, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        mesh = outcrop.reconstruct(
            cloud, output=tmp_path / "mesh.ply", executor=pool, shards=2, memory="256MiB", scratch=tmp_path / "scratch"
        )
    assert Path(mesh.path).read_bytes() == expected
    assert not os.listdir(tmp_path / "scratch")


class Failing(Executor):
    """Every third task is lost, and every fourth comes twice."""

    def __init__(self) -> None:
        self.count = 0
        self.pool = ThreadPoolExecutor(1)

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.count += 1
        if self.count % 3 == 0:
            lost: Future[Any] = Future()
            lost.set_exception(RuntimeError("its machine is gone"))
            return lost
        if self.count % 4 == 0:
            self.pool.submit(fn, *args, **kwargs)
        return self.pool.submit(fn, *args, **kwargs)


def test_lost_tasks_are_done_again(cloud: Path, expected: bytes, tmp_path: Path) -> None:
    executor = Failing()
    mesh = outcrop.reconstruct(cloud, output=tmp_path / "mesh.ply", executor=executor, shards=2, memory="256MiB")
    executor.pool.shutdown()
    assert Path(mesh.path).read_bytes() == expected and not leftovers(tmp_path)


def test_a_broken_pool_can_be_replaced(cloud: Path, expected: bytes, tmp_path: Path) -> None:
    output = tmp_path / "mesh.ply"
    pool = processes(1)

    def kill(stage: str, done: int, total: int) -> None:
        if stage == "cells":
            for process in list((pool._processes or {}).values()):
                os.kill(process.pid or 0, signal.SIGKILL)

    with pytest.raises(outcrop.Error) as failed:
        outcrop.reconstruct(cloud, output=output, executor=pool, shards=2, memory="256MiB", progress=kill)
    assert failed.value.can_resume, failed.value
    pool.shutdown()
    with ThreadPoolExecutor(1) as other:
        with pytest.raises(outcrop.ScratchError, match="exists already"):
            outcrop.reconstruct(cloud, output=output, executor=other, memory="256MiB")
        with pytest.raises(outcrop.ScratchError, match="smooth"):
            outcrop.reconstruct(cloud, output=output, executor=other, smooth=3, resume=True)
        outcrop.reconstruct(cloud, output=output, executor=other, resume=True)
    assert output.read_bytes() == expected and not leftovers(tmp_path)


def test_what_a_plan_has_not_is_refused(cloud: Path, tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as pool:
        for options in ({"time_limit": 5}, {"shards": 0}, {"triangles": 100}, {"report": ["a.json", "b.json"]}):
            with pytest.raises(outcrop.ParameterError):
                outcrop.reconstruct(cloud, output=tmp_path / "mesh.ply", executor=pool, **options)
    assert not leftovers(tmp_path)


def test_dask_loses_a_worker(cloud: Path, expected: bytes, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=tmp_path / "dask"
    ) as cluster, distributed.Client(cluster) as client:
        workers = [worker["pid"] for worker in client.run(lambda: {"pid": os.getpid()}).values()]
        killed = threading.Event()

        def kill(stage: str, done: int, total: int) -> None:
            if stage == "cells" and not killed.is_set():
                killed.set()
                time.sleep(0.2)
                os.kill(workers[0], signal.SIGKILL)

        mesh = outcrop.reconstruct(
            cloud,
            output=tmp_path / "mesh.ply",
            executor=client.get_executor(),
            shards=5,
            memory="256MiB",
            progress=kill,
        )
    assert killed.is_set()
    assert Path(mesh.path).read_bytes() == expected


def test_scratch_is_in_a_bucket(cloud: Path, expected: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    server = pytest.importorskip("moto.server").ThreadedMotoServer(port=0)
    boto3 = pytest.importorskip("boto3")
    server.start()
    host, port = server.get_host_and_port()
    copies = tmp_path / "copies"
    copies.mkdir()
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "hush",
        "AWS_REGION": "us-east-1",
        "TMPDIR": str(copies),
    }.items():
        monkeypatch.setenv(name, value)
    try:
        store = boto3.client("s3", endpoint_url=f"http://{host}:{port}", region_name="us-east-1")
        store.create_bucket(Bucket="scratch")
        store.upload_file(str(cloud), "scratch", "cloud.ply")
        with processes(2) as pool:
            mesh = outcrop.reconstruct(
                "s3://scratch/cloud.ply",
                output=tmp_path / "mesh.ply",
                executor=pool,
                shards=3,
                memory="256MiB",
                scratch="s3://scratch/runs",
            )
            assert Path(mesh.path).read_bytes() == expected
            mesh = outcrop.reconstruct("s3://scratch/cloud.ply", executor=pool, scratch="s3://scratch/runs")
        assert Path(mesh.path).read_bytes() == expected
        assert [found["Key"] for found in store.list_objects_v2(Bucket="scratch")["Contents"]] == ["cloud.ply"]
        assert not os.listdir(copies) and not leftovers(tmp_path)
    finally:
        server.stop()
