# The two commands of the README; each does all of its own set-up.
VENV ?= .venv
PYTHON ?= python3
BIN := $(VENV)/bin

.PHONY: demo paper proof test lint clean

demo: $(VENV)/.installed  ## analyse the sample flights into ./analysis
	$(BIN)/analyze sample_logs --out analysis

paper: $(VENV)/.installed  ## the paper's figures and statements, into ./analysis/paper
	$(BIN)/python -m benchmarks.paper analysis/paper

proof: $(VENV)/.installed-proof  ## trials with a concealed truth, of a seed that nobody knows, into ./proven
	$(BIN)/twin prove --out proven

test: $(VENV)/.installed-test  ## the whole test suite, a process for each core
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile

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
