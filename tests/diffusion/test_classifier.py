"""The network that classifies the context of a geometry."""

import numpy as np
import torch

from polycube.diffusion.point_network import ContextClassifier


def _geometry(seed: int = 0) -> torch.Tensor:
    return torch.randn(2, 6, 8, 8, generator=torch.Generator().manual_seed(seed))


def _classifier() -> ContextClassifier:
    torch.manual_seed(0)
    return ContextClassifier(6, 2, 4, width=16, blocks=2, slots=4).eval()


def test_order_of_points_does_not_matter() -> None:
    order = torch.randperm(64, generator=torch.Generator().manual_seed(1))
    x = _geometry()
    shuffled = x.flatten(2)[:, :, order].reshape(x.shape)
    classifier = _classifier()
    for plain, reordered in zip(classifier(x), classifier(shuffled), strict=True):
        assert torch.allclose(plain, reordered, atol=1e-5)


def test_shapes_of_the_logits() -> None:
    cells, alignment = _classifier()(_geometry())
    assert cells.shape == (2, 2, 5) and alignment.shape == (2,)


def _log_likelihood(
    classifier: ContextClassifier, geometry: torch.Tensor, contexts: torch.Tensor
) -> torch.Tensor:
    """(B, C) sums of the log-probabilities of the two cells of contexts (C, 2) and alignment."""
    log_p, log_aligned = classifier.log_cells(geometry)
    return log_p[:, torch.arange(2), contexts].sum(dim=2) + log_aligned[:, None]


def test_log_likelihood_is_the_sum_over_cells_and_alignment() -> None:
    """log p(aligned) + log p(first cell) + log p(second cell), by hand."""
    classifier, geometry = _classifier(), _geometry()
    contexts = torch.tensor([[0, 0], [3, 4], [4, 1]])
    with torch.no_grad():
        found = _log_likelihood(classifier, geometry, contexts).numpy()
        cells, alignment = (logits.double().numpy() for logits in classifier(geometry))
    for b in range(2):
        for c, context in enumerate(contexts.tolist()):
            expected = -np.log(1 + np.exp(-alignment[b]))
            for cell, name in enumerate(context):
                expected += cells[b, cell, name] - np.log(np.exp(cells[b, cell]).sum())
            assert np.isclose(found[b, c], expected, atol=1e-5)


def test_probabilities_of_all_contexts_and_of_misalignment_add_up_to_one() -> None:
    classifier, geometry = _classifier(), _geometry()
    every = torch.cartesian_prod(torch.arange(5), torch.arange(5))
    with torch.no_grad():
        total = _log_likelihood(classifier, geometry, every).exp().sum(dim=1)
        assert torch.allclose(total + torch.sigmoid(-classifier(geometry)[1]), torch.ones(2))


def test_without_normals_only_points_are_inputs() -> None:
    torch.manual_seed(0)
    classifier = ContextClassifier(3, 2, 4, width=16, blocks=1, slots=4).eval()
    other = _geometry().clone()
    other[:, 3:] += 1
    assert torch.equal(classifier(_geometry())[0], classifier(other)[0])


def test_every_parameter_is_trained() -> None:
    classifier = ContextClassifier(6, 2, 4, width=16, blocks=2, slots=4)
    cells, alignment = classifier(_geometry())
    (cells.square().mean() + alignment.square().mean()).backward()
    assert all(p.grad is not None for p in classifier.parameters())
