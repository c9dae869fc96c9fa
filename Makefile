# Short names for the scripts; each can be run by itself where there is no make.

.PHONY: help demo test test-slow wheel cave-trial goldens gallery references lint bench bench-robots bench-scenes work-precision clean

help:
	@echo "make demo       install what is missing, run the billiards scene, leave a recording and a picture in out/, run an example in Python"
	@echo "make test       install what is missing, run all tests, check the documentation"
	@echo "make test-slow  the same, and determinism and energy over a minute"
	@echo "make wheel      a wheel to hand on, in target/wheels/manylinux: tagged with the oldest glibc that it runs on, and checked"
	@echo "make cave-trial a cave of five processes: frames, kills, freezes, a recording shown again and cut; minutes (scripts/cave_trial.py --long: all of it)"
	@echo "make goldens    draws the kept pictures of crates/render/tests/goldens anew; look at them before committing"
	@echo "make gallery    draws the moving pictures of docs/gallery.md anew; minutes (scripts/gallery.py SCENE: one of them)"
	@echo "make references installs Pinocchio, MuJoCo, real robots and Ray into target/python; tests that compare with them or use them then run"
	@echo "make lint       format, clippy, rustdoc, ruff and mypy; warnings are errors"
	@echo "make bench      step times beside Rapier, and articulated bodies; five minutes (benches/peers, a workspace of its own: it has more)"
	@echo "make bench-robots robots beside MuJoCo, one world and batches, in Python; minutes"
	@echo "make bench-scenes times of all shipped scenes with both steppers; minutes"
	@echo "make work-precision error over CPU time on six problems with known answers, beside MuJoCo and Rapier; minutes, more the first time"
	@echo "make clean      remove everything built"

demo:
	@scripts/demo.sh

test:
	@scripts/test.sh

test-slow:
	@scripts/test.sh --slow

wheel:
	@scripts/wheel.sh

cave-trial:
	@scripts/setup.sh
	cargo build --release --locked -p tumble
	scripts/cave_trial.py

goldens:
	TUMBLE_KEEP_PICTURES=1 cargo test --release --locked -p tumble-render --test it goldens

gallery:
	@scripts/setup.sh
	cargo build --release --locked -p tumble
	[ -x target/gallery/bin/python ] || python3 -m venv target/gallery
	target/gallery/bin/pip install --quiet pillow
	target/gallery/bin/python scripts/gallery.py

references:
	python3 -m venv target/python
	target/python/bin/pip install --quiet pin example-robot-data mujoco imageio numpy scipy trimesh rtree ray

lint:
	@scripts/lint.sh

bench:
	@scripts/setup.sh
	cargo bench --locked --manifest-path benches/peers/Cargo.toml --bench piles --bench articulated

work-precision:
	@[ -x target/python/bin/python ] || $(MAKE) references
	@scripts/test_python.sh crates/py/tests/test_package.py
	cd benches/peers && cargo bench --quiet --locked --bench precision > ../../target/precision.txt
	target/py-tests/bin/python benches/python/work_precision.py docs/images/work_precision.svg target/precision.txt

bench-scenes:
	@scripts/setup.sh
	cargo build --release --locked -p tumble
	scripts/bench_scenes.py

bench-robots:
	@[ -x target/python/bin/python ] || $(MAKE) references
	@scripts/test_python.sh crates/py/tests/test_package.py
	target/py-tests/bin/python benches/python/robots.py

clean:
	cargo clean
	rm -rf out benches/peers/target
