# Every target sets up its own environment in .venv; nothing but Python (>= 3.11), git and make is needed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SCENARIO ?= scenarios/warehouse.yaml

.PHONY: run test test-long check bench soak fuzz mutate oracle scenarios wheel smoke docs clean

$(VENV)/.ready: pyproject.toml constraints.txt benchmarks/pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed, $(PYTHON) is " + sys.version.split()[0])'
	@echo "Installing into $(VENV); the first time this takes some minutes."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]' --editable benchmarks
	touch $@

run: $(VENV)/.ready  ## the environment, then the warehouse scenario to its verdict
	$(BIN)/twin run $(SCENARIO)

test: $(VENV)/.ready  ## the whole test suite, fast tests first
	$(BIN)/python -m pytest -n 2 --dist loadgroup -m "not bench and not long"

test-long: $(VENV)/.ready  ## what takes longest: installations, every live value, many runs
	$(BIN)/python -m pytest -n 2 --dist loadgroup -m "long" $$(grep -rl --include='*.py' 'pytest.mark.long' tests)

check: $(VENV)/.ready  ## format, lint, types, layers
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.ready  ## CPU time as ratios: a start to bare imports, a run to its own physics and rays alone, layer by layer, environments of gymnasium to theirs, a conversion to MuJoCo's compilation, messages to a put, a sweep to its runs in turn, eight futures to one, lidars to their bare rays; memory; how long a stop takes
	$(BIN)/python -m benchmarks.measures.start_cost
	$(BIN)/python -m benchmarks.measures.convert_cost
	$(BIN)/python -m benchmarks.measures.run_cost
	$(BIN)/python -m benchmarks.measures.env_cost
	$(BIN)/python -m benchmarks.measures.memory
	$(BIN)/python -m benchmarks.measures.cdr_cost
	$(BIN)/python -m benchmarks.measures.lockstep_cost
	$(BIN)/python -m benchmarks.measures.tracking
	$(BIN)/python -m benchmarks.measures.sweep_cost
	$(BIN)/python -m benchmarks.measures.futures_cost
	$(BIN)/python -m benchmarks.measures.lidar_cost
	$(BIN)/python -m benchmarks.measures.stop_latency

soak: $(VENV)/.ready  ## 60 km of random goals in the warehouse among people: collisions, recoveries, memory; a million steps of environments; an hour beside a robot that is killed and carried away; twenty clients of rosbridge
	$(BIN)/python -m benchmarks.measures.soak
	$(BIN)/python -m benchmarks.measures.env_memory
	$(BIN)/python -m benchmarks.measures.live_soak --minutes 60
	$(BIN)/python -m benchmarks.measures.live_accuracy --minutes 10
	$(BIN)/python -m benchmarks.measures.web_cost --seconds 600

fuzz: $(VENV)/.ready  ## 10 000 broken and hostile mesh files, checked and converted: none takes 5 s of CPU or 500 MB
	$(BIN)/python -m tests.oracles.mesh_fuzz

mutate: $(VENV)/.ready  ## 200 small wrong changes, each of which tests should notice: up to 90 minutes; ARGS='--again' for survivors
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,mutate]'
	$(BIN)/python -m tests.mutation.mutate $(ARGS)

oracle: $(VENV)/.ready  ## conversions against pinocchio, the table in docs/fidelity.md, the wire against two other implementations, messages against real rclpy, checks against rtamt, rosbridge against roslibpy and roslib
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,oracle]'
	$(BIN)/python -m pytest tests/convert/test_pinocchio.py tests/models/test_kinematics.py
	$(BIN)/python -m tests.oracles.example_robots
	$(PYTHON) -m venv build/wire_oracle
	build/wire_oracle/bin/python -m pip install --quiet --disable-pip-version-check zenoh-ros2-sdk==0.1.8 pamoja-ros2==0.2.0
	TWIN_WIRE_ORACLE=build/wire_oracle/bin/python $(BIN)/python -m pytest tests/bridge/wire/test_oracles.py
	$(PYTHON) -m venv build/rclpy_oracle
	build/rclpy_oracle/bin/python -m pip install --quiet --disable-pip-version-check --requirement tests/bridge/cdr/rclpy_requirements.txt
	TWIN_RCLPY_ORACLE=build/rclpy_oracle/bin/python $(BIN)/python -m pytest tests/bridge/cdr/test_rclpy.py
	$(PYTHON) -m venv build/stl_oracle
	build/stl_oracle/bin/python -m pip install --quiet --disable-pip-version-check rtamt==0.4.10
	TWIN_STL_ORACLE=build/stl_oracle/bin/python $(BIN)/python -m pytest tests/scenario/temporal/test_rtamt.py
	mkdir -p build/roslib_oracle/1 build/roslib_oracle/2
	$(BIN)/python -m pip download --quiet --disable-pip-version-check --no-deps --no-binary :all: --dest build/roslib_oracle roslibpy==2.1.0
	tar -xzf build/roslib_oracle/roslibpy-2.1.0.tar.gz -C build/roslib_oracle
	$(PYTHON) -m venv build/roslib_oracle/roslibpy-2.1.0/venv
	build/roslib_oracle/roslibpy-2.1.0/venv/bin/python -m pip install --quiet --disable-pip-version-check roslibpy==2.1.0 pytest pytest-asyncio
	npm install --silent --prefix build/roslib_oracle/1 roslib@1.4.1
	npm install --silent --prefix build/roslib_oracle/2 roslib@2.1.0
	TWIN_ROSLIBPY=$(CURDIR)/build/roslib_oracle/roslibpy-2.1.0 TWIN_ROSLIB1=$(CURDIR)/build/roslib_oracle/1 TWIN_ROSLIB2=$(CURDIR)/build/roslib_oracle/2 $(BIN)/python -m pytest tests/web/test_unchanged_clients.py

scenarios: $(VENV)/.ready  ## every scenario; the exit code is the verdict
	$(BIN)/twin test scenarios

wheel: $(VENV)/.ready  ## what others install: dist/twin-*.whl with robots, arenas, scenarios and examples
	rm -rf build/lib
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

smoke: constraints.txt  ## the wheel alone, in a fresh environment without the development tools
	rm -rf build/lib build/smoke && mkdir -p build/smoke
	$(PYTHON) -m venv build/smoke/venv
	build/smoke/venv/bin/python -m pip wheel --quiet --no-deps --wheel-dir build/smoke .
	build/smoke/venv/bin/python -m pip install --quiet --constraint constraints.txt build/smoke/*.whl
	cd build/smoke && venv/bin/twin run diff_bot_figure8 --out run && venv/bin/twin new rover && cd rover && ../venv/bin/twin test

docs: $(VENV)/.ready  ## the tables of the documentation, from schemas and code
	$(BIN)/python docs/reference.py

clean:
	rm -rf $(VENV) build runs .mypy_cache .ruff_cache .pytest_cache
