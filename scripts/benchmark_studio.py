"""How long a click takes in the studio on 1 000 000 samples of 6 joints, where no refit is needed.

    python scripts/benchmark_studio.py [--samples 1000000] [--repeat 15] [--whole]

The log is synthetic (a UR5 with friction, a hidden Stribeck effect and noise). It is fitted and questioned once, with a
few candidates unless --whole asks for the whole vocabulary; then the application answers requests in this process, each
timed from the request to the last byte of its answer. Prints a table; exits with 1 where the median of one is 100 ms or its worst
300 ms, or where the first charts are not there within a second of the fit.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import resource
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import httpx
import numpy as np
import polars as pl

from sysid import candidates, regressor, robot, robot_spec
from sysid.diagnose import ask, diagnosis
from sysid.studio.app import application
from sysid.studio.serve import responsive
from sysid.studio.session import Session

LIMIT, WORST, FIRST = 0.1, 0.3, 1.0  # s: of a click the median and the worst; from the fit to its first charts
PORT, CSRF = 8765, "benchmark"
URDF = "example-robot-data://ur_description/urdf/ur5_robot.urdf"
ASKED = ("stribeck", "asymmetric_coulomb", "torque_bias", "armature")


def written(folder: Path, samples: int) -> Path:
    """An experiment with so many samples in all, a sixth of them held out."""
    machine = robot.load(robot_spec.RobotSpec(urdf=URDF))
    for name, count, seed in (("train", samples - samples // 6, 0), ("test", samples // 6, 1)):
        rng, t = np.random.default_rng(seed), np.arange(count) / 1000.0
        q, qd, qdd = (np.zeros((count, machine.dof)) for _ in range(3))
        for j in range(machine.dof):
            for w in 2 * np.pi * np.array([0.05, 0.11, 0.23, 0.41]) * rng.uniform(0.8, 1.2, 4):
                size, phase = rng.uniform(0.1, 0.4), rng.uniform(0, 2 * np.pi)
                q[:, j] += size * np.sin(w * t + phase)
                qd[:, j] += size * w * np.cos(w * t + phase)
                qdd[:, j] -= size * w**2 * np.sin(w * t + phase)
        tau = np.concatenate([regressor.torque(machine, machine.prior, *(x[k : k + 50000] for x in (q, qd, qdd))) for k in range(0, count, 50000)])
        tau += 2.0 * qd + 1.5 * np.sign(qd)
        tau[:, 1] += 2.0 * np.exp(-((qd[:, 1] / 0.1) ** 2)) * np.sign(qd[:, 1])
        tau += rng.normal(0.0, 0.3, tau.shape)
        columns = {"t": t} | {f"q_{joint}": q[:, k] for k, joint in enumerate(machine.joints)} | {f"tau_{joint}": tau[:, k] for k, joint in enumerate(machine.joints)}
        pl.DataFrame(columns).write_parquet(folder / f"{name}.parquet")
    (folder / "config.yaml").write_text(f"robot: {{urdf: '{URDF}'}}\ndata: {{train: [train.parquet], test: [test.parquet]}}\nmodel: {{effects: [viscous, coulomb]}}\n")
    return folder


class Clicks:
    """Requests to the application, each timed."""

    def __init__(self, session: Session):
        self.app = application(session, port=PORT, csrf=CSRF)
        self.loop = asyncio.new_event_loop()
        self.client = httpx.AsyncClient(transport=httpx.ASGITransport(self.app), base_url=f"http://127.0.0.1:{PORT}", timeout=None, headers={"x-sysid-csrf": CSRF})

    def spent(self, path: str, times: int = 5) -> float:
        """The processor's seconds for an answer, the median: what it takes where nobody else is at work."""
        out = []
        for _ in range(times):
            start = time.process_time()
            self.ask(path)
            out.append(time.process_time() - start)
        return float(np.median(out))

    def ask(self, path: str, body: dict | None = None) -> tuple[httpx.Response, float]:
        """An answer, and the seconds that it took."""
        start = time.perf_counter()
        work = self.client.get(path) if body is None else self.client.post(path, json=body)
        answer = self.loop.run_until_complete(work)
        seconds = time.perf_counter() - start
        answer.raise_for_status()
        return answer, seconds

    def settle(self) -> dict:
        """Wait for the job; returns the state."""
        while True:
            state = self.ask("/api/state")[0].json()
            if state["job"]["state"] not in ("running", "cancelling"):
                if state["job"]["state"] != "done":
                    raise SystemExit(f"the job {state['job']['state']}: {state['job']['error']}")
                return state
            time.sleep(0.1)


def first_charts(clicks: Clicks, sha: str, since: float) -> list[tuple[str, float]]:
    """What the page asks for as soon as a fit stands, each with the seconds from the last look at which it did not stand."""
    asked = {"the page's words": "/api/fitted?", "torque over time": "/api/window?joint=0&part=test&", "residual over position and speed": "/api/cloud?joint=0&part=test&", "the robot": "/api/film?part=test&"}
    out = []
    for name, path in asked.items():
        clicks.ask(f"{path}sha={sha}")
        out.append((name, time.perf_counter() - since))
    return out


def main() -> int:
    """Prints the table; 1 where a click is too slow."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--samples", type=int, default=1_000_000)
    words.add_argument("--repeat", type=int, default=15)
    words.add_argument("--whole", action="store_true", help="ask the whole vocabulary")
    given = words.parse_args()
    if not given.whole:
        every = candidates.candidates
        diagnosis.candidates = ask.candidates = lambda model, extra=(): [
            c for c in every(model, extra) if c.name in ASKED
        ]
    responsive()  # as `sysid studio` sets it
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        path = written(Path(folder), given.samples)
        print(f"{given.samples} samples of 6 joints written in {time.perf_counter() - start:.1f} s", flush=True)
        session = Session(path, Path(folder) / "run")
        clicks = Clicks(session)
        start = time.perf_counter()
        clicks.ask("/api/run", {})
        during, charts = [], None
        while session.worker.job.state == "running":
            last = time.perf_counter()
            answer, seconds = clicks.ask("/api/state")
            during.append(seconds)
            if charts is None and answer.json()["fitted"]:
                print(f"fitted in {time.perf_counter() - start:.1f} s", flush=True)
                charts = first_charts(clicks, answer.json()["sha"], last)
            time.sleep(0.25 if charts else 0.02)
        first = clicks.settle()["sha"]
        print(f"fitted and questioned in {time.perf_counter() - start:.1f} s", flush=True)
        start = time.perf_counter()
        second = clicks.ask("/api/add", {"sha": first, "finding": 0})[0].json()["sha"]
        previewed = []
        while session.worker.job.state == "running":
            during.append(clicks.ask("/api/state")[1])
            previewed.append(clicks.ask(f"/api/window?sha={first}&joint=1&part=test")[1])
            time.sleep(0.25)
        clicks.settle()
        print(f"an effect added, refitted and questioned in {time.perf_counter() - start:.1f} s", flush=True)
        view = clicks.ask(f"/api/view?sha={first}")[0].json()
        count = len(view["findings"])
        rows = {
            "page (frame)": "/", "view (all sections)": f"/api/view?sha={first}", "chart: torque": f"/api/figure?sha={first}&id=torque0", "chart: staircase": f"/api/figure?sha={first}&id=steps0",
            "chart: bodies": f"/api/figure?sha={first}&id=solids", "time, whole": f"/api/window?sha={first}&joint=3&part=train", "time, zoomed": f"/api/window?sha={first}&joint=3&part=train&from={{k}}&to={{l}}", "beside": f"/api/window?sha={second}&joint=1&part=train&beside=step:0",
            "dots": f"/api/cloud?sha={first}&joint=2&part=train", "robot": f"/api/film?sha={first}&part=train", "brush": f"/api/stretch?sha={first}&from={{k}}&to={{l}}",
            "compare steps": "/api/compare?from=0&to=1", "state": "/api/state",
        }  # fmt: skip
        times = {name: [clicks.ask(path.format(k=k % max(count, 1), l=20 + k))[1] for k in range(given.repeat)] for name, path in rows.items()}
        spent = {name: clicks.spent(path.format(k=0, l=20)) for name, path in rows.items()}
        times["undo (cached)"], times["redo (cached)"] = [], []
        for _ in range(given.repeat):
            times["undo (cached)"].append(clicks.ask("/api/undo", {"sha": second})[1])
            times["redo (cached)"].append(clicks.ask("/api/redo", {"sha": first})[1])
        times["state, while it works"], times["time, while it works"] = during, previewed
        slow = charts[-1][1] >= FIRST
        print("\nfrom the fit to its first charts, while the diagnosis is at work: " + ", ".join(f"{name} {seconds:.2f} s" for name, seconds in charts))
        print(f"\n{'click':<26}{'median':>10}{'worst':>10}{'processor':>12}   (ms; {given.repeat} times, while it works {len(during)} and {len(previewed)})")
        for name, own in times.items():
            over = float(np.median(own)) >= LIMIT or max(own) >= WORST
            slow += over
            print(f"{name:<26}{1000 * float(np.median(own)):>10.1f}{1000 * max(own):>10.1f}{1000 * spent[name] if name in spent else float('nan'):>12.1f}{'   TOO SLOW' if over else ''}")
        print(f"memory at most: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")
    return int(slow > 0)


if __name__ == "__main__":
    raise SystemExit(main())
