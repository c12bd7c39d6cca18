"""The exact norm: vector sources on a calibrated background, and the length of their sum."""

from magsim.compensation.exact_norm.method import ExactNorm

__all__ = ["ExactNorm"]
