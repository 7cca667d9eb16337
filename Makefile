# make demo and make test set up everything they need from Python 3.11+ and pip alone.
PYTHON ?= python3
BIN := .venv/bin
BENCH_BIN := .venv-bench/bin
# what is imported is compiled when it is: all modules of all packages took longer than the rest of the set-up
INSTALL := -m pip install -q --disable-pip-version-check --no-compile -c constraints.txt
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
# where no bytecode may be written (containers often say so), every Python that a test or a run starts would
# compile all packages anew, which takes longer than all the rest of importing them: kept out of the tree
ifdef PYTHONDONTWRITEBYTECODE
KEPT := env -u PYTHONDONTWRITEBYTECODE PYTHONPYCACHEPREFIX=$(CURDIR)/.venv/bytecode
endif

.PHONY: help setup demo test laws fast one format check slow counts bench wheel oldest house hooks clean

# T: what `make one` runs, e.g. make one T=tests/unit/space or T="tests/unit/doe -k ihs"
T ?= tests/unit
NOT_SLOW := not slow and not peer and not bench and not browser

help:
	@echo "make demo    run the main job from nothing to a report"
	@echo "make fast    unit tests and the table of rooms, under a minute"
	@echo "make one     the tests of one room: make one T=tests/unit/space"
	@echo "make format  lay the code out and mend what lint can mend"
	@echo "make check   lint, spelling and types"
	@echo "make test    run the tests (a few minutes)"
	@echo "make laws    the laws on examples drawn anew (make test repeats the same ones)"
	@echo "make slow    slow, peer and fault tests"
	@echo "make counts  claims and kills that are counted over many functions and seeds"
	@echo "make bench   ours beside the peers; times are appended to tests/bench/history.csv"
	@echo "make wheel   build the wheel and try it in an empty environment"
	@echo "make oldest  unit tests with the oldest dependencies, and on the newest Python"
	@echo "make house   draw the rooms anew in docs/explanation/architecture.md"
	@echo "make hooks   check style and spelling before every commit"

.venv/.core: pyproject.toml constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python $(INSTALL) -e .
	@touch $@

.venv/.installed: .venv/.core
	$(BIN)/python $(INSTALL) -e ".[dev,netcdf]"
	@touch $@

.venv/.peers: .venv/.installed
	$(BIN)/python $(INSTALL) -e ".[dev,netcdf,fmi,dask,peers]"
	@touch $@

.venv-bench/.installed: pyproject.toml constraints.txt
	@test -x $(BENCH_BIN)/python || $(PYTHON) -m venv .venv-bench
	$(BENCH_BIN)/python $(INSTALL) -e ".[dev,netcdf,fmi,dask,peers,bench]"
	@touch $@

setup: .venv/.installed

demo: .venv/.core
	$(KEPT) $(BIN)/holdfast demo

# a file's tests in one process: what they compile is compiled once
test: .venv/.installed
	$(KEPT) $(BIN)/python -m pytest -q -n 2 --dist loadfile --durations=10 -m "$(NOT_SLOW)"

laws: .venv/.installed
	$(BIN)/python -m pytest -q -n 2 --hypothesis-profile=explore -m "$(NOT_SLOW)" tests/laws

fast: .venv/.installed
	$(BIN)/python -m pytest -q -n 2 --durations=10 -m "$(NOT_SLOW) and not long" tests/unit tests/test_architecture.py

one: .venv/.installed
	$(BIN)/python -m pytest --durations=10 $(T)

format: .venv/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

house: .venv/.installed
	$(BIN)/python -m tests.house --write

hooks: .venv/.installed
	$(BIN)/pre-commit install

check: .venv/.installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/codespell
	$(BIN)/mypy

slow: .venv/.peers
	$(BIN)/python -m pytest -q -n 2 --durations=10 -m "(slow or peer or browser) and not bench and not count"

counts: .venv/.installed
	$(BIN)/python -m pytest -q -n 2 --durations=10 -m count

bench: .venv-bench/.installed
	$(BENCH_BIN)/python -m pytest -q -s -p no:xdist --benchmark-disable-gc -m bench \
	  --history tests/bench/history.csv tests/bench

oldest: .venv/.installed
	$(BIN)/python tests/oldest.py

wheel: .venv/.installed
	$(BIN)/python tests/wheel.py

clean:
	rm -rf .venv .venv-bench build dist
