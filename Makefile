# Everything else is in the README; `make` alone lists the targets.
PYTHON ?= .venv/bin/python

help:            ## this list
	@grep -E '^[a-z-]+: ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 24

setup:           ## environment with the tested versions
	python3 -m venv .venv && .venv/bin/pip install -c constraints.txt -e ".[test]"

test:            ## the tests
	$(PYTHON) -m pytest

test-long:       ## the tests that take minutes
	$(PYTHON) -m pytest -m long

test-random:     ## the tests with other examples of their properties at every run
	$(PYTHON) -m pytest --hypothesis-profile random

lint:            ## style, format and types
	$(PYTHON) -m ruff check . && $(PYTHON) -m ruff format --check . && $(PYTHON) -m mypy

format:          ## mend the format
	$(PYTHON) -m ruff format . && $(PYTHON) -m ruff check --fix .

contract:        ## the contract suite against the built wheel, outside the checkout
	tests/wheel_contract.sh

docs:            ## the site, readable offline, in docs/_build/html (warnings are errors)
	$(PYTHON) -m pip install --quiet -c constraints.txt -e ".[docs]" && $(PYTHON) -m sphinx -E -a -W --keep-going -q docs docs/_build/html

quick:           ## the default study
	.venv/bin/dikbench run

benchmark:       ## how fast the harness is, against its peers (let nothing else run)
	$(PYTHON) -m pip install --quiet -e ".[peers,drake]" && $(PYTHON) tests/benchmarks/ratios.py \
	  && $(PYTHON) tests/benchmarks/peer_ratios.py && $(PYTHON) tests/benchmarks/lockstep.py

benchmark-scenarios:  ## how long each scenario takes to build
	$(PYTHON) tests/benchmarks/scenario_building.py

benchmark-solvers:  ## what each solver answers, and how fast (minutes)
	$(PYTHON) tests/benchmarks/default_solver.py

# Narrower: make mutation MUTANTS="formulations.sns*"; then `python -m mutmut results`, `... browse`.
mutation:        ## which changes to the laws and limits no test notices (hours; see pyproject.toml)
	$(PYTHON) -m pip install --quiet mutmut && $(PYTHON) -m mutmut run $(MUTANTS)

benchmark-laws:  ## what the laws without a solver cost, as ratios to dls
	$(PYTHON) tests/benchmarks/laws.py

benchmark-metrics:  ## what metrics and rechecks cost per step, alone and together
	$(PYTHON) tests/benchmarks/measuring.py

benchmark-peers: ## whole ticks and velocities of other libraries beside ours (minutes)
	$(PYTHON) -m pip install --quiet -e ".[peers,drake]" && $(PYTHON) -m dikbench run peers

constraints:     ## the installed versions become the tested ones (of peers too: `make benchmark-peers` first)
	.venv/bin/pip freeze --exclude-editable --exclude pip --exclude setuptools > constraints.txt

.PHONY: help setup test test-long test-random lint format contract docs quick benchmark benchmark-scenarios benchmark-solvers benchmark-laws benchmark-metrics benchmark-peers mutation constraints
