# `make calibrate` and `make test` each do all the set-up on a machine with Python >= 3.11 and nothing else.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

SUITABLE := import sys; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for name in python3 python3.13 python3.12 python3.11 python3.14 python; do \
	"$$name" -c '$(SUITABLE)' >/dev/null 2>&1 && echo "$$name" && break; done)
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check

# Tests, the programs that they start and both suites share the bytecode, even where the environment says not to write it.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help calibrate test short slow slow-tests budget docs lint lock clean

help:
	@echo "make calibrate   main job: calibration coefficients of the default finger, in calibration/"
	@echo "make test        linters, type checker and the quick tests"
	@echo "make short       the short ones of the quick tests, in a minute, once make test has timed them"
	@echo "make slow        the tests that take more than a few seconds each, and what the main jobs cost"
	@echo "make docs        the documentation site, in docs/_build/html; a warning is an error"
	@echo "make lint        linters and type checker only"
	@echo "make lock        resolve the locked dependencies anew"
	@echo "make clean       remove $(VENV), calibration/ and tool caches"

calibrate: $(VENV)/.runtime
	$(BIN)/papilla calibrate

# Two processes of one thread each use two cores better than one process of two threads.
JOBS ?= 2
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 RAYON_NUM_THREADS=1

PYTEST := $(ONE_THREAD) $(BIN)/python -m pytest --numprocesses $(JOBS) --dist worksteal

test: lint
	$(PYTEST) -m "not slow"

# What they need from papilla's cache is kept until `make clean`.
short: export PAPILLA_TEST_CACHE = $(CURDIR)/.pytest_cache/papilla
short: $(VENV)/.dev
	$(PYTEST) -m "not slow" --short

slow: slow-tests
	$(MAKE) budget

slow-tests: $(VENV)/.dev
	$(PYTEST) -m slow

budget: $(VENV)/.dev
	$(BIN)/python benchmarks/budget.py

docs: $(VENV)/.dev
	rm -rf docs/_build docs/generated
	$(ONE_THREAD) $(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -b html docs docs/_build/html

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Wheels are checked against the lock's hashes; papilla itself is then built with the locked setuptools, in the editable
# mode whose path type checkers and editors follow.
$(VENV)/.runtime: requirements.lock pyproject.toml | $(VENV)/bin/python
	$(INSTALL) --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation --config-settings editable_mode=compat --editable .
	touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.runtime
	$(INSTALL) --require-hashes -r requirements-dev.lock
	touch $@

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "papilla needs Python >= 3.11; none was found (set PYTHON=...)" >&2; exit 2; }
	@"$(PYTHON)" -c '$(SUITABLE)' || { echo "papilla needs Python >= 3.11; $(PYTHON) is older" >&2; exit 2; }
	"$(PYTHON)" -m venv $(VENV)

UV_LOCK := $(BIN)/uv pip compile --quiet --generate-hashes --no-emit-index-url --no-annotate --no-header \
	--python-version 3.11 pyproject.toml

lock: $(VENV)/.dev
	$(INSTALL) uv
	echo 'setuptools>=77' | $(UV_LOCK) - --output-file requirements.lock
	$(UV_LOCK) --extra dev --constraint requirements.lock --output-file requirements-dev.lock

clean:
	rm -rf $(VENV) calibration docs/_build docs/generated .pytest_cache .ruff_cache .mypy_cache
