"""Files that are broken in every way, given to every reader: one line or a result, never a traceback, a hang or a full memory.

    python scripts/fuzz_readers.py --files 5000 --seed 1

Sound files of every format are broken at random: bytes changed, cut off, doubled, moved, put in the place of others; numbers
of a text or of a header made huge; packed bytes broken inside. Each is read in a process of its own, as a fit reads it, with
every column loaded. Prints what was found, and exits with 1 where anything was.
"""

from __future__ import annotations

import argparse
import bz2
import gzip
import lzma
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from scripts.fuzz_parts.breaking import broken  # noqa: E402

LONGEST, LARGEST = 20.0, 10**9  # s, bytes


@dataclass(frozen=True)
class Found:
    """What a broken file did: kind (traceback, hang, memory, death), what was said, the file."""

    kind: str
    said: str
    path: Path


# ---- sound files


def sound(folder: Path) -> None:
    """Write a small file of every format that is read into a folder. Run in a process of its own."""
    import numpy as np
    import polars as pl

    from tests import conftest, log_formats
    from tests.conftest import CONFIG, URDF, csv, dump, matrices, write_mat5, write_mat73

    t = np.arange(60) * 0.005
    rng = np.random.default_rng(0)
    columns = {"t": t} | {
        f"{s}_{j}": np.sin(3 * t + k) + 1e-3 * rng.normal(size=len(t))
        for k, (s, j) in enumerate((s, j) for s in ("q", "tau") for j in conftest.JOINTS)
    }
    texts = {
        "comma.csv": csv(columns),
        "semicolon.csv": csv(columns, separator=";"),
        "bare.csv": csv(columns, header=False),
        "tab.tsv": csv(columns, separator="\t"),
    }
    texts["aligned.txt"] = (
        "\n".join(
            "  ".join(f"{cell:>24}" for cell in line.split(","))
            for line in csv(columns).splitlines()
        )
        + "\n"
    )
    texts["quoted.csv"] = csv(columns).replace("t,", '"t","a, b",', 1).replace("\n", "\n1,", 1)
    texts |= {"robot.urdf": URDF, "config.yaml": dump(CONFIG)}
    for name, text in texts.items():
        (folder / name).write_text(text)
    frame = pl.DataFrame(columns)
    for kind in ("zstd", "snappy", "uncompressed", "gzip"):
        frame.write_parquet(folder / f"{kind}.parquet", compression=kind)
    pl.DataFrame(
        {
            "q": pl.Series([[1.0, 2.0]] * 60),
            "n": pl.Series(range(60), dtype=pl.Int128),
            "s": ["a"] * 60,
        }
    ).write_parquet(folder / "lists.parquet")
    np.savez(folder / "plain.npz", **columns)
    np.savez_compressed(folder / "packed.npz", **matrices(columns))
    write_mat5(folder / "v5.mat", columns)
    write_mat5(
        folder / "bare5.mat",
        {"log": {"q": [columns["q_elbow"][:3]] * 20, "t": t}},
        compressed=False,
    )
    write_mat73(
        folder / "v73.mat", {"a": columns["t"], "log": {"q": [columns["q_elbow"][:3]] * 20}}
    )
    log_formats.write_aloha(folder / "aloha.hdf5", columns)
    log_formats.write_droid(folder / "droid.h5", columns)
    log_formats.write_bag1(folder / "ros1.bag", columns)
    for storage in ("mcap", "sqlite3"):
        log_formats.write_bag2(folder / storage, columns, storage=storage)
    log_formats.write_lerobot(folder / "lerobot", [columns, columns], names=list(conftest.JOINTS))
    for ending, pack in ((".gz", gzip.compress), (".bz2", bz2.compress), (".xz", lzma.compress)):
        (folder / f"packed.csv{ending}").write_bytes(pack(texts["comma.csv"].encode()))


# ---- reading


def read(path: Path, kind: str) -> None:
    """Read a file as the commands do, and every column of it. Raises SysidError, or whatever is a finding."""
    from sysid import config, log, robot, urdf
    from sysid.errors import SysidError
    from sysid.log_spec import DataSpec, LogSpec
    from sysid.readers import open_table
    from sysid.robot_spec import RobotSpec

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind == ".urdf":
            urdf.read(path)
            robot.load(RobotSpec(urdf=str(path)))
            return
        if kind == ".yaml":
            config.load(path)
            return
        joints = ("shoulder", "elbow")
        try:
            log.read(LogSpec(file=str(path)), DataSpec(), joints, [False, False])
        except SysidError:
            pass
        table = open_table(path)
        for name in table.names:
            try:
                table.load([name])
            except SysidError:
                pass


def tried(path: Path, kind: str) -> Found | None:
    """Read a file in a process of its own; what was wrong with that, None where nothing was."""
    from sysid.errors import SysidError

    told, tell = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(told)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        status = 0
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        try:
            read(path, kind)
        except SysidError as error:
            status = 0 if "\n" not in str(error) else 3
            os.write(tell, str(error)[:200].encode(errors="replace") if status else b"")
        except BaseException as error:
            import traceback

            where = traceback.extract_tb(error.__traceback__)
            own = [f"{Path(f.filename).name}:{f.lineno}" for f in where if "sysid" in f.filename][
                -2:
            ]
            status = 3
            os.write(
                tell,
                f"{type(error).__name__}: {str(error)[:200]} at {', '.join(own)}".encode(
                    errors="replace"
                ),
            )
        os._exit(status)
    os.close(tell)
    until, done = time.monotonic() + LONGEST, 0
    while not done and time.monotonic() < until:
        done, status, used = os.wait4(child, os.WNOHANG)
        if not done:
            time.sleep(0.002)
    if not done:
        os.kill(child, signal.SIGKILL)
        _, status, used = os.wait4(child, 0)
    with os.fdopen(told, "rb") as pipe:
        said = pipe.read().decode(errors="replace")
    if not done:
        return Found("hang", f"more than {LONGEST:g} s", path)
    if used.ru_maxrss * 1024 > LARGEST:
        return Found("memory", f"{used.ru_maxrss / 1e6:.2f} GB", path)
    if os.WIFSIGNALED(status):
        return Found("death", signal.Signals(os.WTERMSIG(status)).name, path)
    return Found("traceback", said, path) if os.WEXITSTATUS(status) else None


def fuzz(files: int, seed: int, keep: Path, progress=None) -> tuple[Counter, list[Found]]:
    """Break and read files, in turn of every format; how many of each, and what was found (these files are kept)."""
    import sysid.config
    import sysid.log
    import sysid.robot  # noqa: F401 - what a child needs, loaded once; Polars' threads are begun by none but children

    keep.mkdir(parents=True, exist_ok=True)
    count, found = Counter(), []
    with tempfile.TemporaryDirectory() as made:
        seeds = Path(made)
        code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from scripts.fuzz_readers import sound; from pathlib import Path; sound(Path({made!r}))"
        subprocess.run([sys.executable, "-c", code], check=True)
        sources = sorted(seeds.iterdir())
        for number in range(files):
            rng = random.Random(f"{seed} {number}")
            source = sources[number % len(sources)]
            place = keep / f"{seed}-{number}-{source.name}"
            if source.is_dir():
                shutil.copytree(source, place)
                inner = rng.choice([p for p in sorted(place.rglob("*")) if p.is_file()])
                inner.write_bytes(broken(inner.read_bytes(), inner.name, rng))
            else:
                place.write_bytes(broken(source.read_bytes(), source.name, rng))
            wrong = tried(place, source.suffix)
            count[source.name] += 1
            if wrong:
                found.append(wrong)
            else:
                shutil.rmtree(place) if place.is_dir() else place.unlink()
            if progress:
                progress(number + 1, found)
    return count, found


def main() -> None:
    """Parse, fuzz, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--files", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--keep", type=Path, default=Path("fuzz"), help="the folder that holds what was found"
    )
    given = parser.parse_args()
    begun = time.monotonic()

    def progress(number: int, found: list[Found]) -> None:
        if number % 500 == 0:
            print(
                f"{number} of {given.files}, {len(found)} found, {time.monotonic() - begun:.0f} s",
                file=sys.stderr,
                flush=True,
            )

    count, found = fuzz(given.files, given.seed, given.keep, progress)
    for one in found:
        print(f"{one.kind}: {one.path.name}: {one.said}")
    print(
        f"{sum(count.values())} files of {len(count)} kinds, seed {given.seed}: {len(found)} findings, {time.monotonic() - begun:.0f} s"
    )
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
