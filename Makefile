# The two commands of the README; each does all of its own set-up.
VENV ?= .venv
PYTHON ?= python3
BIN := $(VENV)/bin
PYTEST = $(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

.PHONY: demo paper proof test test-long lint clean

demo: $(VENV)/.installed  ## analyse the sample flights into ./analysis
	$(BIN)/analyze sample_logs --out analysis

paper: $(VENV)/.installed  ## the paper's figures and statements, into ./analysis/paper
	$(BIN)/python -m benchmarks.paper analysis/paper

proof: $(VENV)/.installed-proof  ## trials with a concealed truth, of a seed that nobody knows, into ./proven
	$(BIN)/twin prove --out proven

test: $(VENV)/.installed-test  ## the tests, a process for each core
	$(PYTEST) -m "not long"

test-long: $(VENV)/.installed-test  ## those that take too long for every change
	$(PYTEST) -m long

lint: $(VENV)/.installed-test  ## style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/.installed-test: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	touch $@ $(VENV)/.installed

$(VENV)/.installed-proof: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable '.[proof]'
	touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) analysis proven
