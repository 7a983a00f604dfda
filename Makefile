PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PINS   := pyproject.toml constraints.txt
READY  := $(VENV)/.ready
PACKAGES := translator bsdfs emitters integrators phasefunctions sensors
STATE   = { pwd; cat $(PINS); }

.PHONY: setup install demo test lint clean study-materials study-lights study-gallery study-subsurface study-stability \
        study-charts study-compare study-calibration study-mutations

# Nothing to do while the interpreter runs and the set-up was finished here with these very pins.
setup:
	@$(BIN)/python -c '' 2>/dev/null && $(STATE) | cmp -s - $(READY) \
	    || $(MAKE) --no-print-directory install

# A finished set-up is brought up to date; a half-made, moved or broken one is made anew.
install:
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; (3, 10) <= v <= (3, 13) or sys.exit( \
	    "relume needs Python 3.10 to 3.13, this is %d.%d: make PYTHON=python3.13" % v)'
	@echo "Setting up $(VENV)"
	@$(BIN)/python -c '' 2>/dev/null && test "$$(head -n 1 $(READY) 2>/dev/null)" = "$$(pwd)" \
	    || $(PYTHON) -m venv --clear $(VENV)
	@rm -f $(READY)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable '.[test]'
	@$(BIN)/python -c 'import relume'
	@$(STATE) > $(READY)

demo: setup
	$(BIN)/relume render scenes/cornell.txt -o out/cornell.png

test: lint
	$(BIN)/python -m pytest

# mypy names modules after folders: links put these where they are installed.
TYPES := build/types
lint: setup
	$(BIN)/ruff check .
	@rm -rf $(TYPES)/relume && mkdir -p $(TYPES)/relume
	@ln -s $(addprefix $(CURDIR)/,$(wildcard relume/*) $(PACKAGES)) $(TYPES)/relume
	cd $(TYPES) && $(CURDIR)/$(BIN)/mypy --config-file $(CURDIR)/pyproject.toml -p relume

study-materials: setup
	$(BIN)/python -m pytest -s -m study studies/bsdf_accuracy.py
	$(BIN)/python studies/bsdf_speed.py

study-lights: setup
	$(BIN)/python studies/lights.py

study-subsurface: setup
	$(BIN)/python studies/subsurface.py --figure docs/subsurface/profiles.png
	$(BIN)/python studies/subsurface_spheres.py

# make study-gallery CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures"
study-gallery: setup
	$(BIN)/python studies/gallery.py '$(CORPUS)' --asset-path '$(ASSETS)'

study-stability: setup
	$(BIN)/relume stability -o docs

# Both as study-gallery. Charts are timed: nothing else should run.
STUDY_CORPUS = $(BIN)/python studies/corpus.py

study-charts: setup
	$(STUDY_CORPUS) charts '$(CORPUS)' --asset-path '$(ASSETS)'

study-compare: setup
	$(STUDY_CORPUS) compare '$(CORPUS)' --asset-path '$(ASSETS)'

# Hours: each test by chance is rerun 200 times.
study-calibration: setup
	$(BIN)/python studies/false_alarms.py
	$(BIN)/python studies/false_alarms.py --compare

study-mutations: setup
	$(BIN)/python studies/error_injection.py

# make study-media CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures";
# without CORPUS the closed forms and the ends of the ranges
.PHONY: study-media
study-media: setup
	$(BIN)/python studies/media.py $(if $(CORPUS),'$(CORPUS)' --asset-path '$(ASSETS)')

# make study-references SCENE=glass.txt; without SCENE, of all scenes
.PHONY: study-references
study-references: setup
	$(BIN)/python studies/references.py $(SCENE)

# make study-convergence CELLS="glass ibl"; without CELLS, of all materials and lights
.PHONY: study-convergence
study-convergence: setup
	$(BIN)/python studies/convergence.py $(CELLS)

# make study-peer REFERENCES="folder of pictures" CORPUS="folder of scene files" ASSETS="..."
.PHONY: study-peer
study-peer: setup
	$(BIN)/python studies/peer.py '$(REFERENCES)' '$(CORPUS)' '$(ASSETS)' \
	    $(PICTURES)

# Half an hour; what it prints goes into docs/scaling.md. Nothing else should run.
.PHONY: study-scaling
STUDY_SCALING = $(BIN)/python studies/scaling.py
study-scaling: setup
	$(STUDY_SCALING) kills
	$(STUDY_SCALING) throughput
	$(STUDY_SCALING) units
	$(STUDY_SCALING) model 0.004 8.7e-8 0.42e6
	$(STUDY_SCALING) model 0.004 8.7e-8 6.6e6

# make study-metropolis CORPUS="folder of scene files"; without it the occluded room is left out
.PHONY: study-metropolis
study-metropolis: setup
	$(BIN)/python studies/metropolis.py '$(CORPUS)'
	$(BIN)/python studies/metropolis_agreement.py '$(CORPUS)'

# What it prints goes into docs/files.md; readers that are not installed are left out.
.PHONY: study-files
study-files: setup
	$(BIN)/python studies/files.py

# Minutes: 100000 damaged pictures, meshes and material files each.
.PHONY: study-damaged
study-damaged: setup
	RELUME_DAMAGED=100000 $(BIN)/python -m pytest tests/translator/test_damaged_files.py

clean:
	rm -rf $(VENV) out build *.egg-info
