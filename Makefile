# make normal     the main job: predict normal walking, V = 1.2 m/s, L = 0.7 m -> out/normal/
# make preferred  predict walking at the step length people prefer -> out/preferred/
# make backpack   the same walk with 0, 20 and 40 lb on the back -> out/backpack-0/ ...
# make scenarios  predict every scenario of scenarios/ -> out/<scenario>/, some minutes
# make paper      all of it: make scenarios, make figures and the comparison with measured people
# make study      predict 24 walks at many speeds and steps, with a page about them
#                 -> out/speed-step/; make study FILE=scenarios/studies/people.toml for another
# make play       show out/normal/ in the browser; make play DIR=out/preferred for another result
# make figures    draw figures 7 to 12 of the paper -> out/figures/, and out/figures-paper/ by the
#                 formulation of the paper, from the results in out/ (make scenarios)
# make urdf       write urdf/human.urdf anew
# make bench      measure the speed, beside an older version -> out/bench/, under half an hour
#                 (make bench ROUNDS=1: some minutes)
# make test       run the tests, with coverage
# make check      lint, format, types, import rules and tests
# make docs       these pages and all of docs/ as a site -> build/docs/index.html; no server needed
# make pins       find the newest versions that work together -> .ci/constraints.txt
#                 (make pins PYTHONS="python3.11 python3.12 python3.13")
# make setup      only install what the commands need into .venv
#
# Each target installs what it needs into .venv by itself: what the commands need, 1.6 GB;
# what make study needs, 0.3 GB more; the tools of make test, make check and make bench, 0.8 GB
# more; those of make docs, 0.1 GB more.
#
# make PYTHON=/path/to/python3 ... chooses the Python to make .venv with.

BIN := .venv/bin
RUN := .venv/.run
STUDY := .venv/.study
TEST := .venv/.test
DOCS := .venv/.docs
CONSTRAINTS := .ci/constraints.txt
DIR ?= out/normal
FILE ?= scenarios/studies/speed-step.toml
BACKPACKS := backpack-0 backpack-20 backpack-40
SCENARIOS := $(basename $(notdir $(wildcard scenarios/*.toml)))
ROUNDS ?= 7
PYTHONS ?= python3.11 python3.12 python3.13

# Packages of other environments (ROS sets PYTHONPATH) must not mix with those of .venv.
unexport PYTHONPATH PYTHONHOME
# The optimiser and the tests use one process per core: more threads in each only get in the way.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export PYTHON

# What is installed: $(call install,package with its extras,size)
define install
@echo "setup: installing $(2) into .venv, the first time some minutes"
@PIP_CONSTRAINT=$(CONSTRAINTS) PIP_BUILD_CONSTRAINT=$(CONSTRAINTS) PIP_USER=0 \
    PIP_DISABLE_PIP_VERSION_CHECK=1 \
    $(BIN)/python -m pip install --quiet -c $(CONSTRAINTS) -e '$(1)' || { \
    echo "error: the packages could not be installed, see the message of pip above" >&2; \
    exit 2; }
@touch $@
endef

.PHONY: help setup backpack scenarios paper study play figures urdf bench test check docs pins $(SCENARIOS)

help:
	@sed -n '/^#/!q; s/^# \{0,1\}//p' Makefile

setup: $(RUN)

$(RUN): pyproject.toml $(CONSTRAINTS) human_gait/kernel/kernel.cpp .ci/build_kernel.py
	@sh .ci/find_python $(BIN)/python >/dev/null 2>&1 || { \
	    python=$$(sh .ci/find_python) && \
	    echo "setup: making .venv with $$python" && \
	    "$$python" -m venv --clear .venv; }
	$(call install,.,what the commands need (1.6 GB))
	@test -e human_gait/kernel/kernel.library || \
	    echo "setup: no kernel was built, for want of a C++ compiler: solving takes longer"

$(STUDY): $(RUN)
	$(call install,.[study],what studies need (0.3 GB more))

$(TEST): $(RUN)
	$(call install,.[test],the tools of the tests (0.8 GB more))

$(DOCS): $(RUN)
	$(call install,.[docs],the tools of the documentation (0.1 GB more))

$(SCENARIOS): setup
	@$(BIN)/human-gait predict scenarios/$@.toml --out out/$@

backpack: $(BACKPACKS)

scenarios: $(SCENARIOS)

paper: scenarios
	@$(BIN)/human-gait figures
	@$(BIN)/human-gait figures --paper
	@$(BIN)/human-gait compare out/preferred

study: $(STUDY)
	@$(BIN)/human-gait study $(FILE)

play: setup
	@$(BIN)/human-gait play $(DIR)

figures: setup
	@$(BIN)/human-gait figures out
	@$(BIN)/human-gait figures out --paper

urdf: setup
	@$(BIN)/human-gait urdf --out urdf/human.urdf

bench: $(TEST)
	@$(BIN)/python -m benchmarks.speed --rounds $(ROUNDS) --out out/bench

test: $(TEST)
	@$(BIN)/pytest -n auto --dist loadfile --no-loadscope-reorder --cov --cov-report term

check: $(TEST)
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(MAKE) --no-print-directory test

docs: $(DOCS)
	@$(BIN)/python docs/architecture.py >/dev/null
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "build/docs/index.html"

pins: setup
	@$(BIN)/python .ci/refresh_constraints.py $(PYTHONS)
