# Works from a fresh checkout on Debian: what is missing is installed first, as root or by sudo.

.PHONY: demo test durability contract bench service-cost service-load licences openapi templates pictures rust validator schemathesis vulkan

# The demo collection, registered by a server of its own: meshes, report and picture.
demo: rust vulkan
	cargo build --release --locked
	scripts/demo $${CARGO_TARGET_DIR:-target}/release/onemesh demo

# Every test there is.
test: rust validator schemathesis vulkan
	cargo test --workspace --locked

# The server killed twenty times in the middle of twelve scans; minutes.
durability: rust
	cargo test --release --locked --test durability -- --ignored

# How long each stage and kernel takes.
bench: rust vulkan
	cargo run --release --locked -- bench

# Twelve scans over HTTP against the command line's own registration of them; minutes.
service-cost: rust
	cargo build --release --locked
	scripts/service_cost $${CARGO_TARGET_DIR:-target}/release/onemesh

# How long answers take while 500 clients watch two registrations; what an upload of a million triangles takes; whether
# memory grows over 1000 registrations. Minutes, on a quiet machine.
service-load: rust
	cargo build --release --locked
	for what in "--clients 500" "--upload 1000000" "--soak 1000"; do \
		$${CARGO_TARGET_DIR:-target}/release/onemesh bench $$what || exit 1; done

# The head that comes with the program, from the sphere and from other heads than the demo's.
templates: rust
	cargo run --release --locked -- demo --seed 7 --count 12 --set from_head=false -o target/head
	cp target/head/result/template.frozen.glb templates/head68.glb

# The README's pictures of what else goes in, and of inversions.
pictures: rust
	cargo run --release --locked --example pictures
	cargo run --release --locked --example inversions

# The service against its own OpenAPI document, with many generated requests.
contract: rust schemathesis
	cargo build --locked
	SCHEMATHESIS=$(CURDIR)/target/schemathesis/bin/schemathesis tests/contract/run target/debug/onemesh 100

# The OpenAPI document, anew.
openapi: rust
	cargo run --locked -- openapi >openapi/onemesh.v1.json

# Whether every dependency's licence leaves users the choice of ours.
licences: rust
	@command -v python3 >/dev/null || $(call apt,python3)
	.ci/licences

export PATH := $(or $(CARGO_HOME),$(HOME)/.cargo)/bin:$(PATH)
SUDO := $(shell [ "$$(id -u)" = 0 ] || command -v sudo)
APT := $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get -qq
# $(call apt,PACKAGES) installs Debian packages.
apt = { $(APT) update && $(APT) install --no-install-recommends $(1); } </dev/null || { echo "please install: $(1)" >&2; false; }

rust:
	@command -v cc >/dev/null || $(call apt,gcc libc6-dev)
	@command -v cargo >/dev/null || { \
		{ command -v curl >/dev/null || $(call apt,ca-certificates curl); } && \
		curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal && \
		command -v cargo >/dev/null; }

# Khronos' glTF validator; where node cannot be had, the tests that need it say that they are skipped.
validator:
	@command -v npm >/dev/null || $(call apt,nodejs npm) || true
	@! command -v npm >/dev/null || $(MAKE) -s tests/gltf_validator/node_modules

tests/gltf_validator/node_modules: tests/gltf_validator/package-lock.json
	npm ci --no-audit --no-fund --prefix $(@D)
	@touch $@

# A Vulkan driver, in software where there is no other; without one the tests that draw with it say that they are skipped.
vulkan:
	@ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json 2>/dev/null | grep -q . || \
		[ "$$(uname)" != Linux ] || $(call apt,mesa-vulkan-drivers) || true

# The same of schemathesis, where python cannot be had.
schemathesis:
	@command -v python3 >/dev/null || $(call apt,python3 python3-venv) || true
	@! command -v python3 >/dev/null || $(MAKE) -s target/schemathesis/bin/schemathesis || true

target/schemathesis/bin/schemathesis: tests/contract/requirements.txt
	{ python3 -m venv target/schemathesis || { $(call apt,python3-venv) && python3 -m venv target/schemathesis; }; } && \
		target/schemathesis/bin/pip install -q --disable-pip-version-check -r $<
	@touch $@
