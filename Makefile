PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PINS   := pyproject.toml constraints.txt
READY  := $(VENV)/.ready
PACKAGES := translator bsdfs emitters integrators phasefunctions samplers scenes sensors textures
QUIET   = $$(test -t 1 || echo --quiet)
STATE   = { pwd; cat $(PINS); }

.PHONY: setup install demo test lint clean study-materials study-lights study-subsurface \
        study-gallery study-stability study-charts study-compare study-calibration study-mutations \
        study-media study-references study-convergence study-peer study-peer-corpus \
        study-scaling study-metropolis study-gravity study-curved-space study-merging study-samplers \
        study-subsurface-corpus study-roulette study-efficiency

# Nothing to do while the interpreter runs and the set-up was finished here with these very pins.
setup:
	@$(BIN)/python -c '' 2>/dev/null && $(STATE) | cmp -s - $(READY) \
	    || $(MAKE) --no-print-directory install

# A finished set-up is brought up to date; a half-made, moved or broken one is made anew.
install:
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; (3, 10) <= v <= (3, 13) or sys.exit( \
	    "relume needs Python 3.10 to 3.13, this is %d.%d: make PYTHON=python3.13" % v)'
	@echo "Setting up $(VENV) for relume, once; this takes some minutes."
	@echo "1 of 3: a virtual environment"
	@$(BIN)/python -c '' 2>/dev/null && test "$$(head -n 1 $(READY) 2>/dev/null)" = "$$(pwd)" \
	    || $(PYTHON) -m venv --clear $(VENV)
	@rm -f $(READY)
	@echo "2 of 3: the packages of constraints.txt, 0.9 GB on the disk with Mitsuba and LLVM"
	@$(BIN)/python -m pip install $(QUIET) --disable-pip-version-check \
	    --constraint constraints.txt --editable '.[test]'
	@echo "3 of 3: a first start, which looks for a working LLVM library"
	@$(BIN)/python -c 'import relume'
	@$(STATE) > $(READY)

demo: setup
	@echo "Rendering an example, 25 seconds of processor time:"
	$(BIN)/relume render scenes/cornell.txt -o out/cornell.png --spp 64 --denoise

# Processes share what cores there are; each keeps to files, whose fixtures are its own.
test: lint
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist loadfile

# The site, without a network; tests/docs builds it, too.
.PHONY: docs
docs: setup
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs
	@echo "build/docs/index.html"

# mypy names modules after folders: links put these where they are installed.
TYPES := build/types
lint: setup
	$(BIN)/ruff check .
	$(BIN)/vulture
	@rm -rf $(TYPES)/relume && mkdir -p $(TYPES)/relume
	@ln -s $(addprefix $(CURDIR)/,$(wildcard relume/*) $(PACKAGES)) $(TYPES)/relume
	cd $(TYPES) && $(CURDIR)/$(BIN)/mypy --config-file $(CURDIR)/pyproject.toml -p relume

STUDY = $(BIN)/python -m studies

study-materials: setup
	$(STUDY) bsdf-accuracy
	$(STUDY) bsdf-speed

study-lights: setup
	$(STUDY) lights

study-subsurface: setup
	$(STUDY) subsurface --figure docs/subsurface/profiles.png
	$(STUDY) subsurface-spheres
	$(STUDY) subsurface-map

study-subsurface-corpus: setup
	$(STUDY) subsurface-corpus '$(CORPUS)' --asset-path '$(ASSETS)'

study-curved-space: setup
	$(STUDY) curved-space --figure docs/curved-space/closed-forms.png \
	    --picture docs/curved-space/disk.png

# make study-gallery CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures"
study-gallery: setup
	$(STUDY) gallery '$(CORPUS)' --asset-path '$(ASSETS)'

# make study-gravity CORPUS="folder of scene files" REFERENCES="folder of scenes and pictures"
study-gravity: setup
	$(STUDY) gravity '$(REFERENCES)' '$(CORPUS)'

study-stability: setup
	$(BIN)/relume stability -o docs

# Both as study-gallery. Charts are timed: nothing else should run.
study-charts: setup
	$(STUDY) corpus charts '$(CORPUS)' --asset-path '$(ASSETS)'

study-compare: setup
	$(STUDY) corpus compare '$(CORPUS)' --asset-path '$(ASSETS)'

# Hours: each test by chance is rerun 200 times.
study-calibration: setup
	$(STUDY) false-alarms
	$(STUDY) false-alarms --compare

study-mutations: setup
	$(STUDY) error-injection

# make study-media CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures";
# without CORPUS the closed forms and the ends of the ranges
study-media: setup
	$(STUDY) media $(if $(CORPUS),'$(CORPUS)' --asset-path '$(ASSETS)')

# make study-references SCENE=glass.txt; without SCENE, of all scenes
study-references: setup
	$(STUDY) references $(SCENE)

# make study-convergence CELLS="glass ibl"; without CELLS, of all materials and lights
study-convergence: setup
	$(STUDY) convergence $(CELLS)

# make study-peer REFERENCES="folder of scenes, pictures and table.tsv" SCENES="names; all if none"
study-peer: setup
	$(STUDY) peer '$(REFERENCES)' $(if $(SCENES),--scenes $(SCENES))

# make study-peer-corpus REFERENCES="folder of pictures" CORPUS="folder of scene files" ASSETS="..."
study-peer-corpus: setup
	$(STUDY) peer-corpus '$(REFERENCES)' '$(CORPUS)' '$(ASSETS)' $(PICTURES)

# Half an hour; what it prints goes into docs/scaling.md. Nothing else should run.
study-scaling: setup
	$(STUDY) scaling kills
	$(STUDY) scaling throughput
	$(STUDY) scaling units
	$(STUDY) scaling model 0.004 8.7e-8 0.42e6
	$(STUDY) scaling model 0.004 8.7e-8 6.6e6

# make study-metropolis CORPUS="folder of scene files"; without it the occluded room is left out
study-metropolis: setup
	$(STUDY) metropolis $(if $(CORPUS),'$(CORPUS)')
	$(STUDY) metropolis-agreement $(if $(CORPUS),'$(CORPUS)')

# make study-efficiency CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures";
# 25 minutes; without CORPUS two rooms alone. Timed: nothing else should run.
study-efficiency: setup
	$(STUDY) efficiency $(if $(CORPUS),'$(CORPUS)' --asset-path '$(ASSETS)')

# As study-metropolis; the figures of the page are rough where something else runs.
study-merging: setup
	$(STUDY) merging $(if $(CORPUS),'$(CORPUS)')

# make study-samplers CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures";
# what it prints goes into docs/samplers.md, the matrices into samplers/nets.py
study-samplers: setup
	$(STUDY) nets
	$(STUDY) samplers $(if $(CORPUS),'$(CORPUS)' --asset-path '$(ASSETS)')

# make study-roulette CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures";
# what it prints goes into docs/roulette.md
study-roulette: setup
	$(STUDY) roulette $(if $(CORPUS),'$(CORPUS)' --asset-path '$(ASSETS)')

# What it prints goes into docs/files.md; readers that are not installed are left out.
.PHONY: study-files
study-files: setup
	$(STUDY) files

# make study-converted CORPUS="folder of scene files" ASSETS="folder of their meshes and pictures"
.PHONY: study-converted
study-converted: setup
	$(STUDY) converted '$(CORPUS)' --asset-path '$(ASSETS)'

# Minutes: 100000 damaged pictures, meshes and material files each.
.PHONY: study-damaged
study-damaged: setup
	RELUME_DAMAGED=100000 $(BIN)/python -m pytest tests/translator/test_damaged_files.py

# What it prints goes into docs/denoising.md. CORPUS, ASSETS as study-gallery.
.PHONY: study-denoising
study-denoising: setup
	$(STUDY) denoising '$(CORPUS)' --asset-path '$(ASSETS)'

clean:
	rm -rf $(VENV) out build *.egg-info
