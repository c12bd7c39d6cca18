"""MagTCN: the temporal convolutional network of Wang and Zuo, Appl. Sci. 2025, 15, 3105, as a torch module.

The paper leaves sizes and order open; the forward pass here is the reconstruction whose multiply-accumulate count
meets the paper's (95.626 against 95.722 million at width 48). The paper's letters M, D, N are variables, time and
features; here M = variables (channels), T = time, D = features (width).
"""

from collections.abc import Sequence
from typing import Literal

import torch
from torch import Tensor, nn

Head = Literal["flat", "per-time", "last"]


class RevIN(nn.Module):
    """Reversible instance normalization: statistics of each window and channel over time (paper eq. 30 to 33)."""

    def __init__(self, channels: int, eps: float = 1e-5) -> None:
        super().__init__()
        self.gain = nn.Parameter(torch.ones(channels))
        self.offset = nn.Parameter(torch.zeros(channels))
        self.eps = eps

    def normalize(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return normalized (B, M, T) with the mean and the deviation (B, M, 1) that undo it."""
        mean = x.mean(dim=2, keepdim=True)
        deviation = torch.sqrt(x.var(dim=2, unbiased=False, keepdim=True) + self.eps)
        return self.gain[:, None] * (x - mean) / deviation + self.offset[:, None], mean, deviation

    def restore(self, y: Tensor, mean: Tensor, deviation: Tensor) -> Tensor:
        """Undo ``normalize`` on a (B, M, T) output of the same channels."""
        return (y - self.offset[:, None]) / self.gain[:, None] * deviation + mean


class DepthwiseFFT(nn.Module):
    """Depth-wise convolution over time with zero padding, by the convolution theorem.

    Equal to ``nn.Conv1d(c, c, kernel, padding=kernel // 2, groups=c)`` to float32 accuracy; several times faster
    on a CPU for long kernels. ``native`` selects the library's own convolution instead. ``causal`` takes the padding
    away, and with it the first ``kernel - 1`` samples: each output is of its own sample and those before it; outside
    of training no FFT is used then.
    """

    def __init__(self, groups: Sequence[int], kernel: int, *, native: bool = False, causal: bool = False) -> None:
        super().__init__()
        if kernel % 2 == 0:
            msg = f"kernel {kernel} must be odd, so that the output keeps its place in time"
            raise ValueError(msg)
        self.weight = nn.Parameter(torch.randn(*groups, kernel) / kernel**0.5)
        self.bias = nn.Parameter(torch.zeros(*groups))
        self.native = native
        self.causal = causal

    def forward(self, h: Tensor, embedding: tuple[Tensor, Tensor] | None = None) -> Tensor:
        """Convolve (*groups, B, T) along its last axis, each group with its own kernel.

        Parameters
        ----------
        h : (*groups, B, T)
            Or (M, B, T) with an embedding.
        embedding : ((M, D), (M, D)), optional
            Gain and offset that make D features of each variable first.
        """
        # the FFT spreads what comes later over all outputs by rounding
        exact = self.causal and not self.training
        if self.native or exact:
            return self._native(h if embedding is None else _embed(h, *embedding))
        # what wraps around must not reach the samples that are kept
        size = _fast_size(h.shape[-1] + self.weight.shape[-1] // 2)
        # nn.Conv1d correlates, so the kernel is flipped for a true convolution.
        kernels = torch.fft.rfft(self.weight.flip(-1), size)
        if embedding is None:
            spectrum = kernels.unsqueeze(-2) * torch.fft.rfft(h, size)
        else:
            spectrum = _embedded(kernels, h, size, *embedding)
        start = self.weight.shape[-1] - 1 if self.causal else self.weight.shape[-1] // 2
        stop = h.shape[-1] if self.causal else start + h.shape[-1]
        return torch.fft.irfft(spectrum, size)[..., start:stop] + self.bias[..., None, None]

    def _native(self, h: Tensor) -> Tensor:
        kernel, groups = self.weight.shape[-1], self.bias.numel()
        flat = h.flatten(0, -3).transpose(0, 1)
        padding = 0 if self.causal else kernel // 2
        out = nn.functional.conv1d(
            flat, self.weight.reshape(groups, 1, kernel), self.bias.flatten(), padding=padding, groups=groups
        )
        return out.transpose(0, 1).reshape(*h.shape[:-1], out.shape[-1])


def _embed(z: Tensor, gain: Tensor, offset: Tensor) -> Tensor:
    """Make (M, D, B, T) of (M, B, T)."""
    return torch.addcmul(offset[..., None, None], gain[..., None, None], z.unsqueeze(1))


def _embedded(kernels: Tensor, z: Tensor, size: int, gain: Tensor, offset: Tensor) -> Tensor:
    """Return the spectrum of what is embedded and convolved, from M transforms instead of M D.

    That of ``gain z + offset`` follows from those of z and of a constant.
    """
    constant = torch.fft.rfft(z.new_ones(z.shape[-1]), size)
    return torch.addcmul(
        (kernels * offset[..., None] * constant).unsqueeze(-2),
        (kernels * gain[..., None]).unsqueeze(-2),
        torch.fft.rfft(z, size).unsqueeze(1),
    )


def _fast_size(least: int) -> int:
    """Return the smallest number not below ``least`` with no prime factor but 2 and 3, which every FFT does well."""
    sizes = (2**i * 3**j for i in range(24) for j in range(3))
    return min(size for size in sizes if size >= least)


class GroupedMLP(nn.Module):
    """For each group its own feed-forward pair: linear up, exact GELU, linear down (the paper's PWBlock)."""

    def __init__(self, groups: int, size: int, expansion: int) -> None:
        super().__init__()
        hidden = size * expansion
        self.up = nn.Parameter(_uniform(groups, hidden, size))
        self.up_bias = nn.Parameter(torch.zeros(groups, hidden, 1))
        self.down = nn.Parameter(_uniform(groups, size, hidden))
        self.down_bias = nn.Parameter(torch.zeros(groups, size, 1))

    def forward(self, h: Tensor, merge: Tensor | None = None) -> Tensor:
        """Map (groups, size, n) to the same shape, or to (size, n) with weights (size, groups) that sum the groups."""
        h = nn.functional.gelu(torch.baddbmm(self.up_bias, self.up, h))
        if merge is None:
            return torch.baddbmm(self.down_bias, self.down, h)
        # a sum of products of matrices is one product of longer ones
        down = (merge.t().unsqueeze(2) * self.down).transpose(0, 1).flatten(1)
        offset = (merge.t().unsqueeze(2) * self.down_bias).sum(0)
        return torch.addmm(offset, down, h.flatten(0, 1))


def reach(kernel: int, blocks: int) -> int:
    """Return the samples that a causal output is made from, its own the last of them."""
    return 1 + (kernel - 1) * blocks


def _end(h: Tensor, length: int) -> Tensor:
    """Return the last samples of (..., T)."""
    return h[..., h.shape[-1] - length :]


def _uniform(groups: int, outputs: int, inputs: int) -> Tensor:
    bound = inputs**-0.5
    return torch.empty(groups, outputs, inputs).uniform_(-bound, bound)


class Block(nn.Module):
    """Depth-wise convolution, mixing of features per variable, mixing of variables per feature."""

    def __init__(self, channels: int, width: int, expansion: int, kernel: int, *, native: bool, causal: bool) -> None:
        super().__init__()
        self.time = DepthwiseFFT((channels, width), kernel, native=native, causal=causal)
        self.features = GroupedMLP(channels, width, expansion)
        self.variables = GroupedMLP(width, channels, expansion)

    def forward(
        self, h: Tensor, *, embedding: tuple[Tensor, Tensor] | None = None, merge: Tensor | None = None
    ) -> Tensor:
        """Map (M, D, B, T) to the same shape, shorter at its begin if causal.

        Parameters
        ----------
        h : (M, D, B, T)
            Or (M, B, T) with an embedding.
        embedding : ((M, D), (M, D)), optional
            Gain and offset of the features; see ``DepthwiseFFT``.
        merge : (M, D), optional
            Weights that sum the features: the result is (M, B, T).
        """
        h = self.time(h, embedding)
        shape = h.shape
        h = self.features(h.flatten(2))
        # the products of matrices take the second pair as it lies
        h = self.variables(h.transpose(0, 1), merge)
        return h.view(shape[0], *shape[2:]) if merge is not None else h.transpose(0, 1).reshape(shape)


class MagTCN(nn.Module):
    """MagTCN with one or more blocks.

    Parameters
    ----------
    channels : int
        Number of input variables, M. The paper has 19: 16 Tolles-Lawson columns and three angles.
    width : int
        Features per variable, D.
    expansion : int
        Widening inside the feed-forward pairs, r.
    kernel : int
        Length of the depth-wise kernels in samples, odd.
    window : int
        Samples of one window, T.
    head : {"flat", "per-time", "last"}
        ``flat``: all inputs of the window to all its T outputs; ``per-time``: one weight per variable, the same at
        every time; ``last``: all inputs of the window to one output at its last sample.
    revin : bool
        Normalize each window by its own statistics and undo it before the head.
    blocks : int
        With more than one, each adds to what it was given.
    native : bool
        Use the library's grouped convolution instead of the FFT.
    causal : bool
        Make each output of the head ``per-time`` from samples at its time and before: there is no padding, and the
        first samples of a window have no output.

    Raises
    ------
    ValueError
        If the kernel is even, or ``causal`` goes with window statistics or another head.
    """

    def __init__(
        self,
        channels: int,
        *,
        width: int = 8,
        expansion: int = 2,
        kernel: int = 51,
        window: int = 320,
        head: Head = "per-time",
        revin: bool = False,
        blocks: int = 1,
        native: bool = False,
        causal: bool = False,
    ) -> None:
        super().__init__()
        if causal and (revin or head != "per-time"):
            msg = f"causal goes with the head 'per-time' without revin, not with {head!r} and revin {revin}"
            raise ValueError(msg)
        self.revin = RevIN(channels) if revin else None
        self.embed = nn.Parameter(0.5 * torch.randn(channels, width))
        self.embed_bias = nn.Parameter(torch.zeros(channels, width))
        self.blocks = nn.ModuleList(
            Block(channels, width, expansion, kernel, native=native, causal=causal) for _ in range(blocks)
        )
        self.merge = nn.Parameter(torch.randn(channels, width) / width**0.5)
        self.merge_bias = nn.Parameter(torch.zeros(channels))
        self.per_time = head == "per-time"
        outputs = {"flat": window, "per-time": 1, "last": 1}[head]
        self.head = nn.Linear(channels if self.per_time else channels * window, outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T), to (B, T - reach + 1) if causal, or to (B, 1) with the head ``last``."""
        if self.revin is None:
            y = self._body(x)
        else:
            z, mean, deviation = self.revin.normalize(x)
            y = self.revin.restore(self._body(z), mean, deviation)
        y = y + _end(x, y.shape[-1])
        return self.head(y.transpose(1, 2)).squeeze(2) if self.per_time else self.head(y.flatten(1))

    def _body(self, z: Tensor) -> Tensor:
        """Map (B, M, T) through embedding, blocks and merging to the same shape, shorter at its begin if causal."""
        z, embedding = z.transpose(0, 1), (self.embed, self.embed_bias)
        if len(self.blocks) == 1:
            y = self.blocks[0](z, embedding=embedding, merge=self.merge)
        else:
            h = self.blocks[0](z, embedding=embedding)
            for block in self.blocks[1:]:
                out = block(h)
                h = out + _end(h, out.shape[-1])
            y = torch.einsum("md,mdbt->mbt", self.merge, h)
        return (y + self.merge_bias[:, None, None]).transpose(0, 1)

    def start_at_zero(self) -> None:
        """Set the head to zero, so that an untrained network returns zeros."""
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)
