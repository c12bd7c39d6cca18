"""Devices that are asked for, there or not, and precision; what torch says of GPUs is replaced."""

import pytest
import torch

from magsim.errors import RequestError
from magsim.training import Machine, Plan, reproducible, seeded, train
from magsim.training.devices import InBfloat16, find_device, in_precision


@pytest.fixture
def gpus(monkeypatch):
    """Let the machine have two of them."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    monkeypatch.setattr(torch.version, "cuda", "13.0")


@pytest.fixture
def no_gpu(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)


@pytest.mark.usefixtures("no_gpu")
@pytest.mark.parametrize("name", ["cuda", "cuda:1"])
def test_a_device_that_is_not_there_is_refused(name):
    wanted = "cuda:0" if name == "cuda" else name
    with pytest.raises(
        RequestError, match=f"device {name} asks for {wanted}, which is not there; this machine has cpu"
    ):
        find_device(name)
    with pytest.raises(RequestError, match="which is not there"):
        train(torch.nn.Linear(1, 1), None, None, None, Plan(1), seed=0, machine=Machine(name))


@pytest.mark.usefixtures("no_gpu")
def test_without_a_gpu_auto_is_the_processor():
    assert find_device("auto") == find_device("cpu") == torch.device("cpu")


@pytest.mark.usefixtures("gpus")
def test_gpus_are_found_by_their_numbers():
    found = {name: str(find_device(name)) for name in ("cpu", "auto", "cuda", "cuda:0", "cuda:1")}
    assert found == {"cpu": "cpu", "auto": "cuda:0", "cuda": "cuda:0", "cuda:0": "cuda:0", "cuda:1": "cuda:1"}
    with pytest.raises(RequestError, match=r"cuda:2, which is not there; this machine has cpu, cuda:0, cuda:1$"):
        find_device("cuda:2")


@pytest.mark.usefixtures("gpus")
def test_under_torchrun_each_process_has_a_gpu_of_its_own(monkeypatch):
    for name, value in {"RANK": "3", "WORLD_SIZE": "4", "LOCAL_RANK": "1", "MASTER_ADDR": "here"}.items():
        monkeypatch.setenv(name, value)
    assert str(find_device("cuda")) == str(find_device("auto")) == "cuda:1"
    with pytest.raises(RequestError, match="each process of torchrun needs a GPU of its own; allowed: cpu, cuda, auto"):
        find_device("cuda:0")


@pytest.mark.usefixtures("gpus")
def test_the_workspace_of_cublas_is_set_where_bits_must_be_the_same(monkeypatch):
    monkeypatch.setenv("CUBLAS_WORKSPACE_CONFIG", "")
    monkeypatch.delenv("CUBLAS_WORKSPACE_CONFIG")
    with reproducible(deterministic=False):
        assert not torch.are_deterministic_algorithms_enabled()
        assert "CUBLAS_WORKSPACE_CONFIG" not in torch.os.environ
    with reproducible():
        assert torch.are_deterministic_algorithms_enabled()
        assert torch.os.environ["CUBLAS_WORKSPACE_CONFIG"] == ":4096:8"


def test_bfloat16_is_refused_where_it_does_not_help():
    module = torch.nn.Linear(1, 1)
    assert in_precision(module, "float32", torch.device("cpu")) is module
    assert isinstance(in_precision(module, "bf16", torch.device("cuda")), InBfloat16)
    with pytest.raises(RequestError, match="precision bf16: on a CPU it is slower than float32"):
        train(module, None, None, None, Plan(1), seed=0, machine=Machine(precision="bf16"))


def test_a_network_in_bfloat16_gives_float32_and_trains_the_same_parameters():
    with seeded(0):
        module, x = torch.nn.Linear(64, 8), torch.randn(16, 64)
    narrow = InBfloat16(module, "cpu")
    out, exact = narrow(x), module(x)
    assert out.dtype == torch.float32
    error = (out - exact).abs().max().item()
    assert 0.0 < error < 0.05
    (out**2).mean().backward()
    assert module.weight.grad.dtype == torch.float32
