# Spectral Geometry Notes: `make help` lists the targets.
# Every target makes its own environment when it needs one, and does nothing when nothing changed.

SHELL := /bin/sh
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

# The environment: the active one (virtualenv or a named conda environment), else .venv, made on first use.
CONDA_ACTIVE := $(if $(filter-out base,$(CONDA_DEFAULT_ENV)),$(CONDA_PREFIX))
ACTIVE := $(or $(VIRTUAL_ENV),$(CONDA_ACTIVE))
# Make splits names at spaces: an active environment with a space in its path is reached by a link without one.
LINKED = $(shell mkdir -p _build && ln -sfn "$(ACTIVE)" _build/environment && echo _build/environment)
ENV := $(if $(word 2,$(ACTIVE)),$(LINKED),$(or $(ACTIVE),.venv))
PY := $(ENV)/bin/python
READY := $(ENV)/.spectral-notes-ready
STAMPS := _build/stamps
JOBS ?= 2
EDITION ?= full
# What an edition is called: full, student, 2, student-de-1-3; all but the whole book have a folder of their own.
NAME := $(or $(shell echo $(filter student,$(EDITION)) $(IN) $(PARTS) | tr ' ' '-'),full)
BUILT := _build/$(if $(filter-out full,$(NAME)),$(NAME)/)
COURSE ?= course
FUZZ_SECONDS ?= 300
HTML := $(if $(filter-out full,$(NAME)),$(BUILT))_build/html
INSTALL = $(if $(shell command -v uv),uv pip install --quiet --python $(PY),$(PY) -m pip install --quiet)

# Printed digits must not depend on the number of cores: one BLAS thread a process.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export PYDEVD_DISABLE_FILE_VALIDATION := 1

LIBRARY := $(shell find spectral_notes -type f -not -path '*/__pycache__/*')
NOTEBOOKS := $(wildcard book/*.ipynb)
BOOK := $(shell find book -type f -not -path '*/.*' -not -path '*/_build/*') _config.yml _toc.yml
TOOLS := $(wildcard tools/*.py)
TESTS := $(shell find tests classroom/source -type f -name '*.py' -o -name '*.md' -o -name '*.ipynb') $(wildcard benchmarks/*.py classroom/*.py)

# The peers of the benchmarks (lapy, pyfmaps, cholespy) are left out where they are not installed.
.PHONY: help book pdf epub slides test lint browser course handouts mark translation notebooks serve lab bench fuzz matrix wheel pins clean distclean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

book: $(STAMPS)/book-$(NAME)  ## render the book into _build/html (EDITION=student: without solutions; PARTS="2": a part; IN=de: in German)
test: $(STAMPS)/test  ## unit tests, doctests, and every stored output against a fresh run
lint: $(STAMPS)/lint  ## ruff, mypy --strict, the import layers, the form of the notebooks
browser: $(STAMPS)/browser  ## open every page of the built book in Chromium: errors, requests, scenes, accessibility

pdf: book  ## print the book as one PDF beside its pages (EDITION=student: without solutions)
	$(PY) tools/print_book.py $(HTML) --into $(HTML)/_downloads --edition $(EDITION) --toc $(BUILT)source/_toc.yml

epub: book  ## make an EPUB of the book, checked by EPUBCheck where it is installed (EDITION=student: without solutions)
	$(PY) tools/epub_book.py $(HTML) --into $(HTML)/_downloads --edition $(EDITION)

slides: book  ## make a deck of slides for each chapter, and one for the two-hour tutorial
	$(PY) tools/slides.py $(HTML) --into $(HTML)/slides

course: $(READY)  ## make the students' folder and the teacher's (COURSE=course; SEED=7: another variant)
	$(PY) tools/course.py "$(COURSE)" $(if $(SEED),--seed $(SEED))

handouts: $(READY)  ## print the assignments of a course and their solutions, as PDF (after make course)
	$(PY) tools/handouts.py "$(COURSE)"

mark: $(READY)  ## mark ASSIGNMENT=1_fourier ARCHIVE=submissions.zip (STUDENTS=list.csv), into one table and feedback
	$(PY) tools/mark.py "$(ASSIGNMENT)" $(if $(ARCHIVE),"$(ARCHIVE)") --course "$(COURSE)" $(if $(STUDENTS),--students "$(STUDENTS)")

translation: $(READY)  ## catalogues of PAGES="setup_check" and of the checks for IN=de, to be filled in
	$(PY) tools/translation.py $(IN) $(PAGES)

notebooks: $(READY)  ## run the notebooks (or NB=book/NAME.ipynb) and store their text outputs
	$(PY) tools/notebooks.py run --jobs $(JOBS) $(NB)

serve: book  ## look at the book at http://localhost:8000
	$(PY) -m http.server --bind 127.0.0.1 --directory $(HTML) 8000

lab: $(READY)  ## open the notebooks in JupyterLab
	$(PY) -m jupyterlab book

bench: $(READY)  ## time the eigensolver beside its peers (BENCH=--quick: under a minute)
	$(PY) benchmarks/eigenbasis.py $(BENCH)

fuzz: $(READY)  ## fuzz the decoder and the mesh readers (Linux; FUZZ_SECONDS=300 each)
	@$(PY) -c 'import atheris' 2>/dev/null || $(INSTALL) -e '.[fuzz]'
	$(PY) tools/fuzz.py decode --seconds $(FUZZ_SECONDS)
	$(PY) tools/fuzz.py meshes --seconds $(FUZZ_SECONDS)

matrix: $(READY)  ## the oldest and newest NumPy and SciPy, one and two BLAS threads (MATRIX="--only oldest-2 book/NAME.ipynb")
	$(PY) tools/matrix.py $(MATRIX)

wheel: $(READY)  ## build the wheel, install it in an empty environment, and use it there
	@command -v uv >/dev/null || $(PY) -c 'import build' 2>/dev/null || $(INSTALL) build
	$(PY) tools/wheel.py

pins: $(READY)  ## compile requirements.txt anew from pyproject.toml
	$(PY) tools/pins.py

clean:  ## remove everything that was built
	rm -rf _build dist build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

distclean: clean  ## remove .venv as well
	rm -rf .venv *.egg-info

$(STAMPS)/book-%: $(READY) $(BOOK) $(LIBRARY) $(TOOLS)
	$(PY) tools/build_book.py --jobs $(JOBS) --edition $(if $(findstring student,$*),student,full) \
	    $(if $(filter full student,$*),,$(addprefix --language ,$(IN)) $(addprefix --parts ,$(PARTS)))
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/test: $(READY) $(BOOK) $(LIBRARY) $(TOOLS) $(TESTS)
	$(PY) -m pytest -n $(JOBS) --dist loadfile -p executed_once --nbval --nbval-current-env --nbval-cell-timeout=600 \
	    --nbval-sanitize-with tests/nbval_sanitize.cfg --ignore=tests/browser \
	    tests spectral_notes $(NOTEBOOKS)
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/browser: $(STAMPS)/book-full $(TESTS)
	SPECTRAL_NOTES_BROWSER=required $(PY) -m pytest -n $(JOBS) --dist worksteal -r R --reruns 1 tests/browser
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/lint: $(READY) $(NOTEBOOKS) $(LIBRARY) $(TOOLS) $(TESTS)
	$(PY) -m ruff check .
	$(PY) -m mypy spectral_notes
	$(ENV)/bin/lint-imports
	$(PY) tools/notebooks.py check
	@mkdir -p $(STAMPS) && touch $@

$(READY): requirements.txt pyproject.toml
	@sh tools/environment.sh $(ENV)
	@touch $@
