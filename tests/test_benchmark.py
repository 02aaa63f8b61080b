"""What a benchmark reads off a process."""

import sys

from scripts.scale_parts.processes import run


def test_peak_memory_is_that_of_the_process_measured():
    """Not of the one that starts it, whose peak a child takes over."""
    own = bytearray(300_000_000)
    _, peak, _ = run([sys.executable, "-S", "-c", "held = bytearray(50_000_000)"])
    assert len(own) > 2e8 and 5e7 < peak < 1.5e8


def test_what_a_measured_process_says_is_kept():
    said = []
    wall, _, spent = run([sys.executable, "-S", "-c", "import sys; sys.stderr.write('it is 7')"], said)
    assert said == ["it is 7"] and wall > 0.0 and spent > 0.0
