"""Groups of logs: three payloads and an empty arm in one fit, friction per robot. The fit is held
against a dense problem over all logs at once, whose columns are put together here."""

import json
import warnings

import numpy as np
import pytest

import sysid
from sysid import config, experiment_logs, pipeline, regressor
from sysid.carried import BALL, WEAK
from sysid.errors import SysidError
from sysid.inertia import DIVERGENCES
from sysid.inertia.consistency import is_consistent
from sysid.inertia.pseudo import PSEUDO_BASIS, to_pseudo
from sysid.vocabulary import find
from tests.grouped import JOINTS, MASS, NOISE, ROUGH, experiment, tree, waved


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return experiment(tmp_path_factory.mktemp("groups"))


@pytest.fixture(scope="module")
def fitted(folder):
    return sysid.fit(sysid.load(folder))


@pytest.fixture(scope="module")
def run(folder, fitted):
    return folder / "run", sysid.write(fitted, folder / "run")


def value(found, name: str) -> tuple[float, float]:
    at = found.model.names.index(name)
    return float(found.x[at]), float(found.uncertainty.std[at])


# ---- what is found


def test_three_payloads_and_an_empty_arm(fitted):
    for level in ("one", "two", "three"):
        mass, std = value(fitted, f"payload.*.m[{level}]")
        assert abs(mass / MASS[level] - 1.0) < 0.02 and abs(mass - MASS[level]) < 4.0 * std
    assert "payload.*.m[none]" not in fitted.model.names
    for joint in JOINTS:
        for level, true in (("r1", 0.4), ("r2", 0.4 * ROUGH)):
            found, std = value(fitted, f"viscous.{joint}.Fv[{level}]")
            assert abs(found - true) < 4.0 * std
        more, std = fitted.difference(f"viscous.{joint}.Fv", "r1", "r2")
        assert abs(more - 0.4 * (ROUGH - 1.0)) < 4.0 * std and more > 10.0 * std
        np.testing.assert_allclose(
            fitted.difference(f"viscous.{joint}.Fv", "r2", "r1"), (-more, std), rtol=1e-9
        )
    assert max(fitted.rms("test").values()) < 1.1 * NOISE and fitted.certificate.globally_optimal


def dense(fitted):
    """Columns (rows, size) and torque of all training logs, a block a log: those of one robot,
    placed where its levels have theirs."""
    model, groups = fitted.model, fitted.experiment.data.groups
    machine, first = model.robot, 10 * model.bodies
    plain = {
        name: find(name).bound(machine, -1 if name == "payload" else 0)
        for name in ("viscous", "coulomb", "payload")
    }
    motion = pipeline.prepare(
        experiment_logs.read(fitted.experiment, machine, fitted.experiment.data.train),
        fitted.experiment.preprocess,
        machine.joints,
    )
    blocks, torque = [], []
    for piece, log in zip(motion.pieces, fitted.experiment.data.train):
        at = {
            group: level
            for group, levels in groups.items()
            for level, logs in levels.items()
            if log in logs
        }
        n = len(piece.t)
        out = np.zeros((machine.dof, n, model.size))
        out[:, :, :first] = np.moveaxis(
            regressor.regressor(machine, piece.q, piece.qd, piece.qdd), 1, 0
        )
        for j, joint in enumerate(JOINTS):
            out[j, :, model.names.index(f"viscous.{joint}.Fv[{at['robot']}]")] = plain[
                "viscous"
            ].columns(piece, j)[0]
            out[j, :, model.names.index(f"coulomb.{joint}.Fc")] = plain["coulomb"].columns(
                piece, j
            )[0]
        if at["payload"] != "none":
            own = [
                k
                for k, name in enumerate(model.names)
                if name.startswith("payload.") and name.endswith(f"[{at['payload']}]")
            ]
            out[:, :, own] = np.moveaxis(plain["payload"].columns(piece, machine), 1, 2)
        blocks.append(out.reshape(-1, model.size))
        torque.append(piece.tau.T.ravel())
    return np.concatenate(blocks), np.concatenate(torque)


def test_it_is_the_joint_dense_solution(folder):
    """With a Euclidean prior and free bodies the whole is least squares, which NumPy solves on all
    rows at once."""
    given = tree(prior={"divergence": "euclidean", "weight": 0.5})
    given["model"]["inertia"] = "linear"
    found = sysid.fit(config.experiment(given, folder / "config.yaml"))
    columns, torque = dense(found)
    bodies, size = found.prior.size, found.model.size
    weight = np.sqrt(0.5 * 0.5) * np.eye(bodies, size)
    system = np.concatenate([columns, weight])
    scale = np.linalg.norm(system, axis=0)
    x = (
        np.linalg.lstsq(
            system / scale,
            np.concatenate([torque, weight[:, :bodies] @ found.prior.ravel()]),
            rcond=None,
        )[0]
        / scale
    )
    assert np.max(np.abs(found.x - x)) <= 1e-9 * np.max(np.abs(x))


def test_the_barrier_s_optimum_is_the_dense_one(fitted):
    """With the log-det prior Newton's method on the dense objective stays where the fit is: in what
    the logs see, and in parameters that the prior alone holds as far as an objective in double
    precision tells where its minimum is."""
    columns, torque = dense(fitted)
    spec, x = fitted.experiment.prior, np.array(fitted.x)
    gram, right = 2.0 * columns.T @ columns, 2.0 * columns.T @ torque
    divergence, count = DIVERGENCES[spec.divergence](fitted.prior), fitted.prior.size
    # what is carried is a body too: of its prior, and of the noise, by least squares
    first = 10 * fitted.model.bodies
    places = [first + k for k, c in enumerate(fitted.model.coefficients) if c.of_body]
    rest = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    weight = WEAK * (rest @ rest) / (len(torque) - len(x))
    payload = DIVERGENCES[spec.divergence](BALL)
    for _ in range(20):
        slope, bend = gram @ x - right, np.array(gram)
        for own in np.reshape(places, (-1, 10)):
            slope[own] += weight * payload.gradient(x[own])
            bend[np.ix_(own, own)] += weight * payload.hessian(x[own])
        slope[:count] += (
            spec.weight * np.asarray(divergence.gradient(x[:count].reshape(-1, 10))).ravel()
        )
        for b, own in enumerate(
            spec.weight * np.asarray(divergence.hessian(x[:count].reshape(-1, 10)))
        ):
            bend[10 * b : 10 * b + 10, 10 * b : 10 * b + 10] += own
        scale = np.sqrt(np.diagonal(bend))
        x -= np.linalg.solve(bend / np.outer(scale, scale), slope / scale) / scale
    assert np.max(np.abs(columns @ (fitted.x - x))) <= 1e-9 * np.max(np.abs(torque))
    assert np.max(np.abs(fitted.x - x)) <= 1e-7 * np.max(np.abs(x))


def test_bodies_that_are_shared_are_known_better_than_from_any_log_alone(folder, fitted):
    """Every parameter that a log tells by itself. Of the last link, which the payloads hide in all
    logs but the empty arm's, the others say little: there it is so on the whole."""
    count = 20
    for level in MASS:
        given = tree(
            ["viscous", "coulomb"],
            data={"train": [f"{level}_train.csv"], "test": [f"{level}_test.csv"]},
        )
        alone = sysid.fit(config.experiment(given, folder / "config.yaml")).uncertainty
        share = fitted.uncertainty.std[:30] / alone.std[:30]
        told = alone.from_data[:30] > 0.5
        assert told[:count].any() and np.all(share[:count][told[:count]] < 0.9), level
        if level == "none":
            assert told[count:].sum() >= 4 and np.mean(np.log(share[count:][told[count:]])) < 0.0


# ---- what is said of it


def test_the_document_says_each_level_and_the_differences(run, fitted):
    _, document = run
    json.dumps(document, allow_nan=False)
    assert list(document["groups"]) == ["payload", "robot"]
    robot = document["groups"]["robot"]
    assert robot["levels"]["r1"] == [
        "none_train.csv",
        "two_train.csv",
        "none_test.csv",
        "two_test.csv",
    ]
    own = {p["parameter"]: p for p in robot["parameters"]}
    assert list(own) == [f"viscous.{joint}.Fv" for joint in JOINTS]
    for name, p in own.items():
        entry = {q["name"]: q for q in document["parameters"]}
        for level in ("r1", "r2"):
            assert (
                p["levels"][level]["value"] == entry[f"{name}[{level}]"]["value"]
                and p["levels"][level]["std"] == entry[f"{name}[{level}]"]["std"]
            )
        (d,) = p["differences"]
        assert (d["from"], d["to"]) == ("r1", "r2") and (d["value"], d["std"]) == fitted.difference(
            name, "r1", "r2"
        )
        assert abs(p["between"] - abs(d["value"]) / np.sqrt(2.0)) < p["within"]
    assert [d["to"] for d in document["groups"]["payload"]["parameters"][0]["differences"]] == [
        "two",
        "three",
    ]


def test_the_run_folder_gives_the_same_fit_and_torque_again(run, fitted):
    out, _ = run
    again = sysid.fit(sysid.load(out / "experiment.yaml"))
    np.testing.assert_allclose(again.x, fitted.x, rtol=1e-12)
    found = sysid.read_run(out)
    assert found.omitted == () and "RMS" in repr(found)
    _, q, qd, qdd = waved(99, 0.2)
    pi, fv = (
        np.array(fitted.pi),
        np.array([value(fitted, f"viscous.{j}.Fv[r2]")[0] for j in JOINTS]),
    )
    at = fitted.model.names.index("payload.*.m[three]")
    pi[-1] += fitted.x[at : at + 10]
    fc = np.array([value(fitted, f"coulomb.{j}.Fc")[0] for j in JOINTS])
    expected = regressor.torque(fitted.model.robot, pi, q, qd, qdd) + fv * qd + fc * np.sign(qd)
    levels = {"robot": "r2", "payload": "three"}
    np.testing.assert_allclose(
        found.torque(q, qd, qdd, levels=levels), expected, rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(
        found.torque(q[3], qd[3], qdd[3], levels=levels), expected[3], rtol=1e-9, atol=1e-9
    )
    for wrong, said in (
        (None, "viscous is per robot, and no level"),
        ({"robot": "r1"}, "payload is per payload"),
        ({**levels, "robot": "r3"}, "no level 'r3'"),
        ({**levels, "day": "1"}, "per 'day'"),
    ):
        with pytest.raises(SysidError, match=said) as caught:
            found.torque(q, qd, qdd, **({} if wrong is None else {"levels": wrong}))
        assert "\n" not in str(caught.value)
    text = (out / "identified.yaml").read_text()
    assert text.startswith(
        "# payload.*.m [kg] per payload, in brackets the difference from one: one 0.6"
    )
    assert (
        "\n# viscous.shoulder.Fv [N m s/rad] per robot, in brackets the difference from r1: r1 0."
        in text
    )
    urdf = (out / "identified.urdf").read_text()
    assert (
        "viscous.elbow: Fv[r2] = " in urdf
        and "payload.*: m[one] = " in urdf
        and 'damping="0.0"' in urdf
    )


def test_another_log_is_predicted_at_the_levels_that_are_given(folder, fitted):
    one = sysid.predict(fitted, "three_test.csv")
    stem = folder / "elsewhere.csv"
    stem.write_text((folder / "three_test.csv").read_text())
    with pytest.raises(SysidError, match="per robot, and no level"):
        sysid.predict(fitted, str(stem))
    other = sysid.predict(fitted, str(stem), levels={"robot": "r2", "payload": "three"})
    np.testing.assert_array_equal(one.predicted, other.predicted)
    stem.unlink()


def test_commands(folder, cli, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    said = cli("fit", folder, "--out", tmp_path / "run")
    assert said.status == 0
    assert (
        "per robot, +- one standard deviation:" in said.out
        and " from r1, " in said.out
        and "payload.*.m [kg]" in said.out
    )
    level = ("--level", "robot=r1", "--level", "payload=two")
    assert cli("export", tmp_path / "run", "--to", "mjcf").status == 2
    done = cli("export", tmp_path / "run", "--to", "mjcf", *level, "--json")
    assert (
        done.status == 0
        and json.loads(done.out)["checked"]["agrees"]
        and not json.loads(done.out)["left_out"][1:]
    )
    held_model = ("diagnose", folder, "--model", tmp_path / "run", "--log", folder / "two_test.csv")
    for wrong, words in (
        ((), "per robot"),
        (("--level", "robot"), "GROUP=LEVEL"),
        (("--level", "robot=r1", "--level", "payload=four"), "no level 'four'"),
    ):
        failed = cli(*held_model, *wrong)
        assert failed.status == 2 and words in failed.err and failed.err.count("\n") == 1
    done = cli(*held_model, *level, "--json")
    assert done.status == 0 and json.loads(done.out)["findings"] == []


# ---- a payload is a body


@pytest.fixture(scope="module")
def briefly(folder):
    """Fits of an empty arm and of a second with a payload, by the name of the prior's divergence."""

    def fit(divergence):
        given = tree(prior={"divergence": divergence, "weight": 1e-3})
        given["data"] |= {
            "train": ["none_train.csv", {"file": "one_train.csv", "stop": 1.0}],
            "test": ["one_test.csv"],
            "groups": {
                "payload": {"none": ["none_*.csv"], "one": ["one_*.csv"]},
                "robot": {"r1": ["none_*.csv"], "r2": ["one_*.csv"]},
            },
        }
        return sysid.fit(config.experiment(given, folder / "config.yaml"))

    return {divergence: fit(divergence) for divergence in ("log-det", "pullback")}


@pytest.mark.parametrize("divergence", ["log-det", "pullback"])
def test_a_payload_is_a_possible_body(briefly, divergence):
    """Where least squares make it an impossible one, it is the best of the possible: by cvxpy and
    Clarabel."""
    import cvxpy as cp

    found = briefly[divergence]
    count, size = 10 * found.model.bodies, found.model.size
    own = [count + k for k, c in enumerate(found.model.coefficients) if c.of_body]
    triangle = found.compressed.total()
    free = np.linalg.lstsq(triangle[:, :-1], triangle[:, -1], rcond=None)[0]
    assert not is_consistent(free[own]) and is_consistent(found.x[own])
    assert found.physically_consistent and found.certificate.globally_optimal
    mass, std = value(found, "payload.*.m[one]")
    assert abs(mass - MASS["one"]) < 3.0 * std

    weight = WEAK * triangle[-1, -1] ** 2 / (found.compressed.rows.sum() - size)
    bodies = [
        *((slice(10 * b, 10 * b + 10), prior, 1e-3) for b, prior in enumerate(found.prior)),
        (own, BALL, weight),
    ]
    x, terms, constraints = cp.Variable(size), [], []
    for places, prior, scale in bodies:
        body = sum(x[places][k] * PSEUDO_BASIS[k] for k in range(10))
        near = np.linalg.inv(np.linalg.cholesky(to_pseudo(prior)))
        scaled = near @ body @ near.T
        if divergence == "log-det":
            terms.append(scale * (cp.trace(scaled) - cp.log_det(scaled) - 4.0))
        else:
            terms.append(0.5 * scale * cp.sum_squares(scaled - np.eye(4)))
            constraints.append(scaled >> 0)
    constraints += [
        x[count + k] >= 0.0 for k, c in enumerate(found.model.coefficients) if c.positive
    ]
    cost = cp.sum_squares(triangle[:-1, :-1] @ x - triangle[:-1, -1]) + sum(terms)
    task = cp.Problem(cp.Minimize(cost), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        task.solve(solver=cp.CLARABEL, tol_gap_abs=1e-9, tol_gap_rel=1e-10, tol_feas=1e-10)
    least = float(task.solution.opt_val) + triangle[-1, -1] ** 2
    assert found.objective == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("weight", [1e-6, 1.0, 1e6])
def test_a_payload_beside_a_prior_of_any_weight_is_proven(folder, weight):
    """What is believed of it weighs as much less, and comes to its level at its own pace."""
    found = sysid.fit(
        config.experiment(
            tree(prior={"divergence": "log-det", "weight": weight}), folder / "config.yaml"
        )
    )
    assert found.solution.converged and found.certificate.globally_optimal
    if weight <= 1.0:
        mass, std = value(found, "payload.*.m[two]")
        assert abs(mass - MASS["two"]) < 4.0 * std
