"""An aircraft's steel with every kind of part that needs no file, about as large as a Cessna 208B has them."""

from magsim.aircraft.magnetics import Magnetics, Steel

TANK = {
    "kind": "box_sheet",
    "name": "tank",
    "center_m": [-1.8, 0.0, 0.4],
    "size_m": [1.0, 0.8, 0.6],
    "thickness_m": 0.0015,
    "element_m": 0.1,
}
ENGINE = {
    "kind": "cylinder",
    "name": "engine",
    "center_m": [3.4, 0.0, 0.0],
    "axis": [1.0, 0.0, 0.0],
    "radius_m": 0.24,
    "length_m": 1.4,
    "rings": 3,
    "layers": 8,
    "mu_r": 1.75,
}
FIREWALL = {
    "kind": "plate",
    "name": "firewall",
    "center_m": [2.25, 0.0, 0.1],
    "normal": [1.0, 0.0, 0.0],
    "along": [0.0, 1.0, 0.0],
    "size_m": [1.2, 1.0],
    "thickness_m": 0.0008,
    "element_m": 0.12,
}
RAIL = {
    "kind": "strip",
    "name": "seat_rail",
    "mirror": True,
    "points_m": [[0.9, 0.5, 0.65], [-0.9, 0.5, 0.65]],
    "facing": [0.0, 0.0, 1.0],
    "width_m": 0.04,
    "thickness_m": 0.002,
    "element_m": 0.1,
}
MOUNT = {
    "kind": "tube",
    "name": "engine_mount",
    "mirror": True,
    "points_m": [[2.35, 0.5, 0.4], [2.9, 0.35, 0.2], [3.0, 0.35, -0.2]],
    "radius_m": 0.012,
    "thickness_m": 0.0015,
    "element_m": 0.08,
}
LEG = {
    "kind": "loft",
    "name": "gear_leg",
    "mirror": True,
    "shape": "rectangle",
    "across": [1.0, 0.0, 0.0],
    "sections": [
        {"center_m": [-0.3, 0.6, 0.85], "size_m": [0.12, 0.05]},
        {"center_m": [-0.3, 1.3, 1.2], "size_m": [0.10, 0.04]},
        {"center_m": [-0.3, 1.7, 1.7], "size_m": [0.08, 0.03]},
    ],
    "element_m": 0.08,
}
BALLAST = {
    "kind": "bar",
    "name": "ballast",
    "center_m": [-6.0, 0.0, 0.0],
    "along": [0.6, 0.8, 0.0],
    "across": [-0.8, 0.6, 0.0],
    "size_m": [0.3, 0.1, 0.05],
    "element_m": 0.05,
}
ALL_KINDS = (TANK, ENGINE, FIREWALL, RAIL, MOUNT, LEG, BALLAST)


def magnetics(*parts: dict, **more: object) -> Magnetics:
    """A magnetic file with these parts of steel and one mount high above them."""
    mounts = {"mast": {"position_m": [0.0, 0.0, -4.0], "source": "a test"}}
    steel = [{"mu_r": 150.0, "source": "a test"} | part for part in parts]
    return Magnetics.model_validate({"datum": "a test", "mounts": mounts, "steel": steel} | more)


def steel(*parts: dict) -> tuple[Steel, ...]:
    """Parts of steel as the magnetic file has them."""
    return magnetics(*parts).steel
