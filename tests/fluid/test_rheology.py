"""Rheometric functions against the law of one material point, as a tensor equation in time.

The law is written here a second time, for the stress tau rather than the strain a, and integrated
from rest with an explicit method of high order; that is independent of every closed form.
"""

import math

import ngsolve
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from netgen.geom2d import unit_square
from ngsolve import CoefficientFunction
from scipy.integrate import solve_ivp

from viscotrain.errors import FluidError
from viscotrain.flow import giesekus
from viscotrain.flow.axisymmetry import Tensor
from viscotrain.flow.giesekus import LogConformation
from viscotrain.fluid import rheology
from viscotrain.fluid.parameters import Fluid, Mode

HYALURONIC_ACID = Fluid(0.051, (Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49)))
OLDROYD_B = Fluid(0.05, (Mode(0.3, 0.2, 0.0), Mode(0.2, 0.01, 0.0)))
NEWTONIAN = Fluid(0.7)
STRONG = Fluid(0.02, (Mode(1.3, 0.5, 0.85),))  # mobility above 1/2
FLUIDS = {
    "hyaluronic acid": HYALURONIC_ACID,
    "Oldroyd-B": OLDROYD_B,
    "Newtonian": NEWTONIAN,
    "mobility above 1/2": STRONG,
}
SHEAR = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
EXTENSION = np.diag([1.0, -0.5, -0.5])
ACCURACY = 1e-6  # what is asked of every function; the integration below is good to 1e-9
RATES = [0.03, 1.0, 7.0, 40.0, 900.0]

MESH = ngsolve.Mesh(unit_square.GenerateMesh(maxh=1.0))  # must outlive its points
POINT = MESH(0.3, 0.4)

each_fluid = pytest.mark.parametrize("fluid", FLUIDS.values(), ids=FLUIDS)


def integrated_stress(fluid, gradient, times):
    """Sigma + p I at the times, shape (n, 3, 3), of a fluid at rest until t = 0.

    tau + lambda upper-convected(tau) + alpha lambda/eta tau.tau = 2 eta D, with
    `gradient(t)` = du_i/dx_j.
    """

    def rate_of_change(mode):
        def right_side(t, flat):
            tau, L = flat.reshape(3, 3), gradient(t)
            source = mode.viscosity * (L + L.T) - tau
            source -= mode.mobility * mode.relaxation_time / mode.viscosity * (tau @ tau)
            return (source / mode.relaxation_time + L @ tau + tau @ L.T).ravel()

        return right_side

    total = np.array([fluid.solvent_viscosity * (gradient(t) + gradient(t).T) for t in times])
    for mode in fluid.modes:
        scale = mode.viscosity / mode.relaxation_time
        solution = solve_ivp(
            rate_of_change(mode),
            (0.0, times[-1]),
            np.zeros(9),
            method="DOP853",
            t_eval=times,
            rtol=1e-11,
            atol=1e-13 * scale,
        )
        assert solution.success
        total += solution.y.T.reshape(-1, 3, 3)
    return total


def steady(gradient):
    return lambda t: gradient


def long_after(fluid, weakest=1.0):
    """Time in which exp(-weakest t/lambda) decays to 1e-11."""
    longest = max((mode.relaxation_time for mode in fluid.modes), default=1.0)
    return 26 * longest / weakest


# ---------------------------------------------------------------------------------- steady shear


@each_fluid
@pytest.mark.parametrize("rate", RATES)
def test_steady_shear_is_the_end_of_start_up(fluid, rate):
    sigma = integrated_stress(fluid, steady(rate * SHEAR), [long_after(fluid)])[0]
    eta, N1, N2 = rheology.steady_shear(rate, fluid)
    assert eta == pytest.approx(sigma[0, 1] / rate, rel=ACCURACY)
    assert pytest.approx(sigma[0, 0] - sigma[1, 1], rel=ACCURACY, abs=1e-12) == N1
    assert pytest.approx(sigma[1, 1] - sigma[2, 2], rel=ACCURACY, abs=1e-9 * abs(N1)) == N2


def test_signs_of_the_normal_stresses():
    forward, backward = (rheology.steady_shear(rate, HYALURONIC_ACID) for rate in (5.0, -5.0))
    assert forward.first_normal_stress_difference > 0 > forward.second_normal_stress_difference
    assert backward == forward  # even in the shear rate


def test_slow_shear_is_a_second_order_fluid():
    """Psi_1 = 2 sum eta lambda, Psi_2 = -sum alpha eta lambda; next order: (lambda rate)^2."""
    rate = 1e-3
    eta, N1, N2 = rheology.steady_shear(rate, HYALURONIC_ACID)
    moments = [(m.viscosity * m.relaxation_time, m.mobility) for m in HYALURONIC_ACID.modes]
    assert eta == pytest.approx(0.562, rel=1e-7)
    assert N1 / rate**2 == pytest.approx(2 * sum(m for m, _ in moments), rel=1e-7)
    assert N2 / rate**2 == pytest.approx(-sum(m * alpha for m, alpha in moments), rel=1e-7)


@given(alpha=st.floats(0, 0.99), rate=st.floats(1e-4, 1e3), lam=st.floats(1e-3, 10))
def test_the_law_in_log_conformation_is_at_rest_in_the_steady_state(alpha, rate, lam):
    """The state behind eta, N1 and N2 makes the right-hand side of `giesekus.evolution` vanish."""
    _, N1, N2 = rheology.steady_shear(rate, Fluid(1e-3, (Mode(1.0, lam, alpha),)))
    eta = rheology.viscosity(rate, Fluid(1e-3, (Mode(1.0, lam, alpha),))) - 1e-3
    c = np.array([[1 + lam * (N1 + N2), lam * eta * rate], [lam * eta * rate, 1 + lam * N2]])
    values, vectors = np.linalg.eigh(c)
    assume(values[0] > 1e-5 * values[1])  # else the logarithm amplifies round-off
    psi = vectors @ np.diag(np.log(values)) @ vectors.T
    m, a, b = (psi[0, 0] + psi[1, 1]) / 2, (psi[0, 0] - psi[1, 1]) / 2, psi[0, 1]
    change = giesekus.evolution(
        LogConformation(*map(CoefficientFunction, (m, a, b, 0.0))),
        Tensor(*map(CoefficientFunction, (0.0, 0.0, 0.0, rate / 2))),
        CoefficientFunction(rate / 2),
        CoefficientFunction(lam),
        alpha,
    )
    found = [CoefficientFunction(part)(POINT) for part in change]
    assert np.abs(found).max() < 1e-8 * values[1] / values[0] ** 0.5 * (rate + 1 / lam)


# --------------------------------------------------------------------------- small oscillation


@pytest.mark.slow
@each_fluid
@pytest.mark.parametrize("omega", [0.5, 13.0, 200.0])
def test_moduli_are_the_response_to_a_small_oscillation(fluid, omega):
    """Strain gamma sin(omega t): stress in phase is G' gamma, a quarter ahead G'' gamma.

    Terms that are not linear in the strain are smaller by gamma^2.
    """
    gamma, samples = 1e-4, 48
    longest = max((mode.relaxation_time for mode in fluid.modes), default=0.0)
    period = 2 * np.pi / omega
    start = period * math.ceil(26 * longest / period)
    times = start + period * np.arange(samples + 1) / samples
    sigma = integrated_stress(
        fluid, lambda t: gamma * omega * np.cos(omega * t) * SHEAR, times.tolist()
    )[:-1, 0, 1]
    phase = omega * times[:-1]
    in_phase, ahead = (2 * np.mean(sigma * part(phase)) / gamma for part in (np.sin, np.cos))
    scale = math.hypot(in_phase, ahead)
    assert rheology.storage_modulus(omega, fluid) == pytest.approx(in_phase, abs=ACCURACY * scale)
    assert rheology.loss_modulus(omega, fluid) == pytest.approx(ahead, abs=ACCURACY * scale)


def test_moduli_by_hand():
    """One mode at omega = 1/lambda: G' = G'' of the mode = half of eta/lambda."""
    fluid = Fluid(0.1, (Mode(3.0, 0.5, 0.2),))
    assert rheology.storage_modulus(2.0, fluid) == pytest.approx(3.0, rel=1e-14)
    assert rheology.loss_modulus(2.0, fluid) == pytest.approx(3.0 + 0.2, rel=1e-14)


# ------------------------------------------------------------------------------------- start-up


@each_fluid
@pytest.mark.parametrize("rate", [0.1, 30.0, -30.0])
def test_start_up_of_shear(fluid, rate):
    times = np.array([0.0, 1e-3, 0.01, 0.05, 0.2, 1.0])
    sigma = integrated_stress(fluid, steady(rate * SHEAR), times)
    found = rheology.shear_start_up(times, rate, fluid)
    expected = (
        sigma[:, 0, 1],
        sigma[:, 0, 0] - sigma[:, 1, 1],
        sigma[:, 1, 1] - sigma[:, 2, 2],
    )
    for values, reference in zip(found, expected, strict=True):
        assert values == pytest.approx(reference, rel=ACCURACY, abs=1e-9 * np.abs(sigma).max())


def test_start_up_of_oldroyd_b_in_closed_form():
    """Per mode tau_12 = eta rate (1 - e^-t/l), N1 = 2 eta l rate^2 (1 - (1 + t/l) e^-t/l)."""
    times, rate = np.linspace(0.0, 0.5, 9), 12.0
    found = rheology.shear_start_up(times, rate, OLDROYD_B)
    stress, N1 = np.full(9, OLDROYD_B.solvent_viscosity * rate), np.zeros(9)
    for mode in OLDROYD_B.modes:
        x = times / mode.relaxation_time
        stress += mode.viscosity * rate * -np.expm1(-x)
        N1 += 2 * mode.viscosity * mode.relaxation_time * rate**2 * (1 - (1 + x) * np.exp(-x))
    assert found.shear_stress == pytest.approx(stress, rel=1e-8)
    assert found.first_normal_stress_difference == pytest.approx(N1, rel=1e-8, abs=1e-12)
    assert np.all(found.second_normal_stress_difference == 0)


def test_start_up_begins_with_the_solvent():
    at_once = rheology.shear_start_up([0.0], 5.0, HYALURONIC_ACID)
    assert [float(part[0]) for part in at_once] == pytest.approx([0.051 * 5, 0, 0], rel=1e-14)
    at_rest = rheology.shear_start_up([0.0, 1.0], 0.0, HYALURONIC_ACID)
    assert np.all(np.array(at_rest) == 0)


def test_start_up_overshoots_and_ends_in_steady_shear():
    times, rate = np.linspace(0.0, 3.0, 300), 200.0
    found = rheology.shear_start_up(times, rate, HYALURONIC_ACID)
    eta, N1, N2 = rheology.steady_shear(rate, HYALURONIC_ACID)
    assert found.shear_stress.max() > 1.05 * found.shear_stress[-1]
    last = [values[-1] for values in found]
    assert last == pytest.approx([float(x) for x in (eta * rate, N1, N2)], rel=ACCURACY)


@pytest.mark.parametrize(
    "times", [[], [1.0, 1.0], [2.0, 1.0], [-1.0, 0.0], [[0.0, 1.0]], [math.nan]]
)
def test_start_up_refuses_times_out_of_order(times):
    with pytest.raises(FluidError, match="allowed: one or more, ascending, none negative"):
        rheology.shear_start_up(times, 1.0, HYALURONIC_ACID)


# ------------------------------------------------------------------------------------ extension


@pytest.mark.slow
@each_fluid
@pytest.mark.parametrize("rate", [0.01, 0.6, 2.4, 20.0, 300.0])
def test_steady_extension_is_the_end_of_start_up(fluid, rate):
    found = rheology.extensional_viscosity(rate, fluid)
    weakest = min((1 - 2 * m.relaxation_time * rate for m in fluid.modes), default=1.0)
    if fluid is OLDROYD_B and weakest <= 0:
        assert found == math.inf
        return
    weakest = max(weakest, 0.04)  # mobility bounds the time of approach
    sigma = integrated_stress(fluid, steady(rate * EXTENSION), [long_after(fluid, weakest)])
    assert found == pytest.approx((sigma[0, 0, 0] - sigma[0, 1, 1]) / rate, rel=ACCURACY)


def test_extension_in_its_limits():
    """Trouton's 3 eta_0 when slow, 3 eta_s + 2 eta_k/alpha_k per mode when fast."""
    slow = rheology.extensional_viscosity(1e-7, HYALURONIC_ACID)
    fast = rheology.extensional_viscosity(1e9, HYALURONIC_ACID)
    assert slow == pytest.approx(3 * 0.562, rel=1e-6)
    assert fast == pytest.approx(3 * 0.051 + 2 * (0.257 / 0.283 + 0.254 / 0.49), rel=1e-6)


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan])
def test_extension_refuses_other_rates(rate):
    with pytest.raises(FluidError, match=r"extension rate is .*; allowed: above 0"):
        rheology.extensional_viscosity([1.0, rate], HYALURONIC_ACID)


# --------------------------------------------------------------------------------------- limits


@given(rate=st.floats(1e-3, 1e3))
def test_small_mobility_tends_to_oldroyd_b(rate):
    """The limit is approached linearly and without a jump of formulas."""

    def functions(alpha):
        fluid = Fluid(0.1, (Mode(0.4, 0.01, alpha),))
        return np.array([*rheology.steady_shear(rate, fluid)])

    limit, near = functions(0.0), functions(1e-12)
    W = 0.01 * rate
    assert limit == pytest.approx([0.5, 2 * 0.4 * 0.01 * rate**2, 0.0], rel=1e-13)
    assert near == pytest.approx(limit, rel=1e-10 * (1 + W**2), abs=1e-11 * limit[1] * (1 + W**2))


def test_functions_keep_the_shape_of_their_argument():
    rates = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    for fluid in FLUIDS.values():
        parts = [
            rheology.storage_modulus(rates, fluid),
            rheology.loss_modulus(rates, fluid),
            *rheology.steady_shear(rates, fluid),
            rheology.extensional_viscosity(rates, fluid),
        ]
        assert all(part.shape == rates.shape for part in parts)
        assert parts[1][1, 2] == rheology.loss_modulus(6.0, fluid)
