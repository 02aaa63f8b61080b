"""Commands killed at many moments of their run: nothing half-written, nothing of the user's lost,
nothing left behind, and the next run finds what an undisturbed one finds.

    python scripts/kill_study.py --moments 30 --changes all
    python scripts/kill_study.py --only fit,report --moments 100 --jobs 2

Two kinds of moments. `--moments N`: spread over the command's own time, measured first, half of
them over its last fifth, where files are written; the whole process group gets SIGKILL.
`--changes`: before each change of the file system in turn (opening to write, renaming, removing,
making a folder), where the process kills itself: those moments are hit whatever the clock does.

Each run starts from a fresh folder with a temporary folder, a home and a state folder of its own;
every second one has a run folder of another model, diagnosed. Prints a table, and exits with 1
where anything failed.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.kill_parts.commands import CLICKS, COMMANDS, Command  # noqa: E402

_PATIENCE = 180.0  # s for one run
#: keys of the JSON documents that may differ from run to run
VOLATILE = {"seconds", "run", "made", "of", "seal", "versions", "files"}

# kills itself before the change numbered by the environment; -1 counts them into a file
_WATCHED = """
import atexit, os, signal, sys
at, count = int(os.environ["KILL_AT"]), 0
def watch(event, given):
    global count
    changes = event in ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.truncate")
    if event == "open":
        changes = isinstance(given[2], int) and bool(given[2] & (os.O_WRONLY | os.O_RDWR))
    if not changes or str(given[0]).startswith(("/dev/", "/proc/")):
        return
    if count == at:
        os.kill(os.getpid(), signal.SIGKILL)
    count += 1
sys.addaudithook(watch)
if at < 0:
    atexit.register(lambda: (n := count) is None or open(os.environ["KILL_COUNT"], "w").write(str(n)))
"""


# ---- one trial


def made(root: Path) -> dict[str, Path]:
    """Folders to copy a trial from, by the kind of their logs; each has three arms."""
    from sysid import robot, robot_spec
    from tests import conftest
    from tests.conftest import CONFIG, ROTOR, URDF, csv, dump, logged, put

    out = {}
    for kind, seconds in (("short", 3.0), ("long", 14.0)):
        conftest.SECONDS = seconds
        for number, name in enumerate(("arm", "arm2", "arm3")):
            folder = root / kind / name
            folder.mkdir(parents=True)
            (folder / "robot.urdf").write_text(URDF)
            packed = ".gz" if kind == "long" else ""
            data = {"data.train": ["train.csv" + packed], "data.test": ["test.csv" + packed]}
            text = "# mine\n" + dump(put(CONFIG, data)) + "# to the end\n"
            (folder / "config.yaml").write_text(text)
            spec = robot_spec.RobotSpec(
                urdf=str(folder / "robot.urdf"), rotors=[robot_spec.RotorSpec.model_validate(ROTOR)]
            )
            for part, seed in (("train", 2 * number), ("test", 2 * number + 1)):
                text = csv(logged(robot.load(spec), seed))
                if packed:
                    import gzip

                    (folder / f"{part}.csv.gz").write_bytes(gzip.compress(text.encode(), 1))
                else:
                    (folder / f"{part}.csv").write_text(text)
        out[kind] = root / kind
    # another model of the same logs, fitted and diagnosed: what a run folder may hold
    other = shutil.copytree(out["short"], root / "other")
    config = other / "arm" / "config.yaml"
    config.write_text(config.read_text().replace("- coulomb", "- coulomb\n  - cogging"))
    run(Command(("report", "{0}/arm", "--out", "{0}/run")), other)
    out["fitted"] = shutil.copytree(out["short"], root / "fitted")
    shutil.copytree(other / "run", out["fitted"] / "run")
    return out


def started(command: Command, trial: Path, **more: str) -> subprocess.Popen:
    """A command in a session of its own, with a home, a state and a temporary folder of its own."""
    for name in ("home", "state", "tmp"):
        (trial / name).mkdir(exist_ok=True)
    own = {
        "HOME": str(trial / "home"), "XDG_STATE_HOME": str(trial / "state"),
        "XDG_CACHE_HOME": str(trial / "home"), "TMPDIR": str(trial / "tmp"),
        "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1",
        "MPLCONFIGDIR": tempfile.gettempdir(),
    }  # fmt: skip
    words = [word.format(trial) for word in command.words]
    quiet = [] if command.code == CLICKS else ["--quiet"]
    code = (_WATCHED if more else "") + command.code
    return subprocess.Popen(
        [sys.executable, "-c", code, *words, *quiet], cwd=trial, env={**os.environ, **own, **more},
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def run(command: Command, trial: Path, **more: str) -> str:
    """Run a command to its end; returns what went wrong, empty where nothing did."""
    work = started(command, trial, **more)
    said = work.communicate(timeout=_PATIENCE)[1].decode(errors="replace")
    return "" if work.returncode == 0 else f"exit {work.returncode}: {said.strip()[-300:]}"


def files(trial: Path) -> dict[str, Path]:
    """Every file and empty folder of a trial, by its path; not the home, and no locks."""
    kept = (p for p in trial.rglob("*") if p.is_file() or p.is_dir() and not any(p.iterdir()))
    own = {p.relative_to(trial).as_posix(): p for p in kept}
    return {n: p for n, p in own.items() if not n.startswith(("home", "state")) and n != "tmp"}


def whole(trial: Path) -> Iterator[str]:
    """What is not whole in a trial's folder; hidden files are not yet what they will be."""
    from sysid import pipeline

    for name, path in files(trial).items():
        if not path.is_file() or any(part.startswith(".") for part in name.split("/")):
            continue
        if name.startswith("tmp/"):
            continue
        try:
            if path.suffix == ".json":
                json.loads(path.read_text())
            elif path.suffix == ".parquet":
                import polars

                polars.read_parquet(path)
            elif path.suffix in (".urdf", ".xml"):
                from lxml import etree

                etree.fromstring(path.read_bytes())
            elif path.suffix == ".yaml" and path.name != "trajectory.yaml":
                pipeline.load(path)
            elif path.suffix == ".html" and not path.read_text().rstrip().endswith("</html>"):
                yield f"{name} is cut"
            elif path.suffix == ".csv" and not path.read_bytes().endswith(b"\n"):
                yield f"{name} is cut"
        except Exception as error:  # noqa: BLE001 - whatever a reader says of it
            yield f"{name}: {type(error).__name__} {str(error)[:100]}"


def told(trial: Path) -> dict:
    """What the documents of a trial say, without what may differ."""
    out = {}
    for name, path in files(trial).items():
        if path.suffix == ".json":
            found = json.loads(path.read_text().replace(str(trial), ""))
            out[name] = {k: v for k, v in found.items() if k not in VOLATILE}
    return out


def after(command: Command, trial: Path, reference: Path) -> Iterator[str]:
    """What is wrong after a kill, and after the next run."""
    config = trial / "arm" / "config.yaml"
    old, new = ((p / "arm" / "config.yaml").read_bytes() for p in (trial / ".old", reference))
    shutil.rmtree(trial / ".old")
    if (
        config.read_bytes() not in ((old,) if command.kept else (old, new))
        and command.code != CLICKS
    ):
        yield "the experiment file is neither the old nor the new"
    if not config.read_text().startswith("# mine\n") or "# to the end" not in config.read_text():
        yield "words of the user are lost"
    yield from whole(trial)
    config.write_bytes(old)
    (trial / "new" / "config.yaml").unlink(missing_ok=True)  # `init` writes over none
    begin = time.monotonic()
    if said := run(command, trial):
        yield f"the next run: {said}"
        return
    if time.monotonic() - begin > 60.0:
        yield "the next run waited for a lock"
    yield from (f"after the next run: {said}" for said in whole(trial))
    if config.read_bytes() != new:
        yield "the next run leaves another experiment"
    now, then = told(trial), told(reference)
    yield from (f"{n} differs" for n in now.keys() & then.keys() if now[n] != then[n])
    yield from (f"left behind: {n}" for n in sorted(files(trial).keys() - files(reference).keys()))
    yield from (f"missing: {n}" for n in sorted(files(reference).keys() - files(trial).keys()))


# ---- all of them


def study(name: str, kinds: dict[str, Path], root: Path, args) -> tuple[int, list[str]]:
    """Kill one command at all its moments; returns how many, and what went wrong."""
    command, rng = COMMANDS[name], random.Random(name)
    starts = [kinds[command.logs]]
    if command.logs == "short" and name not in ("design", "init", "simulate", "fleet", "bodies"):
        starts.append(kinds["fitted"])

    def fresh(label: str, k: int) -> Path:
        trial = shutil.copytree(starts[k], root / name / label)
        (trial / "old" / "arm").mkdir(parents=True)
        shutil.copy2(trial / "arm" / "config.yaml", trial / "old" / "arm")
        (trial / "old").rename(trial / ".old")
        return trial

    references, seconds, counts = [], [], []
    for k in range(len(starts)):
        references.append(trial := fresh(f"reference{k}", k))
        counted = root / name / f"count{k}"
        shutil.rmtree(trial / ".old")
        begin = time.monotonic()
        if said := run(command, trial, KILL_AT="-1", KILL_COUNT=str(counted)):
            return 0, [f"undisturbed: {said}"]
        seconds.append(time.monotonic() - begin)
        counts.append(int(counted.read_text()))
    late = lambda i: rng.uniform(0.8, 1.05) if i % 2 else rng.uniform(0.0, 1.05)  # noqa: E731
    moments = [(i // 2 % len(starts), "time", late(i)) for i in range(args.moments)]
    for k, count in enumerate(counts):
        every = (
            range(count)
            if args.changes == "all"
            else rng.sample(range(count), min(count, int(args.changes)))
        )
        moments += [(k, "change", at) for at in every]

    def one(number: int) -> list[str]:
        k, kind, at = moments[number]
        trial = fresh(f"{number}", k)
        if kind == "change":
            run(command, trial, KILL_AT=str(at))
        else:
            work = started(command, trial)
            try:
                work.communicate(timeout=at * seconds[k])
            except subprocess.TimeoutExpired:
                os.killpg(work.pid, signal.SIGKILL)
                work.communicate(timeout=60)
        label = f"{kind} {at:.3g}{' in a used folder' if k else ''}"
        wrong = [f"{label}: {said}" for said in after(command, trial, references[k])]
        shutil.rmtree(trial) if not wrong else None
        return wrong

    with ThreadPoolExecutor(args.jobs) as pool:
        found = list(pool.map(one, range(len(moments))))
    return len(moments), [one for wrong in found for one in wrong[:3]]


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--only", default=",".join(COMMANDS), help="commands, separated by commas")
    parser.add_argument("--moments", type=int, default=30, help="spread over the time of a run")
    parser.add_argument("--changes", default="all", help="changes of files: all, or how many")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="a folder for the trials that failed")
    args = parser.parse_args()
    root = Path(args.keep or tempfile.mkdtemp(prefix="kills-")).absolute()
    root.mkdir(parents=True, exist_ok=True)
    kinds, failed = made(root), 0
    for name in args.only.split(","):
        begin = time.monotonic()
        count, wrong = study(name, kinds, root, args)
        failed += len(wrong)
        print(f"{name:10} {count:5} moments {len(wrong):4} wrong {time.monotonic() - begin:6.0f} s")
        for line in wrong[:12]:
            print(f"    {line}")
        sys.stdout.flush()
    if not args.keep:
        shutil.rmtree(root, ignore_errors=True)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
