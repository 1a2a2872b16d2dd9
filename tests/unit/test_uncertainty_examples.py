"""The worked examples of the GUM and its supplement by this engine: their numbers, and what they teach."""

import math

import numpy as np
import pytest

from planner.uncertainty import Group, Input, as_ufloats, budget, monte_carlo, validate

STANDARD, COEFFICIENT = 50_000_623.0, 11.5e-6  # length of the standard end gauge, nm; its expansion, 1/K


def end_gauge(inputs):
    """GUM H.1 with nm and K, first order: only the standard, the difference and two temperature terms have a slope."""
    slopes = dict.fromkeys(("standard", "difference", "random", "comparator"), 1.0)
    slopes |= {"expansion": 0.0, "mean temperature": 0.0, "cycle": 0.0}
    slopes |= {"expansion difference": 0.1 * STANDARD, "temperature difference": -STANDARD * COEFFICIENT}
    names = {each.name for each in inputs}
    return budget("length", "nm", 838.0, inputs, {name: c for name, c in slopes.items() if name in names}, p=0.99)


def end_gauge_model(x):
    error = (
        x["expansion difference"] * (x["mean temperature"] + x["cycle"]) + x["expansion"] * x["temperature difference"]
    )
    whole = x["standard"] + x["difference"] + x["random"] + x["comparator"] - x["standard"] * error
    return whole - 50e6


TEMPERATURES = (
    Input.from_half_width("expansion", COEFFICIENT, 2e-6),
    Input("mean temperature", -0.1, 0.2),
    Input.from_half_width("cycle", 0.0, 0.5, "arcsine"),
    Input.from_half_width("expansion difference", 0.0, 1e-6, dof=50),
    Input.from_half_width("temperature difference", 0.0, 0.05, dof=2),
)
LENGTHS = (
    Input("standard", STANDARD, 25.0, "t", dof=18),
    Input("difference", 215.0, 6.0, "t", dof=24, type="A"),
    Input("random", 0.0, 4.0, "t", dof=5),
    Input("comparator", 0.0, 7.0, "t", dof=8),
)


def test_end_gauge():
    """GUM H.1: contributions 25, 9.7, 2.9 and 16.6 nm, u_c = 32 nm, 16 degrees of freedom, U_99 = 2.92 u_c = 93 nm.

    The document multiplies the rounded 32 nm: 93; unrounded it is 92.5 nm.
    """
    found = end_gauge(
        (Input("standard", STANDARD, 25.0, dof=18), Input("difference", 215.0, 9.7, dof=25.6), *TEMPERATURES)
    )
    told = {row.source: round(row.contribution, 1) for row in found.contributions}
    assert told == {
        "standard": 25.0, "difference": 9.7, "expansion": 0.0, "mean temperature": 0.0, "cycle": 0.0,
        "expansion difference": 2.9, "temperature difference": 16.6,
    }  # fmt: skip
    assert (round(found.u), math.floor(found.dof), round(found.k, 2)) == (32, 16, 2.92)
    # margin: half the last digit that is printed
    assert round(found.k, 2) * round(found.u) == pytest.approx(93, abs=0.5)
    assert found.U / found.u == found.k
    assert found.interval == pytest.approx((838 - 92.5, 838 + 92.5), abs=0.1)


def test_end_gauge_pooled_difference():
    """GUM H.1.3.2: 5.8, 3.9 and 6.7 nm of 24, 5 and 8 degrees of freedom are 9.7 nm of 25.6."""
    parts = (Input("mean", 0, 5.8, dof=24), Input("random", 0, 3.9, dof=5), Input("comparator", 0, 6.7, dof=8))
    found = budget("difference", "nm", 215.0, parts, dict.fromkeys(("mean", "random", "comparator"), 1.0))
    assert round(found.u, 1) == 9.7
    # margin: half the last digit that is printed
    assert found.dof * (9.7 / found.u) ** 4 == pytest.approx(25.6, abs=0.05)  # the document rounds u first


def test_end_gauge_by_monte_carlo():
    """JCGM 101 9.5: 838 nm, 36 nm, shortest 99 % interval [745, 932] nm; the GUM's interval is that of 32 nm."""
    inputs = (*LENGTHS, *TEMPERATURES)
    drawn = monte_carlo(end_gauge_model, inputs, 1, p=0.99, most=400_000, margin=5)
    assert drawn.y == pytest.approx(838, abs=0.5)
    assert drawn.u == pytest.approx(36, abs=0.5)  # margin: half the last digit that is printed
    # margin: chance of the draws, and the last digit that is printed
    assert drawn.shortest == pytest.approx((745, 932), abs=2.5)
    gum = end_gauge(inputs)
    assert gum.interval == pytest.approx((745, 931), abs=1.5)
    assert gum.u == pytest.approx(32, abs=0.5)  # margin: half the last digit that is printed


def test_end_gauge_second_order():
    """GUM H.1.7: with the products of small quantities u_c is 34 nm, not 32: normal draws of the same u show it."""
    inputs = [Input(each.name, each.value, each.u) for each in (*LENGTHS, *TEMPERATURES)]
    drawn = monte_carlo(end_gauge_model, inputs, 2, p=0.99)
    assert end_gauge(inputs).u == pytest.approx(32, abs=0.5)  # margin: half the last digit that is printed
    assert drawn.u == pytest.approx(34, abs=0.5)


def total(x):
    return sum(x.values())


def four(shape, last=1.0):
    return [Input(f"X{k}", 0.0, last if k == 4 else 1.0, shape) for k in range(1, 5)]


@pytest.mark.parametrize(
    ("inputs", "u", "gum_end", "end", "verdict"),
    [
        (four("normal"), 2.0, 3.92, 3.92, "agree"),
        (four("rectangular"), 2.0, 3.92, 3.88, "agree"),
        (four("rectangular", 10.0), 10.1, 19.9, 17.0, "differ"),
    ],
    ids=["normal", "rectangular", "one dominates"],
)
def test_additive_model(inputs, u, gum_end, end, verdict):
    """JCGM 101 9.2, tables 2 to 4, at two digits: the two intervals agree until one rectangle is most of it."""
    gum = budget("Y", "", 0.0, inputs, {each.name: 1.0 for each in inputs})
    drawn = monte_carlo(total, inputs, 3, margin=10 if u > 5 else 3)
    assert gum.u == pytest.approx(u, abs=0.05)  # margin: half the last digit that is printed
    assert drawn.u == pytest.approx(gum.u, rel=0.005)
    assert gum.interval == pytest.approx((-gum_end, gum_end), abs=0.05 if u > 5 else 0.005)
    # margin: chance of the draws, and the last digit that is printed
    assert drawn.symmetric == pytest.approx((-end, end), abs=0.06 if u > 5 else 0.02)
    found = validate(gum, drawn)
    assert found.verdict == verdict
    assert found.delta == (0.5 if u > 5 else 0.05)
    assert ("X4 (rectangular) has 97 % of the variance" in found.reason) == (verdict == "differ")
    assert found.interval == (gum.interval if verdict == "agree" else drawn.symmetric)
    if verdict == "differ":
        assert (found.d_low, found.d_high) == pytest.approx((gum_end - end,) * 2, abs=0.1)


def test_mass_calibration():
    """JCGM 101 9.3: first order has 0.0539 mg, Monte Carlo 0.0754 mg with [1.0834, 1.3825]; d_low = 0.0451."""
    inputs = (
        Input("reference", 100_000.0, 0.050),
        Input("balancing", 1.234, 0.020),
        Input.from_half_width("air", 1.20, 0.10),
        Input.from_half_width("weight", 8e3, 1e3),
        Input.from_half_width("standard", 8e3, 50.0),
    )

    def model(x):
        return (x["reference"] + x["balancing"]) * (1 + (x["air"] - 1.2) * (1 / x["weight"] - 1 / x["standard"])) - 1e5

    slopes = {"reference": 1.0, "balancing": 1.0, "air": 0.0, "weight": 0.0, "standard": 0.0}
    gum, drawn = budget("mass", "mg", 1.234, inputs, slopes), monte_carlo(model, inputs, 4, margin=2)
    # margin: half the last digit that is printed
    assert (gum.u, *gum.interval) == pytest.approx((0.0539, 1.1285, 1.3395), abs=6e-5)
    assert drawn.y == pytest.approx(1.2341, abs=3e-4)  # margin: chance of the draws, and the last digit that is printed
    assert drawn.u == pytest.approx(0.0754, abs=2e-4)  # margin: chance of the draws, and the last digit that is printed
    # margin: chance of the draws, and the last digit that is printed
    assert drawn.shortest == pytest.approx((1.0834, 1.3825), abs=0.004)
    found = validate(gum, drawn, digits=1, interval="shortest")
    assert (found.verdict, found.delta) == ("differ", 0.005)
    # margin: chance of the draws, and the last digit that is printed
    assert (found.d_low, found.d_high) == pytest.approx((0.0451, 0.0430), abs=0.004)
    assert found.reason.startswith("nonlinear: the draws' standard deviation is 0.07")
    assert found.reason.endswith("first order gives 0.054")


LOSS = {  # x1: GUM's y, u; Monte Carlo's y, u and shortest interval for r = 0 and r = 0.9, all in 1e-6
    0.000: ((0, 0), (50, 50, 0, 150), (50, 67, 0, 185)),
    0.010: ((100, 100), (150, 112, 0, 367), (150, 121, 13, 398)),
    0.050: ((2500, 500), (2551, 502, 1590, 3543), (2551, 505, 1628, 3555)),
}


@pytest.mark.parametrize("r", [0.0, 0.9])
@pytest.mark.parametrize("x1", LOSS)
def test_comparison_loss(x1, r):
    """JCGM 101 9.4, tables 6 to 8: Y = X1^2 + X2^2 near 0; first order has no u at x1 = 0, and r does not matter."""
    group = Group((Input("X1", x1, 0.005), Input("X2", 0.0, 0.005)), ((1, r), (r, 1)))
    gum = budget("loss", "", x1**2, [group], {"X1": 2 * x1, "X2": 0.0})
    drawn = monte_carlo(lambda x: x["X1"] ** 2 + x["X2"] ** 2, [group], 5, most=200_000, margin=3)
    first, wanted = LOSS[x1][0], LOSS[x1][1 if r == 0 else 2]
    assert (1e6 * gum.value, 1e6 * gum.u) == pytest.approx(first, abs=1e-6)
    # margin: chance of the draws, and the last digit that is printed
    assert (1e6 * drawn.y, 1e6 * drawn.u) == pytest.approx(wanted[:2], abs=max(0.01 * wanted[1], 1.0))
    low, high = 1e6 * np.array(drawn.shortest)
    # margin: chance of the draws, and the last digit that is printed
    assert high - low == pytest.approx(wanted[3] - wanted[2], rel=0.015)
    # margin: an interval of least length lies loosely where the density is flat
    assert (low, high) == pytest.approx(wanted[2:], abs=max(0.08 * wanted[1], 3.0))  # where it lies is loosely known
    found = validate(gum, drawn, interval="shortest")
    assert found.verdict == "differ"
    assert "nonlinear: the mean of the draws is +" in found.reason


def test_comparison_loss_has_its_exact_moments():
    """Mean x1^2 + 2 u^2, variance 4 x1^2 u^2 + 4 u^4 (1 + r^2), from the normal distribution's fourth moments."""
    u, x1, r = 0.005, 0.01, 0.9
    group = Group((Input("X1", x1, u), Input("X2", 0.0, u)), ((1, r), (r, 1)))
    drawn = monte_carlo(lambda x: x["X1"] ** 2 + x["X2"] ** 2, [group], 6, most=400_000, margin=5)
    mean, sd = x1**2 + 2 * u**2, math.sqrt(4 * x1**2 * u**2 + 4 * u**4 * (1 + r**2))
    assert abs(drawn.y - mean) < 5 * drawn.spread[0]
    assert abs(drawn.u - sd) < 5 * drawn.spread[1]
    assert abs(drawn.u - 2 * x1 * u) > 5 * drawn.spread[1]


def test_logarithm():
    """NPL DEM-ES-011 9.2: ln x of x within 0.1 to 1.1 has -0.665 and 0.606, not -0.511 and 0.481; [-1.895, 0.095]."""
    given = Input.from_half_width("x", 0.6, 0.5)
    gum = budget("y", "", math.log(0.6), [given], {"x": 1 / 0.6})
    drawn = monte_carlo(lambda x: np.log(x["x"]), [given], 7, most=400_000, margin=5)
    assert (gum.value, gum.u, gum.interval[1]) == pytest.approx((-0.511, 0.481, 0.432), abs=1e-3)
    assert (drawn.y, drawn.u) == pytest.approx((-0.665, 0.606), abs=3e-3)
    assert drawn.shortest == pytest.approx((-1.895, 0.095), abs=0.012)
    found = validate(gum, drawn)
    assert found.verdict == "differ"
    assert found.reason.startswith(
        "x (rectangular) has 100 % of the variance; nonlinear: the mean of the draws is -0.15"
    )
    assert found.reason.endswith("the distribution of the draws is not symmetric")


def test_correlated_measurands():
    """GUM H.2: resistance, reactance, impedance of five joint readings; their u and the correlations between them."""
    volt = np.array([5.007, 4.994, 5.005, 4.990, 4.999])
    ampere = np.array([19.663, 19.639, 19.640, 19.685, 19.678]) * 1e-3
    phase = np.array([1.0456, 1.0438, 1.0468, 1.0428, 1.0433])
    readings = np.stack([volt, ampere, phase])
    own = zip(("V", "I", "phi"), readings.mean(1), readings.std(1, ddof=1) / math.sqrt(5), strict=True)
    group = Group(tuple(Input(*each, type="A", dof=4) for each in own), np.corrcoef(readings), "readings")
    V, I, phi = readings.mean(1)  # noqa: E741
    Z, R, X = V / I, V / I * math.cos(phi), V / I * math.sin(phi)
    slopes = {
        "R": (R, {"V": R / V, "I": -R / I, "phi": -X}),
        "X": (X, {"V": X / V, "I": -X / I, "phi": R}),
        "Z": (Z, {"V": Z / V, "I": -Z / I, "phi": 0.0}),
    }
    found = [budget(name, "ohm", value, [group], c) for name, (value, c) in slopes.items()]
    # margin: half the last digit that is printed
    assert [each.value for each in found] == pytest.approx([127.732, 219.847, 254.260], abs=5e-4)
    # margin: half the last digit that is printed
    assert [each.u for each in found] == pytest.approx([0.071, 0.295, 0.236], abs=6e-4)
    assert {each.dof for each in found} == {4.0}
    alone = budget("R", "ohm", R, group.inputs, slopes["R"][1])
    assert alone.u > 1.5 * found[0].u  # margin: half as much again, so that it is no rounding
    import uncertainties

    numbers = as_ufloats(found)
    correlation = uncertainties.correlation_matrix([numbers["R"], numbers["X"], numbers["Z"]])
    # margin: the last digits that are printed
    assert correlation[np.triu_indices(3, 1)] == pytest.approx([-0.588, -0.485, 0.993], abs=2e-3)


def test_fluorescence():
    """Two intensities' ratio times a reference (Sandia's course example): u = 0.00494, some 27.7 degrees of freedom."""
    inputs = (
        Input("X1", 0.1820, 0.00093, dof=9),
        Input("X2", 0.1823, 0.00058, dof=19),
        Input("Y", 0.6978, 0.0026, dof=19),
    )
    value = 0.1820 / 0.1823 * 0.6978
    slopes = {"X1": value / 0.1820, "X2": -value / 0.1823, "Y": value / 0.6978}
    found = budget("yield", "", value, inputs, slopes)
    # margin: half the last digit that is printed
    assert (found.value, found.u) == pytest.approx((0.6967, 0.00494), abs=6e-5)
    assert found.dof == pytest.approx(27.7, abs=0.5)  # margin: from numbers that were printed rounded
    # margin: from numbers that were printed rounded
    assert found.interval == pytest.approx((0.6967 - 0.0101, 0.6967 + 0.0101), abs=2e-4)
