"""Torch modules: windows (B, M, T) in, (B, T) or the last sample (B, 1) out. They know no recording."""
