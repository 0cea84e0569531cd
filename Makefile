# Two commands for everyone: `make demo` and `make test`.  Each sets up what it needs in .venv by itself.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/pip --disable-pip-version-check --quiet

# small matrices on few cores: threads of the linear algebra only get in each other's way
export OPENBLAS_NUM_THREADS = 1

.PHONY: demo test lint reports docs blind blind-forces bench constraints clean

demo: $(VENV)/.installed
	$(BIN)/tdbmon demo

test: $(VENV)/.installed-dev lint
	$(BIN)/pytest -n 2 --dist loadfile

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/mypy

reports: $(VENV)/.installed
	rm -rf reports/archive   # its drops were filed as an earlier program had them
	$(BIN)/tdbmon demo --out reports

docs: $(VENV)/.installed-dev   # the pages that are made from runs
	$(BIN)/python -m tdbmon.effects_page
	$(BIN)/python -m tdbmon.machine_page
	$(BIN)/python -m tdbmon.validation
	$(BIN)/python -m benchmarks accuracy forces

N ?= 300
blind: $(VENV)/.installed-dev   # N blind cases through the command line; about a minute each, resumes where it stopped
	$(BIN)/python -m tests.blind --cases $(N) --seed 1 --jobs 1 --out blind-output --page docs/blind.md

SETS ?= 50
blind-forces: $(VENV)/.installed-dev   # forces and values fitted to SETS sets of four drops, against the truth; a minute or two each
	$(BIN)/python -m tests.fitted_forces --sets $(SETS) --seed 600 --out blind-output/forces --page docs/fitted_forces.md

bench: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "tdbmon needs Python 3.11 or later; name one with: make PYTHON=python3.12 ..."; exit 2; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP) install -c constraints.txt -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP) install -c constraints.txt -e '.[dev]'
	@touch $@ $(VENV)/.installed

constraints:   # pins what is installed now; names no index
	$(BIN)/pip freeze --exclude-editable | grep -v '^-' | grep -v ' @ ' > constraints.txt

clean:
	rm -rf $(VENV) demo-output .pytest_cache .mypy_cache .ruff_cache
