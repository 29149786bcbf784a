# make demo: a first report in minutes.  make test: what has to hold, in minutes.  make slow: the rest of it, in a browser, with
# processes that are killed, with every navigator.  All set themselves up.
PYTHON ?= python3
BIN := .venv/bin
DEMO ?= results/demo

# Dozens of processes start in the tests: without bytecode on disk each would compile every module anew.
unexport PYTHONDONTWRITEBYTECODE
# What `make test` asks for goes on side by side: type checking, one process, fills what the tests leave while they wait.
MAKEFLAGS += --jobs=2

.PHONY: demo install test slow lint pytest clean

demo: .venv/installed
	@rm -rf $(DEMO)
	$(BIN)/clearway run hospital --robot tiago --robot hosbot --repetitions 1 --size 0.15 --size 0.60 --out $(DEMO)
	@echo "Open $(DEMO)/report/index.html; for all 672 trials: $(BIN)/clearway run hospital --out results/hospital"

install: .venv/installed

test: lint pytest

lint: .venv/developed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

pytest: .venv/developed
	$(BIN)/python -m pytest -n 2

# Three at a time: many of them wait, for a browser, a clock, a process that hangs.
slow: .venv/developed
	$(BIN)/python -m pytest -n 3 -m slow

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit("Clearway needs Python 3.11 or newer; try: make PYTHON=python3.12" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	@touch $@

.venv/developed: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $@ .venv/installed

clean:
	rm -rf .venv results
	find . -name __pycache__ -prune -exec rm -rf {} +
