# make run        the viewer: a forearm to be touched, in a browser
# make test       all tests that need nothing but this tree and a browser (it installs one)
# make dist       one binary with the page inside, packed for others
# make test-slow  tests of minutes, optimised: forces while moving, faults, verification by formula
# make test-data  tests on real and awkward meshes (SHARED=…); meshio and pyvista open our files
# make hunt       property tests with fresh seeds and fuzz targets, for HUNT_MINUTES=20
# make lint       format, clippy, the fuzz targets compile; licences, spelling and unused dependencies where their tools are installed
# make docs       the API documentation without a warning, the book of docs/, and all links checked
# make cross      cargo check for Windows and for Linux on ARM
# make loop       a minute of the 1 kHz loop in real time, and the same minute run again
# make bench      the thesis's table and the moving step, measured here
# make bench-page what the page costs and how soon it feels, in a browser on an idle machine (PAGE_OPTIONS=…)

SHARED  ?= ../shared
TARGET  := $(or $(CARGO_TARGET_DIR),target)
RESULTS := $(TARGET)/tmp/results
VENV    := $(TARGET)/venv
HUNT_MINUTES ?= 20
SHOTS   ?= $(TARGET)/tmp/screenshots
PAGE    := web/dist/index.html
BOOK    := $(TARGET)/book
# Where mdBook is installed if it is not on the path; a folder that outlives the tree saves
# building it again.
BOOK_TOOLS ?= $(abspath $(TARGET))/tools
MDBOOK  := $(or $(shell command -v mdbook 2>/dev/null),$(BOOK_TOOLS)/bin/mdbook)
VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)

.PHONY: run test hunt test-page test-slow test-data shared lint docs cross bench bench-page loop dist

run: $(PAGE)
	cargo run --release --package palpa-cli -- view

# The page is put into the binary, so it is built first.
$(PAGE): web/package-lock.json web/index.html web/tsconfig.json web/vite.config.ts $(shell find web/src web/public -type f)
	@command -v npm >/dev/null || { echo "make: the page needs Node.js 20.19 or newer with npm: https://nodejs.org" >&2; exit 1; }
	cd web && npm ci --no-audit --no-fund && npm run build

test: $(PAGE) test-page
	@if command -v cargo-nextest >/dev/null; then cargo nextest run --workspace; else \
	cargo test --workspace --exclude palpa-rt --exclude palpa-cli --lib --bins --tests && \
	cargo test --package palpa-rt --package palpa-cli --lib --bins --tests -- --test-threads=1; fi
	cargo test --workspace --doc

# The binary with its page in a real browser.
test-page: $(PAGE)
	cd web && npm run generate --silent && git diff --exit-code -- src/generated
	cargo build --release --package palpa-cli
	node web/e2e/browser.mjs --install
	cd web && PALPA_BIN="$(abspath $(TARGET))/release/palpa" PALPA_SHOTS="$(abspath $(SHOTS))" npm test

# Finds are kept in out/hunt, with the command that shows them again.
hunt:
	tools/hunt.sh "$(HUNT_MINUTES)" out/hunt

dist: $(PAGE)
	cargo build --release --package palpa-cli
	tools/dist.sh "$(TARGET)" "$(VERSION)"

test-slow:
	@if command -v cargo-nextest >/dev/null; then cargo nextest run --release --package palpa-cli --features slow-tests --test slow; \
	else cargo test --release --package palpa-cli --features slow-tests --test slow; fi

test-data: shared $(VENV)/ready $(PAGE)
	rm -rf "$(RESULTS)"
	@command -v ccx >/dev/null || echo "test-data: CalculiX (ccx) is not installed, its tests are left out"
	PALPA_SHARED="$$(cd "$(SHARED)" && pwd)" cargo test --release --package palpa-cli --features data-tests --test data \
	  -- $$(command -v ccx >/dev/null || echo "--skip ccx::")
	cargo test --workspace --test it -- vtu::
	cargo run --release --package palpa-cli --features data-tests -- press --out "$(RESULTS)/press"
	"$(VENV)/bin/python" tools/check_vtu.py "$(RESULTS)"
	node web/e2e/browser.mjs --install
	cd web && PALPA_SHARED="$$(cd .. && cd "$(SHARED)" && pwd)" PALPA_BIN="$(abspath $(TARGET))/release/palpa" \
	  PALPA_SHOTS="$(abspath $(SHOTS))" node --test --test-reporter=spec e2e/data.test.mjs

shared:
	@test -d "$(SHARED)" || { echo "make test-data: no folder \"$(SHARED)\"; say where the data is: make test-data SHARED=…" >&2; exit 1; }

$(VENV)/ready: tools/requirements.txt
	python3 -m venv "$(VENV)"
	@for wait in 0 10 60; do sleep $$wait; \
	  "$(VENV)/bin/python" -m pip install --quiet --disable-pip-version-check --requirement $< && exit 0; \
	done; echo "make test-data: pip could not install the packages of $<" >&2; exit 1
	touch $@

lint:
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --all-features -- --deny warnings
	cargo check --manifest-path fuzz/Cargo.toml --target-dir "$(TARGET)"
	$(call with,cargo-deny,cargo deny check bans licenses sources)
	$(call with,cargo-machete,cargo machete)
	$(call with,typos,typos)

# Runs the second argument if the first is installed, and says so if it is not: building these
# tools takes minutes.
define with
@if command -v $(1) >/dev/null; then echo "$(2)"; $(2); else echo "lint: $(1) is not installed, left out"; fi
endef

docs: $(MDBOOK) tools/book/node_modules/.package-lock.json
	RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps
	"$(MDBOOK)" build --dest-dir "$(abspath $(BOOK))"
	node tools/book/links.mjs "$(BOOK)"

# Three minutes of CPU time.
$(BOOK_TOOLS)/bin/mdbook:
	cargo install mdbook --version 0.5.4 --locked --no-default-features --root "$(BOOK_TOOLS)"

tools/book/node_modules/.package-lock.json: tools/book/package-lock.json
	cd tools/book && npm ci --no-audit --no-fund
	touch $@

cross:
	tools/cross.sh

bench:
	cargo run --release --package palpa-cli -- reproduce
	cargo run --release --package palpa-cli -- bench

bench-page: $(PAGE)
	cargo build --release --package palpa-cli
	node web/e2e/browser.mjs --install
	cd web && PALPA_BIN="$(abspath $(TARGET))/release/palpa" npm run bench-page -- $(PAGE_OPTIONS)

loop:
	cargo run --release --package palpa-cli -- loop-report
	cargo run --release --package palpa-cli -- replay out/loop-report/log.mcap
