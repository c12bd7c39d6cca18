"""What paper 000 prints (H. Wang and B. Zuo, Appl. Sci. 2025, 15, 3105): its Tables 1 to 6."""

from collections.abc import Mapping

NETWORKS: Mapping[str, str] = {"williams": "WilliamsNN", "bpnn": "BPNN", "resnet": "ResNet", "magtcn": "MagTCN"}
"""Names in the paper's tables of its networks, in the order of its columns."""

EPOCHS = (0, 50, 100, 150, 200)

LOSS_SIMULATED_NT2: Mapping[str, tuple[float, ...]] = {
    "williams": (93_392.16, 72_419.97, 36_749.54, 11_337.10, 1792.37),
    "bpnn": (47_583.50, 17_197.35, 9321.64, 1408.63, 303.06),
    "resnet": (969.29, 154.81, 47.71, 48.01, 42.36),
    "magtcn": (826.76, 39.44, 16.32, 9.84, 13.76),
}
"""Table 1, by epoch."""

LOSS_REAL_NT2: Mapping[str, tuple[float, ...]] = {
    "williams": (136_413.27, 1003.05, 827.44, 581.94, 301.49),
    "bpnn": (4169.42, 2757.40, 634.97, 498.35, 366.99),
    "resnet": (3383.46, 547.61, 381.90, 369.87, 288.07),
    "magtcn": (545.77, 48.16, 24.51, 19.68, 11.99),
}
"""Table 3, by epoch."""

Scores = Mapping[str, tuple[float, float]]
"""STD in 0.1 to 0.6 Hz after compensation [nT], and improvement ratio, by method."""

SIMULATED: Scores = {
    "williams": (1.320, 12.276),
    "bpnn": (0.551, 29.401),
    "resnet": (0.033, 480.082),
    "magtcn": (0.024, 651.61),
    "tl16": (0.037, 427.641),
}
"""Table 2."""

REAL_1002_20: Scores = {
    "williams": (1.399, 8.342),
    "bpnn": (1.098, 10.629),
    "resnet": (0.028, 402.786),
    "magtcn": (0.025, 455.920),
}
"""Table 4."""

REAL_1006_06: Scores = {
    "williams": (2.099, 7.298),
    "bpnn": (10.664, 1.436),
    "resnet": (0.049, 308.679),
    "magtcn": (0.037, 414.090),
}
"""Table 5."""

RAW_SIMULATED_NT, RAW_1002_20_NT, RAW_1006_06_NT = 16.2, 11.675, 15.32
"""STD in band before compensation: not printed, but STD times improvement ratio of all rows agree on it, where the STD
are cut and not rounded to their three decimals."""

COST: Mapping[str, tuple[float, float]] = {
    "williams": (0.428, 0.238),
    "bpnn": (0.046, 0.684),
    "resnet": (1.240, 105.541),
    "magtcn": (1.837, 95.722),
}
"""Table 6: time for one output [ms], of 30,000 at batch 1, and operations [million], which it prints as "MB"."""

RANKING = ("magtcn", "resnet", "tl16", "bpnn", "williams")
"""Methods by the improvement ratio of Table 2, best first."""
