"""The faults that are planted in a log, each under the name that `sysid check` has for it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import polars as pl

#: faults that the simulation makes itself
MADE = {
    "spikes": {"spikes": 0.3},
    "knock": {"knocks": 3},
    "brake_closed": {"motion": "moves", "brakes": True},
    "clock_jitter": {"rate": 100.0, "jitter": 2.0},
}


class Planted:
    """A folder's logs as tables, to be spoiled. joint: the one that a fault is planted on."""

    def __init__(self, folder: Path, joints, rng):
        self.folder, self.joints, self.rng = folder, list(joints), rng
        self.tables = {file: pl.read_csv(file) for file in sorted(folder.glob("*.csv"))}
        self.joint = self.joints[int(rng.integers(len(self.joints)))]

    def column(self, name: str, change, part: str = "") -> None:
        for file, table in self.tables.items():
            if part in file.name:
                self.tables[file] = table.with_columns(
                    pl.Series(name, change(table[name].to_numpy().copy()))
                )

    def rows(self, keep) -> None:
        self.tables = {
            file: table.filter(
                pl.Series(np.isin(np.arange(len(table)), np.arange(len(table))[keep(table)]))
            )
            for file, table in self.tables.items()
        }

    def robot(self, change) -> None:
        file = self.folder / "robot.urdf"
        file.write_text(change(file.read_text()))

    def most(self, name: str) -> float:
        return max(float(np.abs(table[name].to_numpy()).max()) for table in self.tables.values())

    def save(self) -> None:
        for file, table in self.tables.items():
            table.write_csv(file)


def _joint_element(text: str, joint: str, change) -> str:
    return re.sub(
        rf'(<joint name="{re.escape(joint)}".*?</joint>)',
        lambda m: change(m[1]),
        text,
        flags=re.DOTALL,
    )


def _limited(element: str, **values) -> str:
    kept = dict(re.findall(r'(\w+)="([^"]*)"', (re.search(r"<limit[^>]*/>", element) or [""])[0]))
    limit = (
        "<limit "
        + " ".join(
            f'{k}="{v}"'
            for k, v in {
                "lower": "-9",
                "upper": "9",
                "effort": "0",
                "velocity": "0",
                **kept,
                **values,
            }.items()
        )
        + "/>"
    )
    return re.sub(r"<limit[^>]*/>", "", element).replace("</joint>", f"{limit}</joint>")


def angle_wrap(p: Planted):
    middle = float(np.median(next(iter(p.tables.values()))[f"q_{p.joint}"].to_numpy()))
    p.column(f"q_{p.joint}", lambda q: np.mod(q - middle, 2.0 * np.pi))


def joint_order(p: Planted):
    one, other = p.rng.choice(len(p.joints), 2, replace=False)
    kind = p.rng.choice(["tau", "q", "both"])
    names = {
        f"{k}_{p.joints[a]}": f"{k}_{p.joints[b]}"
        for a, b in ((one, other), (other, one))
        for k in (("tau", "q") if kind == "both" else (kind,))
    }
    p.tables = {file: table.rename(names).select(table.columns) for file, table in p.tables.items()}
    p.joint = (p.joints[one], p.joints[other])


def sign_flipped(p: Planted):
    p.column(f"{p.rng.choice(['tau', 'q'])}_{p.joint}", np.negative)


def wrong_unit(p: Planted):
    which = p.rng.choice(["deg", "ms", "mNm"])
    if which == "deg":
        p.column(f"q_{p.joint}", np.degrees)
    elif which == "ms":
        p.column("t", lambda t: 1e3 * t)
        p.joint = ""
    else:
        for joint in p.joints:
            p.column(f"tau_{joint}", lambda tau: 1e3 * tau)
        p.joint = tuple(p.joints)


def torque_in_amperes(p: Planted):
    for joint in p.joints:
        constant = p.rng.uniform(6.0, 40.0)
        p.column(f"tau_{joint}", lambda tau, constant=constant: tau / constant)
    p.joint = tuple(p.joints)


def commanded_torque(p: Planted):
    """A command that asks for more than the drive gives, which is what moves the arm."""
    most = p.most(f"tau_{p.joint}")
    more = p.rng.uniform(1.5, 4.0)
    p.column(
        f"tau_{p.joint}",
        lambda tau: tau + more * np.sign(tau) * np.maximum(np.abs(tau) - 0.5 * most, 0.0),
    )
    p.robot(
        lambda text: _joint_element(
            text, p.joint, lambda e: _limited(e, effort=f"{1.05 * most:.6g}")
        )
    )


def effort_missing(p: Planted):
    p.column(f"tau_{p.joint}", np.zeros_like)


def values_held(p: Planted):
    name = f"{p.rng.choice(['tau', 'q'])}_{p.joint}"

    def held(values):
        speed = np.abs(np.gradient(values))
        for _ in range(3):
            long = int(p.rng.uniform(0.15, 0.4) / p.step)
            moving = np.flatnonzero(speed[: -long - 1] > np.median(speed))
            first = int(p.rng.choice(moving))
            values[first : first + long] = values[first]
        return values

    p.column(name, held)


def clock_gap(p: Planted):
    def keep(table):
        t = table["t"].to_numpy()
        start = p.rng.uniform(0.3, 0.7) * t[-1]
        return (t < start) | (t > start + p.rng.uniform(0.3, 2.0))

    p.rows(keep)
    p.joint = ""


def delayed_signal(p: Planted):
    late = p.rng.choice([-1, 1]) * p.rng.uniform(0.01, 0.04)
    count = round(late / p.step)
    p.column(f"tau_{p.joint}", lambda tau: np.roll(tau, count))
    p.rows(lambda table: np.arange(len(table))[abs(count) : len(table) - abs(count)])


def saturation(p: Planted):
    top = p.rng.uniform(0.5, 0.8) * p.most(f"tau_{p.joint}")
    p.column(f"tau_{p.joint}", lambda tau: np.clip(tau, -top, top))


def coarse_values(p: Planted):
    if p.rng.uniform() < 0.5:
        grain = p.rng.uniform(0.02, 0.05) * p.most(f"tau_{p.joint}")
        p.column(f"tau_{p.joint}", lambda tau: grain * np.round(tau / grain))
    else:
        grain = 2.0 * np.pi / 2 ** p.rng.uniform(9.0, 11.5)
        p.column(f"q_{p.joint}", lambda q: grain * np.round(q / grain))


def standstill(p: Planted):
    """Every log waits for three times its length before it begins."""
    for file, table in p.tables.items():
        wait = 3 * len(table)
        first = {name: np.full(wait, table[name][0]) for name in table.columns}
        first["t"] = p.step * np.arange(wait)
        first |= {
            name: v + 0.01 * p.most(name) * p.rng.standard_normal(wait)
            for name, v in first.items()
            if name.startswith("tau")
        }
        rest = table.with_columns(pl.col("t") - table["t"][0] + p.step * wait)
        p.tables[file] = pl.concat([pl.DataFrame(first).cast(table.schema), rest])
    p.joint = tuple(p.joints)


def slow_logger(p: Planted):
    every = max(2, round(p.rng.uniform(0.04, 0.08) / p.step))
    p.rows(lambda table: np.arange(0, len(table), every))
    p.joint = ""


def test_is_train(p: Planted):
    p.save()
    shutil.copy(p.folder / "train.csv", p.folder / "test.csv")
    p.tables, p.joint = {}, ""


def not_excited(p: Planted):
    p.column(
        f"q_{p.joint}",
        lambda q: (
            np.median(q) + 0.01 * p.rng.standard_normal() + 1e-5 * p.rng.standard_normal(len(q))
        ),
    )


def limit_exceeded(p: Planted):
    q = np.concatenate([table[f"q_{p.joint}"].to_numpy() for table in p.tables.values()])
    if p.rng.uniform() < 0.5:
        low, high = np.median(q) - 0.6 * np.ptp(q), np.quantile(q, 0.8)
        p.robot(
            lambda text: _joint_element(
                text,
                p.joint,
                lambda e: _limited(
                    e.replace("continuous", "revolute"), lower=f"{low:.6g}", upper=f"{high:.6g}"
                ),
            )
        )
    else:
        top = 0.6 * max(
            float(np.abs(np.gradient(table[f"q_{p.joint}"].to_numpy(), p.step)).max())
            for table in p.tables.values()
        )
        p.robot(
            lambda text: _joint_element(text, p.joint, lambda e: _limited(e, velocity=f"{top:.6g}"))
        )


def mass_implausible(p: Planted):
    """The URDF's heaviest moving link is twelve times as heavy or as light, its inertia too; told on any joint that carries it."""
    times = p.rng.choice([1.0 / 12.0, 12.0])

    def heavier(match):
        return match[1] + re.sub(
            r'(value|i[xyz][xyz])="([^"]+)"',
            lambda m: f'{m[1]}="{times * float(m[2]):.9g}"',
            match[2],
        )

    def change(text):
        child = {
            j: re.search(rf'<joint name="{re.escape(j)}".*?<child link="([^"]+)"', text, re.DOTALL)[
                1
            ]
            for j in p.joints
        }
        mass = {
            link: float(
                re.search(
                    rf'<link name="{re.escape(link)}">.*?<mass value="([^"]+)"', text, re.DOTALL
                )[1]
            )
            for link in child.values()
        }
        most = re.escape(max(mass, key=mass.get))
        return re.sub(
            rf'(<link name="{most}">.*?)(<inertial>.*?</inertial>)',
            heavier,
            text,
            count=1,
            flags=re.DOTALL,
        )

    p.robot(change)
    p.joint = tuple(p.joints)
