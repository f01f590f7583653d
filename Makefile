# `make run` and `make test` are all that a machine with Python >= 3.11, make and git needs to know.

PYTHON ?= python3
WORLD ?= worlds/office.yaml
WORKERS ?= 2
WORLDS ?= 500

IDEA := clo_fleet/clo tests/unit/clo tests/property

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help run test format-check lint types imports tests study soak bench format lock clean
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

help:
	@echo "make run     drive one world: WORLD=$(WORLD)"
	@echo "make test    every gate: format, lint, types, imports, tests"
	@echo "make study   the long studies"
	@echo "make soak    hundreds of random worlds with random faults, watched: WORLDS=$(WORLDS)"
	@echo "make bench   how fast it is: ratios and tables, nothing asserted"
	@echo "make format  bring all files into form"
	@echo "make lock    lock the newest versions that pyproject.toml allows into constraints.txt"
	@echo "make clean   remove the environment and all caches"

run: $(READY)
	$(BIN)/clo-fleet run $(WORLD) --force

test: format-check lint types imports tests

format-check: $(READY)
	$(BIN)/ruff format --check

lint: $(READY)
	$(BIN)/ruff check

types: $(READY)
	$(BIN)/mypy

imports: $(READY)
	$(BIN)/lint-imports

# The idea is tested to its last branch, by its own tests. All other tests run without measuring that: simulations would
# take three times as long.
tests: $(READY)
	$(BIN)/pytest -n $(WORKERS) --cov --cov-report=term --cov-fail-under=100 $(IDEA)
	$(BIN)/pytest -n $(WORKERS) --dist worksteal $(IDEA:%=--ignore=%) tests

study: $(READY)
	$(BIN)/pytest -m study --timeout=0

soak: $(READY)
	$(BIN)/python -m clo_fleet.testing.soak --worlds $(WORLDS)

bench: $(READY)
	$(BIN)/pytest -m bench --timeout=0 -s tests/bench

format: $(READY)
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

# The environment: exactly what constraints.txt locks, then this checkout itself, then what pip cannot install.
$(READY): constraints.txt pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --disable-pip-version-check --require-hashes -r constraints.txt
	$(BIN)/python -m pip install --disable-pip-version-check --no-deps --no-build-isolation --no-index -e .
	$(BIN)/python -m pip check --disable-pip-version-check
	$(BIN)/python -m clo_fleet.sim.preflight
	@touch $@

$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || { \
	  echo "clo-fleet needs Python 3.11 or newer, and there is no $(PYTHON) here."; \
	  echo "Debian, Ubuntu: apt-get install python3 python3-venv    Fedora: dnf install python3"; exit 1; } >&2
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "clo-fleet needs Python 3.11 or newer, and $(PYTHON) is $$($(PYTHON) --version 2>&1)."; \
	  echo "Name a newer one: make PYTHON=python3.12 ..."; exit 1; } >&2
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "$(PYTHON) cannot make virtual environments: its module ensurepip or venv is missing."; \
	  echo "Debian, Ubuntu: apt-get install python3-venv    Fedora: dnf install python3-pip"; exit 1; } >&2
	$(PYTHON) -m venv --clear $(VENV)

# Locked with the oldest Python that we support, so that every newer one can install it, and from the public index
# alone: a machine's own mirrors and wheels would add hashes of files that nobody else can get.
lock: | $(BIN)/python
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || { \
	  echo "Lock with Python 3.11: make clean, then make lock PYTHON=python3.11"; exit 1; } >&2
	$(BIN)/python -m pip install --disable-pip-version-check --quiet pip-tools
	env -u PIP_FIND_LINKS -u PIP_EXTRA_INDEX_URL PIP_CONFIG_FILE=/dev/null CUSTOM_COMPILE_COMMAND="make lock" \
	  $(BIN)/python -m piptools compile --quiet --upgrade --all-extras --build-deps-for=editable --allow-unsafe \
	  --generate-hashes --strip-extras --no-annotate --no-emit-index-url --no-emit-find-links --no-emit-trusted-host \
	  --output-file=constraints.txt pyproject.toml

clean:
	rm -rf $(VENV) .coverage .coverage.* .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
