"""Surfaces as files of triangles."""

import trimesh

from magsim.field.geometry.meshes import TriangleMesh


def exported(kind: str, surface: TriangleMesh, **options: object) -> bytes:
    """Return a surface as a file of some kind."""
    content = trimesh.Trimesh(surface.vertices, surface.triangles, process=False).export(file_type=kind, **options)
    return content if isinstance(content, bytes) else content.encode()
