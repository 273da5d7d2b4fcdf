# flexura: everything runs in an environment of its own, .venv, that the first target called sets up.
#   make demo      the paper's mechanism: check, modes, responses, its piezos, and pictures in out/
#   make test      the test suite, the same draws each time
#   make test-long  what takes longer: sweeps, sites, large solids, and random tests with new draws
#   make coverage  the tests, with the lines of the source that none of them runs; out/coverage shows them
#   make lint      ruff, pyright, all public types known, import rules, and that the pages' script is that of its source
#   make viewer    the pages' script, of its TypeScript
#   make bench     speed beside the best that there is else, one table; benchmarks/README.md
#   make docs      the site: all pages, the gallery, what docstrings and commands say
#   make release-check   sdist and wheel, tried in environments of their own: core alone, extras, least versions, docs
VENV := .venv
ifeq ($(OS),Windows_NT)
SHELL := bash
PYTHON ?= python
BIN := $(VENV)/Scripts
else
PYTHON ?= python3
BIN := $(VENV)/bin
endif
STAMP := $(VENV)/.ready
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: docs demo packages compiler test test-long coverage faults fuzz lint format viewer bench verification pictures release-check clean help
help:
	@sed -n '2,11s/^# *//p' Makefile

$(STAMP): pyproject.toml $(wildcard src/flexura/kernels/sources/*)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "flexura needs Python 3.11 or later; $(PYTHON) is $$($(PYTHON) --version 2>&1). Set PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "Python's venv module is missing. On Debian: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev,bench]'
	@touch $(STAMP)

demo: $(STAMP)
	@$(BIN)/python examples/rpr/demo.py

# CalculiX (GPL, run as a program of its own) for solid models; chromium for tests of pages
PACKAGES := chromium calculix-ccx
# a compiler for Arm, and qemu, which runs what it makes, for tests of C for microcontrollers
ARM := gcc-arm-linux-gnueabihf libc6-dev-armhf-cross qemu-user
packages: $(STAMP)
	@echo "Optional: CalculiX (GPL 2, a program of its own); see docs/releasing.md#licences-of-what-is-optional"
	@command -v ccx >/dev/null && command -v chromium >/dev/null && command -v qemu-arm >/dev/null && exit 0; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  (apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $(PACKAGES) $(ARM)) >/dev/null 2>&1 && exit 0; \
	fi; \
	echo "Tests of CalculiX, of pages in a browser and of Arm processors are skipped where these are missing. On Debian: apt-get install $(PACKAGES) $(ARM)"

# files of tests are shared between processes: a BLAS thread, a process and its fixtures for each; commands that tests
# start find their code compiled
RUN_TESTS = PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n $(PROCESSES) --dist loadfile --no-loadscope-reorder --durations=15
PROCESSES ?= 2
test: compiler
	$(RUN_TESTS) $(ARGS)

test-long: compiler
	FLEXURA_DRAWS=new $(RUN_TESTS) -m 'slow or hypothesis' $(ARGS)

# planted faults, each with the test that catches it: tools/faults.jsonl
faults: $(STAMP)
	$(BIN)/python tools/faults.py check $(ARGS)

coverage: compiler
	$(RUN_TESTS) --cov=flexura --cov-report=term:skip-covered --cov-report=html:out/coverage $(ARGS)

compiler: packages
	@$(BIN)/python tools/viewer.py --packages >/dev/null 2>&1 || \
	  echo "The packages of the pages' script cannot be had (npm ci): tests that need them are skipped."
	@command -v cc >/dev/null || command -v gcc >/dev/null || \
	  { echo "FMUs need a C compiler. On Debian: apt-get install gcc libc6-dev"; exit 1; }

# damaged files for as long as asked for: make fuzz ARGS="--seconds 600"
fuzz: $(STAMP)
	PYTHONPATH=tests $(BIN)/python -m helpers.fuzzer $(ARGS)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/python tools/public_types.py
	$(BIN)/lint-imports
	$(BIN)/python tools/viewer.py --check

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

viewer: $(STAMP)
	$(BIN)/python tools/viewer.py

bench: $(STAMP)
	$(BIN)/python benchmarks/bench.py $(ARGS)

# the site, in docs/_build/html; of every mechanism of the gallery a report, unless FLEXURA_REPORTS names some
docs: $(STAMP)
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

verification: $(STAMP)
	$(BIN)/python -m pytest tests/literature tests/opensees -m '' --verification-page docs/verification.md

# what is built is tried in environments of its own; docs/releasing.md
release-check:
	$(PYTHON) tools/release_check.py $(ARGS)

pictures: $(STAMP)
	$(BIN)/python docs/figures/make_figures.py
	$(BIN)/python docs/figures/file_keys.py
	$(BIN)/python docs/figures/rooms.py
	$(BIN)/python docs/figures/page_pictures.py

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache .hypothesis
