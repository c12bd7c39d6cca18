"""The residual convolutional network: against plain numpy, and what each output depends on."""

import numpy as np
import pytest
import torch

from magsim.compensation.networks.modules.resnet import ResNet, reach


def network(**settings):
    torch.manual_seed(0)
    module = ResNet(3, width=4, kernel=3, blocks=2, window=12, **settings).double()
    with torch.no_grad():
        for name, parameter in module.named_parameters():
            parameter.normal_(std=0.3)
            if "path" in name and parameter.ndim == 1:
                parameter.add_(0.5)  # keep units alive
        for name, buffer in module.named_buffers():
            if name.endswith(("mean", "var")):
                buffer.uniform_(0.5, 1.5)
    return module.eval()


def windows(length=12):
    return torch.randn(2, 3, length, dtype=torch.double, generator=torch.Generator().manual_seed(1))


def convolved(x, weight, bias, padding):
    """Correlate (channels, time) with (out, channels, kernel), zeros outside."""
    x = np.pad(x, ((0, 0), (padding, padding)))
    kernel = weight.shape[2]
    steps = range(x.shape[1] - kernel + 1)
    return np.stack([np.tensordot(weight, x[:, t : t + kernel], 2) + bias for t in steps], axis=1)


def by_hand(module, x, *, causal=False, last=False, normalize=True):
    w = {name: tensor.detach().numpy() for name, tensor in module.state_dict().items()}
    padding = 0 if causal else 1
    second = 3 if normalize else 2
    out = []
    for window in x.numpy():
        h = np.maximum(convolved(window, w["entry.weight"], w["entry.bias"], padding), 0.0)
        for block in range(2):
            path, given = f"blocks.{block}.path", h
            for conv in (0, second):
                h = convolved(h, w[f"{path}.{conv}.weight"], w[f"{path}.{conv}.bias"], padding)
                if normalize:
                    norm = f"{path}.{conv + 1}"
                    scale = w[f"{norm}.weight"] / np.sqrt(w[f"{norm}.running_var"] + 1e-5)
                    h = (h - w[f"{norm}.running_mean"][:, None]) * scale[:, None] + w[f"{norm}.bias"][:, None]
                if conv == 0:
                    h = np.maximum(h, 0.0)
            h = np.maximum(h + given[:, given.shape[1] - h.shape[1] :], 0.0)
        features = h.reshape(1, -1) if last else h.T
        out.append(features @ w["head.weight"][0] + w["head.bias"])
    return np.array(out)


@pytest.mark.parametrize(
    "settings", [{}, {"head": "last"}, {"causal": True}, {"normalize": False}], ids=["each", "last", "causal", "plain"]
)
def test_output_is_that_of_the_layers_in_turn(settings):
    module, x = network(**settings), windows()
    words = {"causal": settings.get("causal", False), "last": "head" in settings}
    expected = by_hand(module, x, **words, normalize=settings.get("normalize", True))
    assert expected.std() > 0.1
    np.testing.assert_allclose(module(x).detach().numpy(), expected, rtol=1e-10, atol=1e-10)


def test_a_causal_output_does_not_see_the_future():
    """Reach of entry and two blocks of kernel 3: 1 + 2 * 5 = 11 samples."""
    assert reach(3, 2) == 11
    module, x = network(causal=True), windows(16)
    before = module(x)
    assert before.shape == (2, 6)
    seen = np.zeros((16, 6), dtype=bool)
    for row in range(16):
        changed = x.clone()
        changed[:, :, row] += 1.0
        seen[row] = (module(changed) != before).any(dim=0).numpy()
    # output i is that of sample i + 10
    for i in range(6):
        assert not seen[:i, i].any()
        assert not seen[i + 11 :, i].any()
        assert seen[i + 10, i]


def test_with_padding_an_output_sees_both_sides():
    module, x = network(), windows()
    changed = x.clone()
    changed[:, :, 6] += 1.0
    moved = (module(changed) != module(x)).any(dim=0)
    assert moved[:6].any()
    assert moved[7:].any()


def test_a_causal_window_gives_what_longer_ones_give_at_its_end():
    module, x = network(causal=True), windows(16)
    torch.testing.assert_close(module(x[:, :, 2:13])[:, 0], module(x)[:, 2], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("settings", [{}, {"head": "last"}, {"causal": True}, {"normalize": False}])
def test_an_untrained_network_returns_zeros_and_can_learn(settings):
    module, x = network(**settings).train(), windows()
    assert module(x).abs().max() > 0.01
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).pow(2).sum().backward()
    assert module.head.weight.grad.abs().max() > 0.0


def test_even_kernels_are_refused():
    with pytest.raises(ValueError, match="kernel 4 must be odd"):
        ResNet(3, kernel=4)
