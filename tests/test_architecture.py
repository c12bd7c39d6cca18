"""The form of the code: no circle between files, none over 400 lines, class names that tell meanings apart."""

import ast
from collections import defaultdict

import grimp
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from tests.support.paths import ROOT

MOST_LINES = 400


def test_no_files_import_each_other_in_a_circle():
    graph = grimp.build_graph("magsim", exclude_type_checking_imports=False)
    modules = sorted(graph.modules)
    number = {name: i for i, name in enumerate(modules)}
    edges = [(number[a], number[b]) for a in modules for b in graph.find_modules_directly_imported_by(a)]
    rows, columns = np.array(edges).T
    links = csr_matrix((np.ones(len(edges)), (rows, columns)), shape=(len(modules), len(modules)))
    _, part = connected_components(links, directed=True, connection="strong")
    circles = defaultdict(list)
    for name, label in zip(modules, part, strict=True):
        circles[label].append(name)
    assert [members for members in circles.values() if len(members) > 1] == []


def test_no_file_is_longer_than_one_subject_needs():
    files = [*(ROOT / "magsim").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]
    lengths = {str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert {name: count for name, count in lengths.items() if count > MOST_LINES} == {}


def test_public_classes_of_one_name_are_one_thing():
    found = defaultdict(set)
    for path in (ROOT / "magsim").rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].add(str(path.relative_to(ROOT)))
    twice = {name: sorted(paths) for name, paths in found.items() if len(paths) > 1}
    assert twice == {}
