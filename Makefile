# make run        press the embedded forearm; ends with where the picture is
# make test       all tests that need nothing but this tree
# make test-data  tests on real and awkward meshes (SHARED=…), and our files opened by meshio and pyvista
# make lint       format, clippy; licences, spelling and unused dependencies where their tools are installed
# make docs       the API documentation, without a warning
# make loop       a minute of the 1 kHz loop in real time, and the same minute run again
# make bench      the thesis's table and the moving step, measured here

SHARED  ?= ../shared
TARGET  := $(or $(CARGO_TARGET_DIR),target)
RESULTS := $(TARGET)/tmp/results
VENV    := $(TARGET)/venv

.PHONY: run test test-data shared lint docs bench loop

run:
	cargo run --release --package palpa -- press

test:
	@if command -v cargo-nextest >/dev/null; then cargo nextest run --workspace; \
	else cargo test --workspace --lib --bins --tests; fi
	cargo test --workspace --doc

test-data: shared $(VENV)/ready
	rm -rf "$(RESULTS)"
	PALPA_SHARED="$$(cd "$(SHARED)" && pwd)" cargo test --release --package palpa --test data --test it
	cargo run --release --package palpa -- press --out "$(RESULTS)/press"
	"$(VENV)/bin/python" tools/check_vtu.py "$(RESULTS)"

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
	$(call with,cargo-deny,cargo deny check bans licenses sources)
	$(call with,cargo-machete,cargo machete)
	$(call with,typos,typos)

# Runs the second argument if the first is installed, and says so if it is not: building these tools takes minutes.
define with
@if command -v $(1) >/dev/null; then echo "$(2)"; $(2); else echo "lint: $(1) is not installed, left out"; fi
endef

docs:
	RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps

bench:
	cargo run --release --package palpa -- reproduce
	cargo run --release --package palpa -- bench

loop:
	cargo run --release --package palpa -- loop-report
	cargo run --release --package palpa -- replay out/loop-report/log.mcap
