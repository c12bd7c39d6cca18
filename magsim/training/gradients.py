"""Gradient surgery for several losses."""

from collections.abc import Sequence

import torch
from torch import Tensor


def project_conflicts(gradients: Sequence[Tensor]) -> Tensor:
    """Sum of gradients, each freed from what points against another (PCGrad).

    Where two gradients have a negative dot product, each loses its component along the *original* other one
    (Yu et al., Gradient Surgery for Multi-Task Learning, NeurIPS 2020, arXiv 2001.06782). Paper 000 prints this
    projection as eq. 38, with a test (eq. 37) that can never fire; the sign of the dot product is meant.

    Parameters
    ----------
    gradients : sequence of (p,)

    Returns
    -------
    (p,)
    """
    total = torch.zeros_like(gradients[0])
    for i, gradient in enumerate(gradients):
        kept = gradient.clone()
        for j, other in enumerate(gradients):
            dot = torch.dot(kept, other)
            if i != j and dot < 0.0:
                kept -= dot / torch.dot(other, other) * other
        total += kept
    return total
