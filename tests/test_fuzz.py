"""Files broken at random: one line or a result. `scripts/fuzz_readers.py` does this on thousands."""

import sys

import pytest

from scripts import fuzz_readers

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="measures a child's memory")


@pytest.mark.long
def test_what_is_broken_is_said_in_one_line(tmp_path):
    """In a process of its own: what forks must not have Polars' threads."""
    import subprocess

    command = [sys.executable, fuzz_readers.__file__, "--files", "81", "--seed", "11", "--keep", str(tmp_path / "kept")]
    done = subprocess.run(command, cwd=fuzz_readers.ROOT, capture_output=True, text=True)
    assert done.returncode == 0 and "81 files of 27 kinds, seed 11: 0 findings" in done.stdout, done.stdout + done.stderr


@pytest.mark.study
@pytest.mark.parametrize("seed", [3, 4])
def test_total_fuzz(tmp_path, seed):
    import subprocess

    command = [sys.executable, fuzz_readers.__file__, "--files", "5000", "--seed", str(seed), "--keep", str(tmp_path / "kept")]
    done = subprocess.run(command, cwd=fuzz_readers.ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("act", "kind"),
    [("raise ValueError('odd')", "traceback"), ("import time; time.sleep(9)", "hang"), ("held = bytearray(b'x') * 1_200_000_000", "memory"), ("import os; os.abort()", "death")],
)  # fmt: skip
def test_the_net_holds(tmp_path, act, kind):
    """What a reader must not do is found, where one does it."""
    import subprocess

    code = (
        "from pathlib import Path\nfrom scripts import fuzz_readers as f\n"
        # a busy machine may take seconds to hand out a gigabyte, which is no hang
        f"{'f.LONGEST = 3.0' if kind == 'hang' else ''}\n"
        f"def read(path, kind):\n    {act}\n"
        "f.read = read\nprint(f.tried(Path('x.csv'), '.csv').kind)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=fuzz_readers.ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == kind, done.stderr
