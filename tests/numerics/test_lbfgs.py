"""The minimiser on functions with known minima."""

import numpy as np
import pytest

from polycube.numerics.lbfgs import counted, descend


def rosenbrock(x: np.ndarray) -> tuple[float, np.ndarray]:
    a, b = x
    gradient = [-400 * a * (b - a * a) - 2 * (1 - a), 200 * (b - a * a)]
    return 100 * (b - a * a) ** 2 + (1 - a) ** 2, np.array(gradient)


def test_rosenbrock():
    assert descend(rosenbrock, np.array([-1.2, 1.0]), 100) == pytest.approx([1, 1], abs=1e-4)


def test_value_never_increases():
    x = np.array([-1.2, 1.0])
    values = [rosenbrock(descend(rosenbrock, x, n))[0] for n in range(0, 40, 5)]
    assert values[0] == rosenbrock(x)[0]
    assert (np.diff(values) <= 0).all()


def test_steps_back_from_infinite_values():
    """-log x + x has its minimum at 1; a long step leaves the domain."""

    def barrier(x: np.ndarray) -> tuple[float, np.ndarray]:
        if x[0] <= 0:
            return np.inf, x
        return x[0] - np.log(x[0]), 1 - 1 / x

    assert descend(barrier, np.array([5.0]), 50, step=20.0) == pytest.approx([1], abs=1e-4)


def test_a_retraction_keeps_every_point_on_the_sphere():
    """A linear function is least against its slope; the gradient is taken along the sphere."""
    slope, met = np.array([1.0, -2.0, 2.0]), []

    def function(x: np.ndarray) -> tuple[float, np.ndarray]:
        met.append(x)
        return float(slope @ x), slope - (slope @ x) * x

    def unit(x: np.ndarray) -> np.ndarray:
        return x / np.linalg.norm(x)

    lowest = descend(function, unit(np.ones(3)), 60, step=0.1, retract=unit)
    assert lowest == pytest.approx(-slope / 3, abs=1e-4)
    assert np.linalg.norm(met, axis=1) == pytest.approx(1)


def test_stops_at_a_minimum():
    assert descend(lambda x: (float(x @ x), 2 * x), np.zeros(3), 50) == pytest.approx(np.zeros(3))


def test_a_wrong_gradient_ends_the_search():
    x = np.ones(2)
    assert np.array_equal(descend(lambda y: (float(y @ y), -2 * y), x, 50), x)


def test_counts_steps_and_evaluations():
    """The first step is 1e-4 long, the second reaches the minimum of x^2."""
    calls = []

    def square(x: np.ndarray) -> tuple[float, np.ndarray]:
        calls.append(x)
        return float(x @ x), 2 * x

    with counted() as both:
        with counted() as first:
            descend(square, np.ones(1), 1)
        assert first == {"steps": 1, "evaluations": 2, "work": 2}
        descend(square, np.ones(1), 50)
    assert first["evaluations"] == 2
    assert both["evaluations"] == len(calls)
    descend(square, np.ones(1), 50)
    assert both["evaluations"] < len(calls)


@pytest.mark.parametrize("iterations", [0, 3, 7])
def test_no_more_steps_than_iterations(iterations):
    with counted() as effort:
        descend(rosenbrock, np.array([-1.2, 1.0]), iterations)
    assert effort["steps"] == iterations
    assert effort["evaluations"] > iterations
