"""A short tow with an instrument of every kind, as a scenario file."""

TEXT = """\
schema = 1
seed = 4
aircraft = "helicopter"

[start]
lat_deg = 48.70
lon_deg = 127.20
alt_m = 1250.0
speed_mps = 28.0

[terrain]
kind = "flat"
height_m = 330.0

[pattern]
kind = "straight"
leg_m = 1000.0

[tow]
bird = "bird"
settle_s = 20.0

[flight]
warmup_s = 30.0

[[sensors.scalar]]
name = "above"
mount = "tail"

[[sensors.scalar]]
name = "below"
body = "bird"
mount = "nose"

[[sensors.scalar]]
name = "boom"
body = "bird"
mount = "tail_boom"

[[sensors.fluxgate]]
name = "flux"
body = "bird"
mount = "fluxgate"

[[sensors.fluxgate]]
name = "cabin"
mount = "cabin"

[sensors.ins]
attitude_noise_deg = 0.01
position_noise_m = 0.02

[sensors.carrier_ins]
attitude_noise_deg = 0.01
skew_s = 0.05

[sensors.radar]
noise_m = 0.1
noise_relative = 0.0
max_range_m = 1500.0
"""
