"""Gradient surgery, by hand."""

import torch

from magsim.training import project_conflicts


def test_conflicting_gradients_are_projected_on_the_original_other():
    """For d = g1.g2 < 0: g1 - d/|g2|^2 g2 and g2 - d/|g1|^2 g1, summed; each part is at right angles to the other."""
    g1, g2 = torch.tensor([1.0, 0.0]), torch.tensor([-1.0, 2.0])
    d = torch.dot(g1, g2)
    p1, p2 = g1 - d / torch.dot(g2, g2) * g2, g2 - d / torch.dot(g1, g1) * g1
    merged = project_conflicts([g1, g2])
    torch.testing.assert_close(merged, p1 + p2)
    assert abs(float(torch.dot(p1, g2))) < 1e-6
    assert float(torch.dot(merged, g1)) >= 0.0
    assert float(torch.dot(merged, g2)) >= 0.0
    friends = [torch.tensor([1.0, 1.0]), torch.tensor([2.0, -1.0])]
    torch.testing.assert_close(project_conflicts(friends), friends[0] + friends[1])


def test_three_gradients_are_freed_from_each_other_in_turn():
    """Each loses, one after the other, what is left of it against each original other."""
    gradients = [torch.tensor(values) for values in ([1.0, 0.0, 0.2], [-1.0, 2.0, 0.0], [0.5, -3.0, 1.0])]
    total = torch.zeros(3)
    for i, own in enumerate(gradients):
        kept = own
        for other in gradients[:i] + gradients[i + 1 :]:
            share = torch.dot(kept, other) / torch.dot(other, other)
            kept = kept - min(float(share), 0.0) * other
        total = total + kept
    torch.testing.assert_close(project_conflicts(gradients), total)


def test_the_given_gradients_are_not_changed():
    gradients = [torch.tensor([1.0, 0.0]), torch.tensor([-1.0, 2.0])]
    project_conflicts(gradients)
    assert gradients[0].tolist() == [1.0, 0.0]
    assert gradients[1].tolist() == [-1.0, 2.0]
