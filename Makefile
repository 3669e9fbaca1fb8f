# make demo    a made part all the way to its report     make demo MESH=part.stl
# make test    tests that are not slow, one process for each core   make test MARK=  for all
# make train   train the denoiser                        make train ARGS=experiment=smoke
# make gallery docs/gallery.md with its pictures, from the parts that the program makes itself
# make bench   a page on a folder of CAD parts      make bench PARTS=parts SUBSET=24 BEFORE=outputs/bench/1a2b3c4
# make lint    format and lint, changing nothing
# make types   check the types
# make lock    requirements.lock from pyproject.toml   make lock ARGS=--upgrade for the newest versions
#
# The first of them makes .venv from the pinned requirements.

PYTHON ?= python3
MESH ?= example:rod
OUTPUT ?= outputs/demo
MARK ?= not slow
ARGS ?=
PARTS ?=
SUBSET ?=
BEFORE ?=

RUN := .venv/bin/python
PIP := $(RUN) -m pip install
READY := .venv/ready
TORCH := $(shell grep -o 'torch==[0-9.]*' pyproject.toml)
CODE := polycube plugins tests docs train.py infer.py

export MPLBACKEND := Agg
export OPENBLAS_NUM_THREADS := 1
export PYVISTA_OFF_SCREEN := true
export PYTHONDONTWRITEBYTECODE := # modules are compiled once, not in each of the many processes

.PHONY: demo test train gallery bench lint types lock

demo: $(READY)
	$(RUN) infer.py mesh=$(MESH) output_dir=$(OUTPUT) $(ARGS)
	@echo "The report is $(OUTPUT)/report.html"

test: $(READY)
	OMP_NUM_THREADS=1 $(RUN) -m pytest -m "$(MARK)" -n auto --dist loadfile --max-worker-restart=0 $(ARGS)

train: $(READY)
	$(RUN) train.py $(ARGS)

EXAMPLES := example:dice,example:ring,example:rod,example:lantern
EXAMPLES := $(EXAMPLES),example:eight,example:key,example:barrel,example:cup
gallery: $(READY)
	$(RUN) infer.py -m mesh=$(EXAMPLES) output_dir=outputs/gallery
	$(RUN) -m docs.generators.gallery docs outputs/gallery/*

# a folder per commit; what is not committed counts by its difference from the commit
CHANGES = $(shell git diff --quiet HEAD || git diff HEAD | git hash-object --stdin | cut -c 1-7)
BENCH = outputs/bench/$(shell git rev-parse --short HEAD)$(addprefix -dirty-,$(CHANGES))
bench: $(READY)
	@if [ -d "$(PARTS)" ]; then \
		$(RUN) -m docs.generators.benchmark $(BENCH) $(if $(BEFORE),"$(BEFORE)") --parts "$(PARTS)" \
			$(addprefix --subset ,$(SUBSET)) --settings $(ARGS); \
	else \
		echo "PARTS names no folder of CAD parts, so the benchmark is skipped"; \
	fi

lint: $(READY)
	$(RUN) -m ruff format --check $(CODE)
	$(RUN) -m ruff check $(CODE)

types: $(READY)
	$(RUN) -m mypy

# the versions that the present file has stay, unless ARGS asks for others
UV := .venv/uv/bin
lock:
	$(PYTHON) -m venv .venv/uv
	$(UV)/python -m pip install uv
	$(UV)/uv pip compile pyproject.toml --extra dev --extra cad --extra cluster --extra desk --extra mcp --no-emit-package torch \
		--universal --python-version 3.11 --generate-hashes --custom-compile-command 'make lock' $(ARGS) \
		--output-file requirements.lock --quiet

# pinned files by their hashes; torch apart from them, in the machine's own build (CPU or CUDA)
$(READY): requirements.lock pyproject.toml
	@bash .ci/system-libraries
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo "Python 3.10 or newer is needed: make PYTHON=python3.11 ..."; false; }
	$(PYTHON) -m venv .venv
	@if $(RUN) -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then \
		$(PIP) --require-hashes --no-deps -r requirements.lock; fi
	$(PIP) $(TORCH)
	$(PIP) -e '.[dev,cad,cluster,desk,mcp]'
	@touch $@
