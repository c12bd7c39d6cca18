"""MagTCN against the published counts and torch's own layers."""

import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from magsim.compensation.networks.modules.magtcn import DepthwiseFFT, GroupedMLP, MagTCN, RevIN, reach


def multiply_accumulates(
    channels: int, *, width: int, expansion: int = 2, kernel: int = 51, window: int = 320, head: str = "per-time"
) -> int:
    """Count the multiply-accumulates of one window through a MagTCN of one block; convolutions count directly."""
    m, d, r, t = channels, width, expansion, window
    body = 2 * m * d * t + m * d * t * kernel + 2 * r * m * t * d**2 + 2 * r * d * t * m**2
    return body + {"flat": m * t * t, "per-time": m * t, "last": m * t}[head]


def count(module):
    return sum(parameter.numel() for parameter in module.parameters())


@pytest.mark.parametrize(
    ("width", "head", "parameters", "million"),
    [
        (48, "flat", 2_246_025, 95.626),
        (16, "flat", 2_007_081, 20.72),
        (8, "flat", 1_971_665, 9.78),
        (8, "per-time", 25_765, 7.84),
        (4, "per-time", 11_705, 3.53),
    ],
)
def test_sizes_of_the_reconstruction(width, head, parameters, million):
    """Width 48 meets the paper's 95.722 million multiply-accumulates to 0.1 %."""
    assert count(MagTCN(19, width=width, head=head, revin=True)) == parameters
    got = multiply_accumulates(19, width=width, head=head) / 1e6
    assert got == pytest.approx(million, abs=0.006)


def test_multiply_accumulates_are_those_that_torch_counts():
    """Convolution, matrix products and head by torch's own counter; the others are broadcast products."""
    module = MagTCN(5, width=4, kernel=11, window=64, native=True)
    with FlopCounterMode(display=False) as counter:
        module(torch.zeros(1, 5, 64))
    embedding = merging = 5 * 4 * 64
    assert counter.get_total_flops() / 2 + embedding + merging == multiply_accumulates(5, width=4, kernel=11, window=64)


@pytest.mark.parametrize(("length", "kernel"), [(320, 51), (77, 5), (20, 31)])
def test_convolution_by_fft_is_torchs_own(length, kernel):
    torch.manual_seed(0)
    layer = DepthwiseFFT((3, 4), kernel)
    native = torch.nn.Conv1d(12, 12, kernel, padding=kernel // 2, groups=12)
    with torch.no_grad():
        layer.bias.normal_()
        native.weight.copy_(layer.weight.reshape(12, 1, kernel))
        native.bias.copy_(layer.bias.flatten())
    h = torch.randn(3, 4, 6, length)
    expected = native(h.flatten(0, 1).transpose(0, 1)).transpose(0, 1).reshape(h.shape)
    tolerance = {"rtol": 1e-5, "atol": 1e-5}
    torch.testing.assert_close(layer(h), expected, **tolerance)
    layer.native = True
    torch.testing.assert_close(layer(h), expected, **tolerance)


def test_convolution_by_fft_has_the_same_gradient():
    torch.manual_seed(0)
    layer = DepthwiseFFT((2, 3), 7).double()
    h = torch.randn(2, 3, 2, 40, dtype=torch.double)
    grads = []
    for native in (False, True):
        layer.native = native
        layer.zero_grad()
        (layer(h) ** 3).sum().backward()
        grads.append(layer.weight.grad.clone())
    torch.testing.assert_close(*grads, rtol=1e-10, atol=1e-10)


def test_revin_undoes_itself_and_normalizes():
    torch.manual_seed(0)
    layer = RevIN(5)
    with torch.no_grad():
        layer.gain.uniform_(0.5, 2.0)
        layer.offset.normal_()
    x = 100.0 + 7.0 * torch.randn(4, 5, 320)
    z, mean, deviation = layer.normalize(x)
    plain = (z - layer.offset[:, None]) / layer.gain[:, None]
    torch.testing.assert_close(plain.mean(dim=2), torch.zeros(4, 5), rtol=0, atol=1e-4)
    torch.testing.assert_close(plain.std(dim=2, unbiased=False), torch.ones(4, 5), rtol=1e-4, atol=0)
    torch.testing.assert_close(layer.restore(z, mean, deviation), x, rtol=1e-5, atol=1e-3)


def test_grouped_perceptron_is_one_perceptron_for_each_group():
    torch.manual_seed(0)
    layer = GroupedMLP(3, 4, 2)
    with torch.no_grad():
        layer.up_bias.normal_()
        layer.down_bias.normal_()
    h = torch.randn(3, 4, 10)
    for g in range(3):
        up, down = torch.nn.Linear(4, 8), torch.nn.Linear(8, 4)
        with torch.no_grad():
            up.weight.copy_(layer.up[g])
            up.bias.copy_(layer.up_bias[g, :, 0])
            down.weight.copy_(layer.down[g])
            down.bias.copy_(layer.down_bias[g, :, 0])
        expected = down(torch.nn.GELU()(up(h[g].T))).T
        torch.testing.assert_close(layer(h)[g], expected)


def test_the_paths_inside_magtcn():
    """With the merge at zero the head sees the raw inputs: a linear model is a special case (paper eq. 34)."""
    torch.manual_seed(0)
    module = MagTCN(6, width=3, kernel=5, window=40)
    with torch.no_grad():
        module.merge.zero_()
    x = torch.randn(2, 6, 40)
    expected = torch.einsum("m,bmt->bt", module.head.weight[0], x) + module.head.bias
    torch.testing.assert_close(module(x), expected)


@pytest.mark.parametrize("head", ["flat", "per-time", "last"])
@pytest.mark.parametrize("revin", [False, True])
def test_outputs_and_start(head, revin):
    torch.manual_seed(0)
    module = MagTCN(6, width=3, kernel=5, window=40, head=head, revin=revin, blocks=2)
    x = torch.randn(2, 6, 40)
    assert module(x).shape == ((2, 1) if head == "last" else (2, 40))
    assert module(x).abs().max() > 0.01
    module.start_at_zero()
    assert not module(x).any()
    module(x).pow(2).sum().backward()


@pytest.mark.parametrize("blocks", [1, 2])
def test_a_causal_output_does_not_see_the_future(blocks):
    """Exactly so when it is used, to rounding while it trains; kernels of 5 reach 5 samples, two of them 9."""
    torch.manual_seed(0)
    module = MagTCN(4, width=3, kernel=5, window=20, blocks=blocks, causal=True).double()
    x = torch.randn(2, 4, 20, dtype=torch.double)
    assert reach(5, blocks) == 1 + 4 * blocks
    count = 20 - 4 * blocks
    rough = module.train()(x)
    before = module.eval()(x)
    assert before.shape == (2, count)
    torch.testing.assert_close(rough, before, rtol=1e-10, atol=1e-10)
    for row in range(20):
        changed = x.clone()
        changed[:, :, row] += 1.0
        moved = (module(changed) != before).any(dim=0)
        # output i is that of sample i + 20 - count
        assert not moved[: max(row - 20 + count, 0)].any()
        assert moved[max(row - 20 + count, 0) : row + 1].all()
        assert not moved[row + 1 :].any()


def test_a_causal_window_gives_what_longer_ones_and_the_centered_convolution_give():
    torch.manual_seed(0)
    module = MagTCN(4, width=3, kernel=5, window=20, causal=True).double().eval()
    x = torch.randn(2, 4, 20, dtype=torch.double)
    torch.testing.assert_close(module(x[:, :, 3:8])[:, 0], module(x)[:, 3], rtol=1e-12, atol=1e-12)
    centered = MagTCN(4, width=3, kernel=5, window=20).double().eval()
    centered.load_state_dict(module.state_dict())
    with torch.no_grad():
        # the body alone: the same samples under the kernel, two samples later
        torch.testing.assert_close(module._body(x), centered._body(x)[:, :, 2:-2], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("settings", [{"revin": True}, {"head": "flat"}, {"head": "last"}])
def test_what_sees_the_whole_window_is_not_causal(settings):
    with pytest.raises(ValueError, match="causal goes with the head 'per-time' without revin"):
        MagTCN(3, causal=True, **settings)


def test_variables_mix_in_the_second_pair_alone():
    """Before it, each variable is embedded, convolved and widened by itself."""
    torch.manual_seed(0)
    module = MagTCN(4, width=3, kernel=5, window=32)
    block = module.blocks[0]
    h = torch.randn(4, 3, 1, 32)
    changed = h.clone()
    changed[2] += 1.0
    before = [block.features(block.time(v).flatten(2)) for v in (h, changed)]
    same = [torch.equal(before[0][m], before[1][m]) for m in range(4)]
    assert same == [True, True, False, True]
    assert not any(torch.equal(block(h)[m], block(changed)[m]) for m in range(4))


def test_even_kernels_are_refused():
    with pytest.raises(ValueError, match="must be odd"):
        MagTCN(3, kernel=50)


def _by_the_formulas(module, x):
    """Paper's steps one after the other: embedding, convolution, both pairs, merging."""
    z = x.transpose(0, 1).unsqueeze(1)
    h = module.embed_bias[..., None, None] + module.embed[..., None, None] * z
    for number, block in enumerate(module.blocks):
        kernel = block.time.weight.flatten(0, 1).unsqueeze(1)
        padding = 0 if block.time.causal else kernel.shape[-1] // 2
        groups = len(kernel)
        flat = h.flatten(0, 1).transpose(0, 1)
        out = torch.nn.functional.conv1d(flat, kernel, block.time.bias.flatten(), padding=padding, groups=groups)
        out = out.transpose(0, 1).unflatten(0, h.shape[:2])
        shape = out.shape
        out = block.features(out.flatten(2))
        out = block.variables(out.transpose(0, 1).contiguous()).transpose(0, 1).reshape(shape)
        h = out if number == 0 else out + h[..., h.shape[-1] - out.shape[-1] :]
    y = torch.einsum("md,mdbt->bmt", module.merge, h) + module.merge_bias[:, None]
    y = y + x[..., x.shape[-1] - y.shape[-1] :]
    return module.head(y.transpose(1, 2)).squeeze(2)


@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("blocks", [1, 2])
def test_what_is_computed_together_is_what_the_formulas_say(blocks, causal):
    torch.manual_seed(0)
    module = MagTCN(5, width=3, kernel=11, window=64, blocks=blocks, causal=causal).double()
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
    x = torch.randn(3, 5, 64, dtype=torch.double)
    ends = []
    for function in (module, lambda x: _by_the_formulas(module, x)):
        module.zero_grad()
        out = function(x)
        (out**3).sum().backward()
        ends.append((out.detach(), [parameter.grad.clone() for parameter in module.parameters()]))
    torch.testing.assert_close(*ends, rtol=1e-10, atol=1e-10)
