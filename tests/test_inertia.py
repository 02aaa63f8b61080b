"""Bodies: every map against its inverse, complex steps, finite differences and the paper's statements."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sysid import inertia
from sysid.inertia import Eigenvalue, Exponential, Linear, LogCholesky, pseudo
from sysid.inertia.divergence import DIVERGENCES
from sysid.inertia.eigenvalue import rotation
from sysid.inertia.exponential import first_divided_difference, second_divided_difference

MANY = 10_000


def random_bodies(n: int, seed: int = 0) -> np.ndarray:
    """Bodies of the paper's Table I: mass, centre of mass, second moments and rotation drawn uniformly."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.01, 1.0, n)
    com = rng.uniform(-0.5, 0.5, (n, 3))
    moments = rng.uniform(0.01, 1.0, (n, 3))
    turn = rotation(rng.uniform(-np.pi, np.pi, (n, 3)))
    sigma = (turn * moments[:, None, :]) @ np.swapaxes(turn, -1, -2)
    return pseudo.from_central(mass, com, np.trace(sigma, axis1=-2, axis2=-1)[:, None, None] * np.eye(3) - sigma)


REFERENCES = [None, pseudo.box(1.5, [0.0, 0.045, 0.0], [0.09, 0.05, 0.12])]


@pytest.mark.parametrize(
    "kind", [LogCholesky(), LogCholesky(REFERENCES[1]), Exponential(), Eigenvalue(), Linear()], ids=lambda k: k.name
)
def test_map_and_inverse_on_many_bodies(kind):
    pi = random_bodies(MANY)
    theta = kind.inverse(pi)
    assert theta.shape == (MANY, 10)
    np.testing.assert_allclose(kind.parameters(theta), pi, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("kind", [LogCholesky(), LogCholesky(REFERENCES[1]), Exponential()], ids=lambda k: k.name)
def test_coordinates_come_back(kind):
    theta = np.random.default_rng(1).uniform(-1.0, 1.0, (MANY, 10))
    back = kind.inverse(kind.parameters(theta))
    # the inverse solves a matrix of condition up to ~1e4 here; its error is that times rounding
    np.testing.assert_allclose(back, theta, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("reference", REFERENCES, ids=["identity", "box"])
def test_log_cholesky_jacobian_by_complex_step(reference):
    kind = LogCholesky(reference)
    theta = np.random.default_rng(2).uniform(-1.0, 1.0, (MANY, 10))
    gamma = kind.jacobian(theta)
    for i in range(10):
        step = np.zeros(10, dtype=complex)
        step[i] = 1e-30j
        numeric = kind.parameters(theta + step).imag / 1e-30
        np.testing.assert_allclose(gamma[:, :, i], numeric, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", [Exponential(), Eigenvalue()], ids=lambda k: k.name)
def test_jacobian_by_central_differences(kind):
    theta = np.random.default_rng(3).uniform(-1.0, 1.0, (MANY, 10))
    gamma, h = kind.jacobian(theta), 1e-5
    for i in range(10):
        step = h * np.eye(10)[i]
        numeric = (kind.parameters(theta + step) - kind.parameters(theta - step)) / (2 * h)
        np.testing.assert_allclose(gamma[:, :, i], numeric, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    "kind", [LogCholesky(), LogCholesky(REFERENCES[1]), Exponential(), Eigenvalue(), Linear()], ids=lambda k: k.name
)
def test_hessian_is_the_derivative_of_the_jacobian(kind):
    rng = np.random.default_rng(4)
    theta, gradient = rng.uniform(-1.0, 1.0, (MANY, 10)), rng.normal(size=(MANY, 10))
    hessian, h = kind.hessian(theta, gradient), 1e-5
    np.testing.assert_allclose(hessian, np.swapaxes(hessian, -1, -2), rtol=1e-12, atol=1e-12)
    for i in range(10):
        step = h * np.eye(10)[i]
        slope = (kind.jacobian(theta + step) - kind.jacobian(theta - step)) / (2 * h)
        numeric = np.einsum("nkj,nk->nj", slope, gradient)
        np.testing.assert_allclose(hessian[:, i], numeric, rtol=1e-6, atol=1e-6)


def test_closed_form_of_the_map():
    theta = np.random.default_rng(5).uniform(-1.0, 1.0, (100, 10))
    a, d1, d2, d3, s12, s23, s13, t1, t2, t3 = theta.T
    e = np.exp
    xx, yy, zz = e(2 * d1) + s12**2 + s13**2 + t1**2, e(2 * d2) + s23**2 + t2**2, e(2 * d3) + t3**2
    expected = e(2 * a) * np.array([
        np.ones(100), t1, t2, t3, yy + zz, xx + zz, xx + yy,
        -(s12 * e(d2) + s13 * s23 + t1 * t2), -(s23 * e(d3) + t2 * t3), -(s13 * e(d3) + t1 * t3),
    ])  # fmt: skip
    np.testing.assert_allclose(LogCholesky().parameters(theta), expected.T, rtol=1e-13, atol=1e-13)


def test_equation_9_as_printed_is_the_transposed_product():
    # The paper's eqs. 7, 8, 10, 11 say J = U U'; its eq. 9, with the same U, is J = U' U. Only U U' gives t the
    # meaning of a translation (V-B), so that is the one built; this pins down what was read and how it differs.
    theta = np.random.default_rng(5).uniform(-1.0, 1.0, (100, 10))
    a, d1, d2, d3, s12, s23, s13, t1, t2, t3 = theta.T
    e = np.exp
    printed = e(2 * a) * np.array([
        t1**2 + t2**2 + t3**2 + 1, t1 * e(d1), t1 * s12 + t2 * e(d2), t1 * s13 + t2 * s23 + t3 * e(d3),
        s12**2 + s13**2 + s23**2 + e(2 * d2) + e(2 * d3), s13**2 + s23**2 + e(2 * d1) + e(2 * d3),
        s12**2 + e(2 * d1) + e(2 * d2), -s12 * e(d1), -s12 * s13 - s23 * e(d2), -s13 * e(d1),
    ])  # fmt: skip
    factor = LogCholesky().factor(theta)
    transposed = pseudo.from_pseudo(np.swapaxes(factor, -1, -2) @ factor)
    np.testing.assert_allclose(transposed, printed.T, rtol=1e-12, atol=1e-12)


def test_determinant_has_only_the_factors_the_paper_names():
    # IV-B: the only non-constant factors are e^alpha, e^d1, e^d2, e^d3. The degree in alpha is 20, as every
    # one of ten parameters carries e^(2 alpha); the exponents of e^d are those of the Cholesky map, 2, 3, 4.
    theta = np.random.default_rng(6).uniform(-1.0, 1.0, (MANY, 10))
    determinant = np.linalg.det(LogCholesky().jacobian(theta))
    factors = np.exp(20 * theta[:, 0] + 2 * theta[:, 1] + 3 * theta[:, 2] + 4 * theta[:, 3])
    constant = np.abs(determinant) / factors
    np.testing.assert_allclose(constant, constant[0], rtol=1e-9)
    assert len(set(np.sign(determinant))) == 1


def test_eigenvalue_is_singular_exactly_at_equal_second_moments():
    rng = np.random.default_rng(7)
    theta = rng.uniform(-1.0, 1.0, (200, 10))
    theta[:, 9] = theta[:, 7] + 1.0  # Lz well apart, so that only one factor vanishes
    gaps = np.array([1e-2, 1e-3, 1e-4, 1e-5])
    determinants = []
    for gap in gaps:
        theta[:, 8] = np.log(np.exp(theta[:, 7]) + gap)  # Ly = Lx + gap
        determinants.append(np.abs(np.linalg.det(Eigenvalue().jacobian(theta))))
    determinants = np.array(determinants)
    # the factor Lx - Ly: the determinant falls in proportion to the gap, and vanishes with it
    np.testing.assert_allclose(determinants[2] / determinants[3], 10.0, rtol=2e-2)
    theta[:, 8] = theta[:, 7]
    singular = np.linalg.svd(Eigenvalue().jacobian(theta), compute_uv=False)
    assert (singular[:, -1] / singular[:, 0]).max() < 1e-14  # zero to rounding
    bodies = Eigenvalue().parameters(theta)
    good = LogCholesky()
    singular = np.linalg.svd(good.jacobian(good.inverse(bodies)), compute_uv=False)
    assert (singular[:, -1] / singular[:, 0]).min() > 1e-4


def test_affine_meaning_of_the_coordinates():
    # eq. 10: stretching a box along x by e^d1, shifting it by t, at constant density
    reference = pseudo.box(2.0, [0, 0, 0], [0.2, 0.3, 0.4])
    theta = np.zeros(10)
    theta[1], theta[7:] = np.log(2.0), [0.1, -0.2, 0.3]
    theta[0] = 0.5 * np.log(3.0)  # density times three
    expected = pseudo.box(6.0, [0.1, -0.2, 0.3], [0.4, 0.3, 0.4])
    np.testing.assert_allclose(LogCholesky(reference).parameters(theta), expected, rtol=1e-13, atol=1e-15)


@settings(max_examples=200, deadline=None)
@given(arrays(float, 10, elements=st.floats(-3.0, 3.0)))
def test_every_coordinate_gives_a_possible_body(theta):
    for kind in (LogCholesky(), Exponential(), Eigenvalue()):
        pi = kind.parameters(theta)
        smallest = np.linalg.eigvalsh(pseudo.to_pseudo(pi))[0]
        # a body at the edge of rounding is neither provable nor refutable in double precision
        if smallest > 1e-12 * np.abs(pi).max():
            assert inertia.is_consistent(pi)


def test_the_two_consistency_tests_agree():
    rng = np.random.default_rng(8)
    pi = random_bodies(MANY, seed=8)
    pi[: MANY // 2] += rng.normal(scale=0.3, size=(MANY // 2, 10))
    pi[:50, 0] *= -1
    by_pseudo = inertia.is_consistent(pi)
    assert 0.2 < by_pseudo.mean() < 0.95
    np.testing.assert_array_equal(by_pseudo, inertia.satisfies_theorem(pi))
    assert not inertia.is_consistent(np.full(10, np.nan))


def test_point_line_and_plane_masses_are_not_bodies():
    thin = [[0.1, 0.2, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]]
    pi = np.stack([pseudo.box(1.0, [0, 0, 0], edges) for edges in thin])
    assert not inertia.is_consistent(pi).any()
    assert not inertia.satisfies_theorem(pi).any()


def test_pinocchio_order_and_frames():
    rng = np.random.default_rng(9)
    for pi in random_bodies(20, seed=9):
        mass, com, central = pseudo.to_central(pi)
        body = pin.Inertia(float(mass), com, central)
        np.testing.assert_allclose(pseudo.from_pinocchio(body.toDynamicParameters()), pi, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(pseudo.to_pinocchio(pi), body.toDynamicParameters(), rtol=1e-12, atol=1e-14)
        placement = pin.SE3.Random()
        moved = pseudo.displaced(pi, placement.rotation, placement.translation)
        expected = pseudo.from_pinocchio(placement.act(body).toDynamicParameters())
        np.testing.assert_allclose(moved, expected, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(body.toPseudoInertia().toMatrix(), pseudo.to_pseudo(pi), rtol=1e-12, atol=1e-14)
        gradient = rng.normal(size=10)
        np.testing.assert_allclose(np.sum(pseudo.dual(gradient) * pseudo.to_pseudo(pi)), gradient @ pi, rtol=1e-12)


def test_solids_against_pinocchio():
    for ours, theirs in [
        (pseudo.box(2.0, [0, 0, 0], [0.1, 0.2, 0.3]), pin.Inertia.FromBox(2.0, 0.1, 0.2, 0.3)),
        (pseudo.cylinder(2.0, [0, 0, 0], 0.1, 0.4), pin.Inertia.FromCylinder(2.0, 0.1, 0.4)),
        (pseudo.sphere(2.0, [0, 0, 0], 0.1), pin.Inertia.FromSphere(2.0, 0.1)),
    ]:
        np.testing.assert_allclose(pseudo.to_pinocchio(ours), theirs.toDynamicParameters(), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", DIVERGENCES)
def test_divergence_derivatives_and_zero(name):
    prior, pi = random_bodies(50, seed=10), random_bodies(50, seed=11)
    divergence = DIVERGENCES[name](prior)
    np.testing.assert_allclose(divergence.value(prior), 0.0, atol=1e-11)
    np.testing.assert_allclose(divergence.gradient(prior), 0.0, atol=1e-8)
    assert (divergence.value(pi) > 0).all()
    gradient, hessian = divergence.gradient(pi), divergence.hessian(pi)
    for i in range(10):
        step = 1e-7 * np.eye(10)[i]
        slope = (divergence.value(pi + step) - divergence.value(pi - step)) / 2e-7
        np.testing.assert_allclose(gradient[:, i], slope, rtol=1e-5, atol=1e-4 * np.abs(gradient).max(1).mean())
        slope = (divergence.gradient(pi + step) - divergence.gradient(pi - step)) / 2e-7
        scale = np.abs(hessian).max((1, 2))[:, None]
        np.testing.assert_allclose(hessian[:, i] / scale, slope / scale, atol=1e-5)


def test_log_det_is_invariant_to_frame_and_units_and_pullback_is_its_second_order():
    prior, pi = random_bodies(2, seed=12)
    value = DIVERGENCES["log-det"](prior).value(pi)
    placement = pin.SE3.Random()
    moved = [pseudo.displaced(p, placement.rotation, placement.translation) for p in (prior, pi)]
    np.testing.assert_allclose(DIVERGENCES["log-det"](moved[0]).value(moved[1]), value, rtol=1e-9)
    near = prior + 1e-5 * (pi - prior)
    np.testing.assert_allclose(
        DIVERGENCES["log-det"](prior).value(near), DIVERGENCES["pullback"](prior).value(near), rtol=1e-2
    )
    assert np.isinf(DIVERGENCES["log-det"](prior).value(-pi))


def test_divided_differences_at_and_near_coincidence():
    from mpmath import exp, mp, mpf

    mp.dps = 60

    def exact(*x):  # spread apart by 1e-20, far below double precision, far above 60 digits
        x = [mpf(v) + mpf(10) ** -20 * k for k, v in enumerate(x)]
        table = [exp(v) for v in x]
        for level in range(1, len(x)):
            table = [(table[i + 1] - table[i]) / (x[i + level] - x[i]) for i in range(len(table) - 1)]
        return float(table[0])

    for a in (-3.0, 0.0, 2.0):
        for gap in (0.0, 1e-9, 1e-4, 0.05, 0.0999, 0.1001, 1.0):
            for other in (0.0, 0.3 * gap, 2.0):
                b, c = a + gap, a + other
                np.testing.assert_allclose(first_divided_difference(a, b), exact(a, b), rtol=1e-13)
                got = second_divided_difference(np.array(a), np.array(b), np.array(c))
                np.testing.assert_allclose(got, exact(a, b, c), rtol=3e-13)


def test_a_body_at_the_edge_of_the_possible_ones_has_slopes():
    """Rounding leaves a thin body of a robot in kN m without an inverse: its slopes are those of one that stands just inside."""
    prior = pseudo.from_pseudo(np.diag([0.2, 0.3, 0.5, 2.0]))
    divergence = DIVERGENCES["log-det"](prior[None])
    eps = np.finfo(float).eps
    # how a machine rounds decides on which side of the edge a body without thickness is
    for beyond in (0.0, -0.25 * eps, 0.25 * eps):
        edge = pseudo.from_pseudo(np.diag([beyond, 0.3, 0.5, 2.0]))[None]
        gradient = divergence.gradient(edge)
        assert np.isfinite(gradient).all() and np.isfinite(divergence.hessian(edge)).all()
        # of the inverse 1 / (2 eps), to what rounding makes of as little
        inside = divergence.gradient(pseudo.from_pseudo(np.diag([8.0 * eps, 0.3, 0.5, 2.0]))[None])
        large = np.abs(inside) > 1e3
        ratio = gradient[large] / inside[large]
        assert large.sum() == 3 and np.all(ratio > 1.0) and np.all(ratio < 64.0)
