"""The commands that are killed: what runs, where, and what must stay as it is."""

from __future__ import annotations

from dataclasses import dataclass

_PLAIN = "from sysid.cli import main; main()"
_SHORT_SPANS = "from sysid import spans; spans.SPAN = 1100; " + _PLAIN
# what clicks do: a stretch masked, an effect added, and taken back
CLICKS = """
import sys
from pathlib import Path
from tests.test_studio import studio
page = studio(Path(sys.argv[1]), Path(sys.argv[sys.argv.index("--out") + 1]))
mask = {"part": "train", "from": 0.5, "to": 0.9, "joint": None}
bias = {"effect": "torque_bias", "joint": "elbow"}
for what, body in (("add", {"mask": mask}), ("add", bias), ("undo", {})):
    said = page.post("/api/" + what, sha=page.sha, **body)
    if said.status_code != 200:
        sys.exit(said.text)
    page.wait()
"""


@dataclass(frozen=True)
class Command:
    """Words of the command line, {0} being the trial's folder; `code` runs them. `kept` experiments
    stay as they are; `logs` is the kind that stands there."""

    words: tuple[str, ...]
    code: str = _PLAIN
    kept: bool = True
    logs: str = "short"


COMMANDS = {
    "fit": Command(("fit", "{0}/arm", "--out", "{0}/run")),
    "fit_long": Command(("fit", "{0}/arm", "--out", "{0}/run"), _SHORT_SPANS, logs="long"),
    "add": Command(("add", "{0}/arm", "torque_bias", "--force", "--out", "{0}/run"), kept=False),
    "discover": Command(("discover", "{0}/arm", "--max-steps", "1", "--out", "{0}/run")),
    "diagnose": Command(("diagnose", "{0}/arm", "--out", "{0}/run")),
    "report": Command(("report", "{0}/arm", "--out", "{0}/run")),
    "bodies": Command(("study", "bodies", "--bodies", "40", "--jobs", "1", "--out", "{0}/run")),
    "restarts": Command(("study", "restarts", "{0}/arm", "--restarts", "3", "--out", "{0}/run")),
    "design": Command(
        ("design", "{0}/arm", "--duration", "4", "--processes", "1", "--out", "{0}/motion")
    ),
    "fleet": Command(("fleet", "{0}/arm", "{0}/arm2", "{0}/arm3", "--out", "{0}/fleet")),
    "init": Command(
        ("init", "{0}/arm/robot.urdf", "{0}/arm/train.csv", "{0}/arm/test.csv", "--out", "{0}/new")
    ),
    "export": Command(("export", "{0}/run", "--to", "mjcf", "--out", "{0}/mjcf"), logs="fitted"),
    "simulate": Command(("simulate", "{0}/arm", "--duration", "2", "--force", "--out", "{0}/sim")),
    "studio": Command(("{0}/arm", "--out", "{0}/run"), CLICKS, kept=False),
}
