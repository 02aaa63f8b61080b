"""What `sysid diagnose` says of eight real robots, as a page: python scripts/real_logs.py --publish

The three public data sets of `sysid fetch` by the experiments in configs/, and five logs as labs have them, where the folder that
SYSID_DATA_DIR names holds them as experiment folders. Nothing of them is part of the project; what is not there is passed over.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
import time
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from sysid import comparison, pipeline, whole_files  # noqa: E402
from sysid.addition import grown  # noqa: E402
from sysid.diagnose.diagnosis import diagnose  # noqa: E402
from sysid.events import TOLD  # noqa: E402
from sysid.statement.document import document  # noqa: E402

#: name, experiment (a config, or a folder of the data), what its source and others know of it
ROBOTS = (
    ("EMPS", "configs/emps.yaml", "one sliding joint; the test log is disturbed by pulses of force on purpose"),
    ("UR10e", "configs/ur10e.yaml", "six joints, motor currents; the URDF has no motors"),
    ("Panda", "configs/panda.yaml", "seven joints, torque sensors behind the gears"),
    ("Kinova Gen3", "kinova", "seven joints, motor currents that spike for a sample or a few every 0.3 s; runs of 2 to 5 s"),
    ("KUKA KR300", "kr300", "six joints, strong pre-sliding and Stribeck friction, backlash, a counterbalance; stands much of the time"),
    ("Rokae xMate3Pro", "rokae", "seven joints, knocked at about 4.1, 8.2 and 16.5 s"),
    ("Schunk LWA4P", "schunk", "six joints, fifteen runs of 2 to 4 s; brakes close at rest, where the torque reads 0; all have pieces of one torque, sample by sample, under motions of their own"),
    ("ODrive motor", "odrive", "one bare motor turning slowly; static maps know a ripple of 7, 14 and 28 periods a turn"),
)


#: what the diagnosis before this one named (docs/findings.md) and this one may not
EARLIER = {"Panda": (("torque_gain", "panda_joint6"), ("cogging", "panda_joint7"), ("spring", "panda_joint6"))}


def earlier(name: str, fit) -> list[str]:
    """What each earlier claim does to the held-out error when it is added, one after the other."""
    lines = []
    for effect, joint in EARLIER.get(name, ()):
        after = pipeline.fit(grown(fit.experiment, effect, [joint], {}), filters=fit.filters)
        (change,) = [d for d in comparison.compare(fit, after, ("before", "after")) if d.joint == joint]
        lines.append(
            f"- `{effect}` on {joint}: RMS on the test logs {fit.rms('test')[joint]:.4g} → {after.rms('test')[joint]:.4g}, "
            f"a change of {change.delta_rms:.2g} ± {change.se:.1g}"
        )
        fit = after
    return lines


def path_of(place: str) -> Path:
    """A robot's experiment: a config of the project, or a folder of the data; it need not be there."""
    return (ROOT if place.startswith("configs/") else Path(os.environ.get("SYSID_DATA_DIR") or "nowhere")) / place


def looked_at(name: str, path: Path) -> dict:
    """The document of a diagnosis, with the seconds of CPU of fit and diagnosis."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        clock = [time.process_time()]
        experiment = pipeline.load(path)
        fit = pipeline.fit(experiment)
        clock.append(time.process_time())
        said = json.loads(json.dumps(document(diagnose(experiment, fit=fit))))
        clock.append(time.process_time())
    said["cpu"] = {"fit": clock[1] - clock[0], "diagnose": clock[2] - clock[1]}
    said["earlier"] = earlier(name, fit)
    said["fit_events"] = [dict(e) for e in fit.events]
    return {"robot": name, **said}


def told(found: dict, known: str) -> str:
    """One robot's section."""
    lines = [f"## {found['robot']}", "", known[0].upper() + known[1:] + ".", ""]
    lines += ["| joint | RMS train | RMS test | noise floor | verdict |", "|---|---:|---:|---:|---|"]
    by = {v["joint"]: v for v in found["verdict"]}
    for joint, entry in found["joints"].items():
        floor = "not known" if entry["noise_floor"] is None else f"{entry['noise_floor']:.3g} ± {entry['noise_floor_se']:.1g}"
        lines.append(f"| {joint} | {entry['rms']['train']:.4g} | {entry['rms']['test']:.4g} | {floor} | {_verdict(by[joint])} |")
    heads = [f for f in found["findings"] if f["joins_as_step"]]
    if heads:
        lines += ["", "Claims, each fitted as `sysid add` fits it, in the order in which they joined:", ""]
        for f in heads:
            values = ", ".join(
                f"{name.split('.')[-1]} = {p['value']:.3g}" + (f" ± {p['std']:.1g}" if p["std"] is not None else "") + f" {p['unit']}"
                for name, p in f["parameters"].items() if p["value"] is not None
            )  # fmt: skip
            options = "".join(f", {name}: {value}" for name, value in f["options"].items())
            lines.append(f"- `{f['effect']}` on {f['joint']}{options}: RMS on the test logs {f['rms_test_before']:.4g} → {f['rms_test_after']:.4g}; {values}")
    if found["not_claimed"]:
        lines += ["", "Looked at and not claimed:", "", *(f"- `{n['effect']}` on {n['joint']}: {n['why']}" for n in found["not_claimed"])]
    if found["earlier"]:
        lines += ["", "What docs/findings.md claims, each added after the one before:", "", *found["earlier"]]
    if said := [f"- {v['joint']}: {v['says']}" for v in found["verdict"] if v.get("says")]:
        lines += ["", "Of single joints:", "", *said]
    lines += ["", _events(found["fit_events"]), "", f"CPU: fit {found['cpu']['fit']:.1f} s, diagnosis {found['cpu']['diagnose']:.1f} s."]
    return "\n".join(lines)


def _verdict(v: dict) -> str:
    words = v["status"]
    if v.get("effect"):
        words += f": `{v['effect']}`" + "".join(f", `{e}`" for e in dict.fromkeys(v.get("also", [])) if e != v["effect"])
        rest = [f"{s['effect']} on {s['joint']} {100 * s['probability']:.0f} %" for s in v["set"][1:] if s["probability"] >= 0.05]
        words += f" ({100 * v['set'][0]['probability']:.0f} %; or {', '.join(rest)})" if rest else ""
    elif v.get("also"):
        words += f", part of it `{'`, `'.join(v['also'])}`"
    if v["status"] == "explained":
        words += " by " + ", ".join(f"`{b['effect']}` on {b['joint']}" for b in v["by"])
    if v["status"] == "unknown" and v.get("depends_on"):
        words += "; follows " + ", ".join(dict.fromkeys(d["variable"] for d in v["depends_on"][:3]))
    return words


def _events(events: list[dict]) -> str:
    if not events:
        return "No event was found."
    counts: dict[tuple, list] = {}
    for e in events:
        counts.setdefault((e["part"], e["kind"]), []).append(e)
    words = []
    for (part, kind), own in counts.items():
        shown = ", ".join(f"{e['log']} {e['start']:.2f} s" for e in own[:3]) + (", ..." if len(own) > 3 else "")
        stays = f", {TOLD[kind]}," if kind in TOLD else ""
        words.append(f"{len(own)} {kind}{stays} in the {part} logs ({shown})")
    return "Events, left out: " + "; ".join(words) + "."


def main() -> None:
    """Run what is there, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/real_logs"))
    parser.add_argument("--only", action="append", default=[], choices=[name for name, *_ in ROBOTS])
    parser.add_argument("--publish", action="store_true", help="write docs/real_logs.md too")
    options = parser.parse_args()
    parts = []
    for name, place, known in ROBOTS:
        if options.only and name not in options.only:
            continue
        path = path_of(place)
        if not path.exists():
            print(f"{name}: not there", file=sys.stderr)
            continue
        found = looked_at(name, path)
        parts.append(told(found, known))
        print(parts[-1], flush=True)
    head = (
        "# Eight real robots\n\nWritten by `python scripts/real_logs.py --publish`; nothing in it is edited by hand, and nothing in the code knows "
        "these logs.\nRMS in N m (EMPS: N). What is left out as disturbed, or about reversals and standstill, counts neither in the fit nor in the error."
    )
    page = "\n\n".join([head, *parts]) + "\n"
    for folder in [whole_files.folder(options.out), *([ROOT / "docs"] if options.publish else [])]:
        whole_files.write_atomically(folder / "real_logs.md", lambda p: p.write_text(page, encoding="utf-8"))


if __name__ == "__main__":
    main()
