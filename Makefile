# Every target sets up what it needs in .venv, from the exact versions in constraints.txt, and only when something changed.
# pip's own settings and PIP_* variables (index, proxy, certificates) are used as they are.

VENV ?= .venv
PY := $(VENV)/bin/python
ARGS ?=
# An editable install holds the folder's path, so a folder that was moved or copied needs a new one.
HERE := $(shell pwd -P | cksum | cut -d ' ' -f 1)
RUN := $(VENV)/.installed-$(HERE)
DEV := $(VENV)/.installed-dev-$(HERE)
# All that a test may ask for, so that none is skipped.
EXTRAS := dev,docs,dask,benchmark
PINS := pyproject.toml constraints.txt
PIP := $(PY) -m pip --disable-pip-version-check --no-input install --progress-bar off --constraint constraints.txt
# At most so many processes run tests side by side. More do not pay: each loads the numerical libraries anew.
WORKERS ?= 4
# A file of tests stays in one process, so that what its tests share is made once. Compiled first, even where Python may
# not write bytecode (PYTHONDONTWRITEBYTECODE): each of the hundred processes that tests start would compile it anew.
PYTEST = $(PY) -m compileall -q src optimizers && $(PY) -m pytest --numprocesses auto --maxprocesses $(WORKERS) --dist loadscope

# Tests hand about arrays and table cells whose exact types the stubs of NumPy and pandas cannot know.
TESTS_MAY := arg-type assignment call-arg call-overload comparison-overlap dict-item index misc no-any-return no-untyped-call operator \
	type-arg union-attr var-annotated

.PHONY: help demo test test-slow test-lowest coverage docs docs-links lint types imports experiments experiments-quick experiments-untested attack withheld withheld-real withheld-quick clean
.NOTPARALLEL:
.DELETE_ON_ERROR:

help:
	@echo "make demo               identifies and diagnoses trials that come with seatruth, in a minute (reports in seatruth-demo/)"
	@echo "make test               the fast tests; ARGS='-k driver -x' goes to pytest, ARGS=--cpu lists what takes long"
	@echo "make test-slow          the others: whole experiments, examples of the documents, interrupts and full disks"
	@echo "make test-lowest        the fast tests with the lowest versions that pyproject.toml promises, in an environment of their own"
	@echo "make coverage           all tests, with the lines of src that none of them runs (fails below 92 %)"
	@echo "make docs               the documentation site, with every example run (build/docs/index.html)"
	@echo "make docs-links         asks every link to the outside whether it still leads somewhere"
	@echo "make lint               style and format of the code (ruff)"
	@echo "make types              static types (mypy)"
	@echo "make imports            the direction of imports (import-linter)"
	@echo "make experiments        every experiment in full: says how long, goes on where it stopped (ARGS='--only xu2012')"
	@echo "make experiments-quick  every experiment in its small version (results in results/)"
	@echo "make experiments-untested  of these those that no slow test runs (part of the checks of every change)"
	@echo "make attack             fuzzers, hostile files and kills; says what gave way (ARGS='--quick', ARGS='--cases 1000')"
	@echo "make withheld           the blind benchmark on a test set of 300 cases, goes on where it stopped (results/withheld-test)"
	@echo "make withheld-real      the same on recorded runs of real ships (ARGS='--data FOLDER', default ../shared/data)"
	@echo "make withheld-quick     the same on one development case, in a minute or two"
	@echo "make clean              removes .venv, caches and results"

demo: $(RUN)
	@$(PY) -m seatruth demo $(ARGS)

test: $(DEV)
	$(PYTEST) -m "not slow" $(ARGS)

test-slow: $(DEV)
	$(PYTEST) -m slow $(ARGS)

# An environment of its own, made anew: nothing newer may be left in it.
test-lowest: $(DEV)
	$(PY) -m venv --clear build/lowest
	$(PY) tools/lowest_versions.py > build/lowest.txt
	build/lowest/bin/python -m pip --disable-pip-version-check install --quiet --constraint build/lowest.txt hatchling editables ".[dev,dask]"
	build/lowest/bin/python -m pytest --numprocesses auto --maxprocesses $(WORKERS) --dist loadscope -m "not slow" $(ARGS)

# What is left is named at the end, line by line.
coverage: $(DEV)
	$(PYTEST) --cov --cov-report=term-missing:skip-covered --cov-report=html:build/coverage $(ARGS)

# Every warning is an error, and so is every link inside the site that leads nowhere.
docs: $(DEV)
	$(PY) tools/documentation html
	@echo "The documentation is build/docs/index.html"

docs-links: $(DEV)
	$(PY) tools/documentation linkcheck -D nb_execution_mode=off

lint: $(DEV)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

types: $(DEV)
	$(PY) -m mypy
	$(PY) -m mypy experiments
	$(PY) -m mypy tools
	MYPYPATH=tools:tools/documentation $(PY) -m mypy $(addprefix --disable-error-code=,$(TESTS_MAY)) --exclude 'tests/(diagnosis|report)/conftest.py' tests

imports: $(DEV)
	$(VENV)/bin/lint-imports --no-logo

# Says how long it will take, goes on where it was stopped; an experiment that fails does not stop the others.
experiments: $(DEV)
	@$(PY) experiments/all.py $(ARGS)

experiments-quick: $(DEV)
	@$(PY) experiments/all.py --quick $(ARGS)

experiments-untested: $(DEV)
	@$(PY) experiments/all.py --quick --untested $(ARGS)

withheld: $(DEV)
	@$(PY) experiments/withheld all --set test $(ARGS)

withheld-real: $(DEV)
	@$(PY) experiments/withheld all --set real $(ARGS)

withheld-quick: $(DEV)
	@$(PY) experiments/withheld all --set dev --quick $(ARGS)

attack: $(DEV)
	@$(PY) experiments/attack $(ARGS)

$(RUN): $(PINS)
	$(call install,-e .)

$(DEV): $(PINS)
	$(call install,-e .[$(EXTRAS)])
	@touch $(RUN)

# The first Python that is new enough makes .venv, unless a usable one is there.
define install
	@set -e; \
	if ! $(PY) -m pip --version >/dev/null 2>&1; then \
		for python in $(PYTHON) python3.11 python3 python3.12 python3.13 python3.14 python; do \
			if "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then \
				found=$$python; break; \
			fi; \
		done; \
		if [ -z "$$found" ]; then \
			echo "seatruth needs Python 3.11 or newer, and none was found." \
				"Install it, or name it: make PYTHON=/path/to/python3.11" >&2; exit 1; \
		fi; \
		echo "Making $(VENV) with $$($$found --version)"; \
		"$$found" -m venv --clear $(VENV) || { \
			echo "$$found cannot make a virtual environment." \
				"On Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }; \
	fi
	@echo "Installing into $(VENV): this is done once, and again when $(PINS) change"
	@rm -f $(VENV)/.installed*
	@$(PIP) --quiet hatchling editables
	@$(PIP) --no-build-isolation $(1)
	@touch $@
endef

clean:
	rm -rf $(VENV) build dist results seatruth-demo .coverage* .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
