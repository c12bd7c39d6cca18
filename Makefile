# make demo   from a scenario to a scored compensation, with figures, into demo/
# make test   lint and all tests
# make test-heavy   whole quick runs of the two largest papers, a minute
# make lint   style, types, import contracts
# make datasets   build every data set into data/ and renew its manifest
#
# Each sets up .venv first, and again when pyproject.toml changes. Needed: Python 3.11, 3.12 or 3.13, and make.

VENV := .venv
STAMP := $(VENV)/magsim.stamp
TORCH := 2.13.0
TORCH_INDEX := https://download.pytorch.org/whl/cpu

# The first Python of a version that fits and that can make environments; `make PYTHON=/path/to/python` names another.
PYTHON ?= $(shell for python in python3.11 python3.12 python3.13 python3 python; do \
	if "$$python" -c 'import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' \
		>/dev/null 2>&1; then echo "$$python"; break; fi; done)

export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help demo test test-heavy lint pytest datasets environment

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

demo: $(STAMP)
	$(VENV)/bin/magsim demo

# The types take a minute on one core, so they are checked beside the tests.
test: $(STAMP)
	$(MAKE) --no-print-directory -j 2 lint pytest

pytest: $(STAMP)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(VENV)/bin/python -m pytest -n 2 --dist loadfile

test-heavy: $(STAMP)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(VENV)/bin/python -m pytest -n 2 --dist loadfile -m heavy

lint: $(STAMP)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

datasets: $(STAMP)
	for recipe in datasets/*/recipe.toml; do \
		$(VENV)/bin/magsim dataset build "$$(basename "$$(dirname "$$recipe")")" --renew --force || exit 1; \
	done

environment: $(STAMP)

# The build of torch for CPUs alone comes first: the default one brings gigabytes of CUDA.
$(STAMP): pyproject.toml
	@if ! $(VENV)/bin/python -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' >/dev/null 2>&1; then \
		if [ -z "$(PYTHON)" ]; then \
			echo "magsim needs Python 3.11, 3.12 or 3.13 with its venv module, and none was found." >&2; \
			echo "Install one (https://www.python.org/downloads/), or name it: make PYTHON=/path/to/python3.11" >&2; \
			exit 1; \
		fi; \
		echo "Setting up $(VENV) with $(PYTHON)"; \
		"$(PYTHON)" -m venv --clear $(VENV); \
	fi
	@echo "Installing what magsim needs into $(VENV); the first time takes some minutes"
	@$(VENV)/bin/python -c 'import sys, importlib.metadata as m; \
		sys.exit(m.version("torch").partition("+")[0] != "$(TORCH)")' >/dev/null 2>&1 \
		|| $(VENV)/bin/python -m pip install --quiet "torch==$(TORCH)+cpu" 2>/dev/null \
		|| $(VENV)/bin/python -m pip install --quiet "torch==$(TORCH)" --extra-index-url $(TORCH_INDEX)
	@$(VENV)/bin/python -m pip uninstall --quiet --yes magsim 2>/dev/null || true  # its name before this one
	@$(VENV)/bin/python -m pip install --quiet --editable '.[dev]'
	@touch $@
