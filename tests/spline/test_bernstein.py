import numpy as np
import pytest

from polycube.spline.bernstein import bernstein, derivative, gauss, tensor, volume_basis

T = np.linspace(0, 1, 7)


@pytest.mark.parametrize("degree", [1, 2, 3, 8])
def test_sums_to_one_and_reproduces_the_parameter(degree):
    values = bernstein(T, degree)
    assert values.sum(axis=1) == pytest.approx(1)
    assert values @ np.arange(degree + 1) / degree == pytest.approx(T)


@pytest.mark.parametrize("degree", [1, 3, 8])
def test_derivative_is_that_of_the_values(degree):
    step = 1e-6
    slope = (bernstein(T + step, degree) - bernstein(T - step, degree)) / (2 * step)
    assert derivative(T, degree) == pytest.approx(slope, abs=1e-8)


def test_tensor_order_has_x_fastest():
    rows = [np.array([[1.0, 2.0]]), np.array([[1.0, 10.0]]), np.array([[1.0, 100.0]])]
    assert tensor(*rows)[0].tolist() == [1, 2, 10, 20, 100, 200, 1000, 2000]


def test_gradients_of_linear_coefficients_are_constant():
    _, gradients = volume_basis(T)
    i = np.arange(64)
    for axis, coefficient in enumerate([i % 4, i // 4 % 4, i // 16]):
        expected = np.zeros((3, len(T) ** 3))
        expected[axis] = 3
        assert gradients @ coefficient == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("n", [1, 2, 4, 5])
def test_gauss_integrates_to_its_degree(n):
    t, w = gauss(n)
    for power in range(2 * n):
        assert w @ t**power == pytest.approx(1 / (power + 1))
    assert w @ t ** (2 * n) != pytest.approx(1 / (2 * n + 1), rel=1e-9)
