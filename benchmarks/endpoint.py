"""How fast an endpoint answers for a car: requests at a steady rate, whether or not the last one was answered.

    python benchmarks/endpoint.py RUN --rate 200 --seconds 10

The server is a process of its own on one core; the client's is another. A latency counts from when a request was due,
so that a server which stalls is not spared the requests that would have come meanwhile.
"""

from __future__ import annotations

import argparse
import asyncio
import io
import json
import os
import subprocess
import sys
import time

import numpy as np


def main() -> None:
    """Print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run")
    parser.add_argument("--rate", type=float, default=200.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    asked = parser.parse_args()
    command = [sys.executable, "-m", "racecraft", "serve", asked.run, "--port", "0", "--json"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=_on_one_core)
    try:
        port = int(json.loads(server.stdout.readline())["url"].rpartition(":")[2])
        before = _cpu_seconds(server.pid)
        figures = asyncio.run(measure(port, asked.rate, asked.seconds))
        spent = (_cpu_seconds(server.pid) - before) * 1000 / figures["requests"]
        print(json.dumps({**figures, "server_cpu_ms_per_request": round(spent, 3)}))
    finally:
        server.terminate()
        server.wait()


async def measure(port: int, rate: float, seconds: float) -> dict[str, float]:
    """Return the quantiles of the latencies, ms."""
    body = await _question(port)
    count = int(rate * seconds)
    begin = time.perf_counter() + 0.5
    latencies = await asyncio.gather(*(_ask(port, body, begin + at / rate) for at in range(count)))
    taken = np.array(latencies) * 1000
    return {
        "requests": count,
        "rate": rate,
        **{f"p{q}_ms": round(float(np.percentile(taken, q)), 2) for q in (50, 90, 99)},
        "max_ms": round(float(taken.max()), 2),
        "load": os.getloadavg()[0],
        "cores": os.cpu_count() or 1,
    }


async def _question(port: int) -> bytes:
    """Return a request with one frame, as the policy sees frames."""
    told = json.loads(await _exchange(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"))
    shape = next(iter(told["observations"].values()))["shape"]
    buffer = io.BytesIO()
    np.save(buffer, np.random.default_rng(1).integers(0, 256, (1, *shape), np.uint8))
    frame = buffer.getvalue()
    head = "POST /invocations HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/x-npy\r\n"
    more = f"Accept: application/json\r\nContent-Length: {len(frame)}\r\nConnection: close\r\n\r\n"
    return (head + more).encode() + frame


async def _ask(port: int, request: bytes, due: float) -> float:
    await asyncio.sleep(max(0.0, due - time.perf_counter()))
    told = json.loads(await _exchange(port, request))
    assert "predictions" in told, told
    return time.perf_counter() - due


async def _exchange(port: int, request: bytes) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    answer = await reader.read()
    writer.close()
    return answer.partition(b"\r\n\r\n")[2]


def _cpu_seconds(process: int) -> float:
    """Return the processor time a process has had (Linux); other programs on the machine do not change it much."""
    with open(f"/proc/{process}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _on_one_core() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


if __name__ == "__main__":
    main()
