# The commands people and CI run.
#
#   make demo     set up, build, bake sample-data, draw preview pictures, say where they are
#   make test     set up, format check, clippy, docs, all tests
#   make check    format check, clippy and docs only
#   make bench    measure bakes; writes docs/BENCH.md and docs/LEVELS.txt
#   make report   evaluate the trees; writes docs/REPORT.md, the README's figures, out/report/*.html
#   make views    measure views; writes docs/VIEWS.md and docs/views.svg
#   make foliage  measure levels of foliage beside simplified meshes; writes docs/FOLIAGE.md, docs/foliage.png
#   make light    measure what each factor of the light on leaves buys; writes docs/LIGHT.md
#   make volume   measure volumes; writes docs/VOLUME.md, docs/volume.svg, docs/volume_heldout.png
#   make view     measure the viewer; writes docs/VIEWER.md and the README's pictures of it
#   make landscape  measure landscapes beside full meshes, LOD meshes and billboards; writes docs/LANDSCAPE.md
#                 and the README's table (needs 6 GiB)
#   make codebooks  codebook training beside faiss and scikit-learn, if $PYTHON has them; writes docs/CODEBOOKS.md
#   make three    draw exported views and foliage in three.js, in a headless browser, after the Khronos
#                 validator has passed the glb; writes docs/three.png, docs/levels.png
#   make picture  draw the README's picture anew
#   make golden   write the golden packs anew, after a meant change of the format
#   make samples  grow sample-data anew
#   make fuzz     fuzz all that reads files, for T seconds (default 60) or RUNS executions a target; adds to
#                 tests/fuzz/executions.tsv
#   make reliability  kills, damaged files, writers at once, the largest tree, and the record of fuzzing; writes
#                 docs/reliability.md (needs 12 GB of disk)
#   make deny     licences, sources and bans by cargo-deny, if it is installed

CARGO ?= cargo
OUT := out
T ?= 60

.PHONY: reliability snakemake foliage light gpu screen view landscape demo test check bench report views volume codebooks three picture golden samples fuzz deny setup

# Installs what variable `missing` of a recipe's shell names, or says what to install.
INSTALL = if [ -n "$$missing" ]; then \
  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
    echo "installing:$$missing"; apt-get update -qq && apt-get install -y -qq $$missing; \
  else echo "install these packages first: sudo apt-get install$$missing"; exit 1; fi; fi

# What the build needs from the system: a linker with C and C++ compilers, for zstd and meshoptimizer.
setup:
	@command -v $(CARGO) >/dev/null || { echo "cargo is missing: install Rust from https://rustup.rs"; exit 1; }
	@missing=; \
	command -v cc >/dev/null || missing="$$missing gcc"; \
	command -v c++ >/dev/null || missing="$$missing g++"; \
	echo '#include <stdlib.h>' | cc -E - >/dev/null 2>&1 || missing="$$missing libc6-dev"; \
	$(INSTALL)

# A Vulkan driver for forest-view: Mesa's software one, where there is no graphics card's.
gpu: setup
	@missing=; \
	ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json 2>/dev/null | grep -q . \
	  || missing="$$missing mesa-vulkan-drivers"; \
	PATH="$$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -q "libvulkan.so.1 " || missing="$$missing libvulkan1"; \
	$(INSTALL)

# A virtual screen, and what windows are made with: for the tests of forest-view's.
screen: setup
	@missing=; \
	command -v Xvfb >/dev/null || missing="$$missing xvfb"; \
	for pair in libX11.so.6:libx11-6 libX11-xcb.so.1:libx11-xcb1 libXcursor.so.1:libxcursor1 \
	    libXi.so.6:libxi6 libxkbcommon-x11.so.0:libxkbcommon-x11-0; do \
	  PATH="$$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -q "$${pair%:*} " || missing="$$missing $${pair#*:}"; done; \
	$(INSTALL)

demo: gpu
	$(CARGO) build --release --workspace --bins
	@mkdir -p $(OUT)
	@for tree in conifer.glb broadleaf_young.gltf shrub.obj; do \
	  name=$${tree%.*}; \
	  target/release/forest-bake points sample-data/$$tree -o $(OUT)/$$name.fpack --force && \
	  target/release/forest-bake verify $(OUT)/$$name.fpack && \
	  target/release/forest-bake draw $(OUT)/$$name.fpack -o $(OUT)/$$name.png \
	    --size 512 --finest 0.25,9,100,900 -q || exit 1; done
	@target/release/forest-bake points sample-data/conifer.glb \
	  "sample-data/broadleaf_young.gltf@4.5,0,1:yaw=70" "sample-data/shrub.obj@2,0,3:yaw=20,scale=1.3" \
	  "sample-data/shrub.obj@-2.4,0,2.2:yaw=200" -o $(OUT)/block.fpack --force
	@target/release/forest-bake draw $(OUT)/block.fpack -o $(OUT)/block.png --size 768 --view 15,8 -q
	@target/release/forest-bake views sample-data/conifer.glb -o $(OUT)/conifer.fpack \
	  --preview $(OUT)/conifer-views.png
	@target/release/forest-bake verify $(OUT)/conifer.fpack
	@target/release/forest-bake draw $(OUT)/conifer.fpack -o $(OUT)/conifer-lookup.png --as views \
	  --lookup nearest,blend,depth --view 25,12 -q
	@target/release/forest-bake export $(OUT)/conifer.fpack -o $(OUT)/conifer-three --for three --force -q
	@target/release/forest-bake volume sample-data/conifer.glb -o $(OUT)/conifer.fpack
	@target/release/forest-bake verify $(OUT)/conifer.fpack
	@target/release/forest-bake draw $(OUT)/conifer.fpack -o $(OUT)/conifer-volume.png --as volume \
	  --level 7,6,5,4 --view 25,12 -q
	@target/release/forest-bake foliage sample-data/conifer.glb -o $(OUT)/conifer.fpack
	@target/release/forest-bake verify $(OUT)/conifer.fpack
	@target/release/forest-bake draw $(OUT)/conifer.fpack -o $(OUT)/conifer-foliage.png --as foliage \
	  --level 0,1,2,3 --view 25,12 -q
	@rm -rf $(OUT)/wind $(OUT)/forest-wind
	@target/release/forest-view $(OUT)/conifer.fpack --headless --as foliage --view 25,12 --size 480x480 \
	  --sequence 2 --rate 10 -o $(OUT)/wind
	@for what in points views volume foliage; do \
	  target/release/forest-view $(OUT)/conifer.fpack --headless -o $(OUT)/view-$$what.png --as $$what \
	    --view 25,12 --size 720x720 || exit 1; done
	@for tree in broadleaf_young.gltf shrub.obj; do \
	  target/release/forest-bake foliage sample-data/$$tree -o $(OUT)/$${tree%.*}.fpack -q || exit 1; \
	  target/release/forest-bake views sample-data/$$tree -o $(OUT)/$${tree%.*}.fpack --texels 128 -q || exit 1; done
	@target/release/forest-bake scene $(OUT)/conifer.fpack:height=16,weight=2 $(OUT)/broadleaf_young.fpack:height=12,weight=2 \
	  $(OUT)/shrub.fpack:height=4 -o $(OUT)/forest.toml --trees 20000 --force
	@target/release/forest-view $(OUT)/forest.toml --headless -o $(OUT)/forest.png --samples 2
	@target/release/forest-view $(OUT)/forest.toml --headless --size 640x360 --sequence 2 --rate 10 -o $(OUT)/forest-wind
	@target/release/forest-bake levels sample-data/conifer.glb > $(OUT)/conifer-levels.txt
	@target/release/forest-bake inspect $(OUT)/block.fpack
	@echo; echo "Packs:    $(OUT)/*.fpack"; \
	echo "Pictures: $(OUT)/*.png (one tree at four levels of detail each; block.png: all of them together;"; \
	echo "          conifer-views.png: from 289 directions; conifer-lookup.png: nearest, blended, through depth;"; \
	echo "          conifer-volume.png: four levels of billboards; conifer-foliage.png: four of meshes;"; \
	echo "          view-*.png: the viewer's)"; \
	echo "          wind/preview.png, forest-wind/preview.png: animated, in the wind"; \
	echo "          forest.png: 20,000 of them on fractal land"; \
	echo "Window:   target/release/forest-view $(OUT)/conifer.fpack, or $(OUT)/forest.toml"; \
	echo "Export:   $(OUT)/conifer-three (for three.js)"; \
	echo "Report:   $(OUT)/conifer-levels.txt (what each radius rule and order keeps, by level)"

check: setup
	@rustup component add rustfmt clippy >/dev/null 2>&1 || true
	$(CARGO) fmt --all -- --check
	$(CARGO) clippy --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps --quiet

# The workflow engine that the shipped Snakefile is tested with; its test says that it is skipped without it.
snakemake: setup
	@[ -x target/snakemake/bin/snakemake ] || { \
	  missing=; python3 -c 'import ensurepip, venv' 2>/dev/null || missing="$$missing python3 python3-venv"; \
	  { $(INSTALL); } && python3 -m venv target/snakemake && \
	  target/snakemake/bin/pip install --quiet --disable-pip-version-check 'snakemake>=9,<10'; } || \
	  { rm -rf target/snakemake; echo "snakemake cannot be installed: its test is skipped"; }

test: check gpu screen snakemake
	$(CARGO) build --workspace --bins
	snakemake=$$PWD/target/snakemake/bin/snakemake; [ ! -x "$$snakemake" ] || export SNAKEMAKE=$$snakemake; \
	  $(CARGO) test --workspace

bench: setup
	$(CARGO) build --release --workspace --bins
	target/release/bench > docs/BENCH.md.new && mv docs/BENCH.md.new docs/BENCH.md
	target/release/forest-bake levels sample-data/conifer.glb > docs/LEVELS.txt
	@cat docs/BENCH.md

report: setup
	$(CARGO) build --release --workspace --bins
	target/release/report
	target/release/forest-bake eval --schema > docs/eval.schema.json

views: setup
	$(CARGO) build --release --workspace --bins
	target/release/views

foliage: setup
	$(CARGO) build --release -p forest-tests --bin foliage
	target/release/foliage

light: setup
	$(CARGO) build --release -p forest-tests --bin light
	target/release/light

volume: setup
	$(CARGO) build --release --workspace --bins
	target/release/volumes

view: gpu screen
	$(CARGO) build --release --workspace --bins
	target/release/viewer

landscape: gpu
	$(CARGO) build --release --workspace --bins
	target/release/landscape

codebooks: setup
	$(CARGO) build --release --workspace --bins
	target/release/codebooks > docs/CODEBOOKS.md.new && mv docs/CODEBOOKS.md.new docs/CODEBOOKS.md
	@cat docs/CODEBOOKS.md

# Tests at length: kills, damaged files, writers at once; and the largest tree.
FIGURES := $(CURDIR)/target/figures
reliability: setup
	$(CARGO) build --release --workspace --bins
	FOREST_FIGURES=$(FIGURES) FOREST_EFFORT=4 $(CARGO) test -p forest-tests --test all -- batch damaged
	FOREST_FIGURES=$(FIGURES) target/release/bench large
	target/release/reliability $(FIGURES) > docs/reliability.md.new && mv docs/reliability.md.new docs/reliability.md
	@cat docs/reliability.md

# Node.js, npm and Chromium, and three.js by npm: not needed by anything else.
three: setup
	@missing=; \
	command -v npm >/dev/null || missing="$$missing nodejs npm"; \
	command -v chromium >/dev/null || [ -n "$$CHROMIUM" ] || missing="$$missing chromium"; \
	$(INSTALL)
	$(CARGO) build --release --workspace --bins
	@mkdir -p $(OUT)
	cd tests/three && npm install --no-package-lock --no-audit --no-fund --silent
	target/release/forest-bake views sample-data/broadleaf_young.gltf -o $(OUT)/three.fpack \
	  --layout octahedral:12 --quality lossless --channels color,normal,depth --force
	target/release/forest-bake export $(OUT)/three.fpack -o $(OUT)/three --for three --name tree --force
	cd tests/three && node shot.mjs ../../$(OUT)/three ../../docs/three.png --size 240 --show lit \
	  --from '0,0,1;1,0.1,0.4;1,0.5,-0.6;-0.3,0.2,-1;-1,0.3,0.2;0.2,1,0.3;0,1,0;0.6,0.3,0.9'
	target/release/forest-bake foliage sample-data/broadleaf_young.gltf -o $(OUT)/three.fpack
	target/release/forest-bake export $(OUT)/three.fpack -o $(OUT)/three --format glb --name tree --force
	cd tests/three && node levels.mjs ../../$(OUT)/three/tree.glb ../../docs/levels.png --size 240

picture: setup
	$(CARGO) build --release --workspace --bins
	@mkdir -p $(OUT)
	target/release/forest-bake points sample-data/conifer.glb -o $(OUT)/conifer.fpack --force
	target/release/forest-bake draw $(OUT)/conifer.fpack -o docs/levels.png --size 380 --finest 0.25,9,100,900

golden: setup
	$(CARGO) run --release -p forest-tests --bin golden

samples: setup
	$(CARGO) build --release --workspace --bins
	target/release/forest-sample-data --species conifer --seed 1 --triangles 20000 -o sample-data/conifer.glb
	target/release/forest-sample-data --species broadleaf --seed 2 --triangles 42000 -o sample-data/broadleaf_young.gltf
	target/release/forest-sample-data --species shrub --seed 3 --triangles 4000 -o sample-data/shrub.obj

fuzz: setup
	@command -v cargo-fuzz >/dev/null || $(CARGO) install cargo-fuzz --locked
	T=$(T) RUNS=$(RUNS) bash tests/fuzz/run.sh

deny:
	@command -v cargo-deny >/dev/null || { echo "cargo install cargo-deny --locked"; exit 1; }
	cargo deny check bans licenses sources
