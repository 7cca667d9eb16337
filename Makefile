# make demo and make test set up everything they need from Python 3.11+ and pip alone.
PYTHON ?= python3
BIN := .venv/bin
BENCH_BIN := .venv-bench/bin
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: help setup demo test check slow bench wheel readme clean

help:
	@echo "make demo    run the main job from nothing to a report"
	@echo "make test    run the tests (a few minutes)"
	@echo "make check   lint and types"
	@echo "make slow    slow, peer and fault tests"
	@echo "make bench   ours beside the peers, one table per room"
	@echo "make wheel   build the wheel and try it in an empty environment"

.venv/.core: pyproject.toml constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e .
	@touch $@

.venv/.installed: .venv/.core
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e ".[dev,netcdf]"
	@touch $@

.venv/.peers: .venv/.installed
	$(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e ".[dev,netcdf,fmi,dask,peers]"
	@touch $@

.venv-bench/.installed: pyproject.toml constraints.txt
	@test -x $(BENCH_BIN)/python || $(PYTHON) -m venv .venv-bench
	$(BENCH_BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e ".[dev,netcdf,fmi,dask,peers,bench]"
	@touch $@

setup: .venv/.installed

demo: .venv/.core
	$(BIN)/holdfast demo

test: .venv/.installed
	$(BIN)/python -m pytest -q -n 2 -m "not slow and not peer and not bench and not browser"

check: .venv/.installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

slow: .venv/.peers
	$(BIN)/python -m pytest -q -n 2 -m "(slow or peer or browser) and not bench"

bench: .venv-bench/.installed
	$(BENCH_BIN)/python -m pytest -q -s -p no:xdist --benchmark-disable-gc -m bench tests/bench

wheel: .venv/.installed
	$(BIN)/python tests/wheel.py

clean:
	rm -rf .venv .venv-bench build dist
