"""Triangles and tetrahedra: meshes, mesh files, refinement, soundness, and potential integrals over panels."""
