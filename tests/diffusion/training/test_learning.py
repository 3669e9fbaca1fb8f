"""Options of a training: rates, averages, refusals."""

import numpy as np
import pytest
import torch
from torch.optim.swa_utils import AveragedModel

from polycube.diffusion.training.learning import Learning, moving_average, rate_factors


def test_the_printed_learning_rates() -> None:
    """eta_k = eta_{k-1} (1 - k / K) ends at zero, as linear and cosine decay do."""
    assert rate_factors("printed", 4) == pytest.approx([1, 3 / 4, 3 / 8, 3 / 32, 0])
    assert rate_factors("linear", 4) == pytest.approx([1, 0.75, 0.5, 0.25, 0])
    eighth = np.cos(np.pi / 8) ** 2  # (1 + cos(pi / 4)) / 2
    assert rate_factors("cosine", 4) == pytest.approx([1, eighth, 0.5, 1 - eighth, 0])
    assert rate_factors("constant", 2) == [1, 1, 1]


def test_moving_average_of_a_sequence() -> None:
    """a <- s a + (1 - s) w with s = min(decay, (1 + n) / (10 + n)); n, the averaged before."""
    decay, weight = 0.3, torch.nn.Linear(1, 1, bias=False)
    average = AveragedModel(weight, multi_avg_fn=moving_average(decay))
    expected = None
    for n, value in enumerate([1.0, -2.0, 5.0, 0.5, 3.0]):
        weight.weight.data.fill_(value)
        average.update_parameters(weight)
        share = min(decay, (1 + n) / (10 + n))
        expected = value if n == 0 else share * expected + (1 - share) * value
        assert average.module.weight.item() == pytest.approx(expected, rel=1e-6)
    assert (1 + 4) / (10 + 4) > decay > (1 + 2) / (10 + 2)  # both sides were met


def test_counters_are_not_averaged() -> None:
    average = [torch.tensor([3])]
    moving_average(0.9)(average, [torch.tensor([7])], torch.tensor(5))
    assert average[0].item() == 7


def test_wrong_options_are_refused() -> None:
    with pytest.raises(ValueError, match="one of constant, linear, cosine, printed; got 'steep'"):
        Learning(decay="steep")
    with pytest.raises(ValueError, match=r"learning\.loss must be one of distance, mse; got 'l1'"):
        Learning(loss="l1")
    with pytest.raises(ValueError, match=r"thin must be a whole number, 1 or more; got 0"):
        Learning(thin=0)
    with pytest.raises(ValueError, match=r"endpoint must be a number, 0 to 1; got 2"):
        Learning(endpoint=2)
    with pytest.raises(ValueError, match=r"labels must be a number, 0 or more; got -1"):
        Learning(labels=-1)
    with pytest.raises(ValueError, match=r"ema must lie between 0 and 1; got 1"):
        moving_average(1)
