# `make demo` and `make test` each set up everything from nothing and then do their job.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check install --quiet -c constraints.txt
# Tests start the command line often: it is to find its modules compiled.
PYTEST = PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest
# A cache of compiled kernels for one run; otherwise its folder is named after their sources.
FRESH = cache=$$(mktemp -d); trap 'rm -rf "$$cache"' EXIT; NUMBA_CACHE_DIR="$$cache"

# What an installation is made of, but for modules that it finds in place.
INSTALLED = pyproject.toml constraints.txt hatch_build.py $(wildcard src/strapdown/_kernels/*.py tools/kernels_to_c/*.*)

.PHONY: kernels demo test fuzz test-slow test-bounds examples papers record mutation check format bench docs audit codes strangers pictures studio wheels clean
.DEFAULT_GOAL := help

help:
	@echo "make demo       install into $(VENV) and run strapdown on built-in data"
	@echo "make test       install into $(VENV) and run the tests"
	@echo "make test-slow  the tests that take more than 4 s each"
	@echo "make fuzz       mutated files through our own parsers, led by coverage; MINUTES=n SEED=k"
	@echo "make examples   the longer examples of the manual and of the README: each prints what is shown"
	@echo "make record     version 0.1 and this tree on the same runs, compared to the last bit"
	@echo "make papers     the tests of the reproduced papers, and the three of them into papers-reproduced"
	@echo "make check      ruff, format, mypy, import-linter"
	@echo "make bench      speed and memory as ratios against named alternatives"
	@echo "make kernels    compile the kernels anew, after a change of their sources"
	@echo "make wheels     one wheel under several Pythons, compared to the byte; PYTHONS='python3.11 python3.12'"
	@echo "make audit      known vulnerabilities of the versions in constraints.txt"
	@echo "make studio     the front end of strapdown studio, from studio/ into the package; needs npm"
	@echo "make docs       the manual, into docs/_build"

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.run: $(INSTALLED) | $(VENV)/bin/python
	$(PIP) -e '.[pdf]'
	@touch $@

$(VENV)/.test: $(INSTALLED) | $(VENV)/bin/python
	$(PIP) -e '.[test]'
	@touch $@ $(VENV)/.run

$(VENV)/.dev: $(INSTALLED) | $(VENV)/bin/python
	$(PIP) -e '.[dev]'
	@touch $@ $(VENV)/.test $(VENV)/.run

# Where atheris has no wheel, the seeded mutator of tests/fuzz makes the inputs, and says so.
$(VENV)/.fuzz: $(VENV)/.test
	-$(PIP) -e '.[fuzz]'
	@touch $@

# In place, after a change of their sources.
kernels: $(VENV)/bin/python
	$(BIN)/python -m tools.kernels_to_c.build

demo: $(VENV)/.run
	$(BIN)/strapdown demo --out demo --force

test: $(VENV)/.test
	$(PYTEST) -n 2 --dist worksteal

# PART=k/N: every Nth file, from the kth, so that N machines run all of them.
test-slow: TESTS = $(if $(PART),$(shell find tests papers -name 'test_*.py' | LC_ALL=C sort | awk -v part=$(PART) 'BEGIN { split(part, p, "/") } NR % p[2] == p[1] % p[2]'),tests papers)
test-slow: $(VENV)/.test
	$(PYTEST) -n 2 --dist worksteal -m slow $(TESTS)

MINUTES ?= 1
SEED ?= 0
fuzz: $(VENV)/.fuzz
	OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/fuzz --minutes $(MINUTES) --seed $(SEED) $(FUZZ)

examples: $(VENV)/.test
	$(PYTEST) -n 2 --dist worksteal -m slow tests/cli/test_manual.py tests/cli/test_readme.py

test-bounds: $(VENV)/.test
	@folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; \
	$(BIN)/python -m tools.kernels_to_c.build --folder "$$folder" --flags="-DSD_BOUNDS -O1" && \
	STRAPDOWN_KERNELS=$$(echo "$$folder"/_compiled.*) $(PYTEST) tests/unit/kernels tests/contracts

record: $(VENV)/.run
	$(BIN)/python tests/record

mutation: $(VENV)/.test
	@$(FRESH) $(BIN)/python tests/mutation --jobs 2

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks

PYTHONS ?= python3.11 python3.12 python3.13
wheels: $(VENV)/.dev
	@$(BIN)/python tools/try_wheel.py $(PYTHONS)

codes: $(VENV)/.test
	STRAPDOWN_WRITE_CODES=1 $(PYTEST) -m '' tests/cli/test_bad_input.py

strangers: $(VENV)/.test
	STRAPDOWN_WRITE_STRANGERS=1 $(PYTEST) -m '' tests/reference/test_files_of_strangers.py

papers: $(VENV)/.test
	$(PYTEST) -n 2 --dist worksteal papers
	for paper in alexiev tadic chernodarov; do \
		$(BIN)/python -m papers.$$paper --out papers-reproduced/$$paper --quiet \
		|| exit 1; done

statements: $(VENV)/.test
	STRAPDOWN_WRITE_STATEMENTS=1 $(PYTEST) -m '' papers -k statements_of_this_code

pictures: $(VENV)/.test
	STRAPDOWN_WRITE_PICTURES=1 $(PYTEST) -m '' tests/cli/test_pictures.py papers -k picture

# The front end of strapdown studio. What it builds is committed: a bare machine has no node.
studio: studio/node_modules
	cd studio && npm run --silent check && npm run --silent build

studio/node_modules: studio/package-lock.json
	cd studio && npm ci
	@touch $@

audit: $(VENV)/.dev
	$(PIP) pip-audit
	$(BIN)/pip-audit -r constraints.txt --no-deps --disable-pip

docs: $(VENV)/.dev
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html

clean:
	rm -rf $(VENV) demo papers-reproduced docs/_build
