# The package for Python. Sourced by ./test, never run by itself.

# Environment in which the package is built and tested, with what python/requirements.txt names.
python_env=target/python

# Prints a sentence and fails if there is no Python that can make environments.
prepare_python() {
    python3 -c 'import ensurepip, venv' 2> /dev/null || prepare_packages python3 python3-venv
    cmp -s python/requirements.txt "$python_env/.from" && return
    say "installing what the tests of the package for Python use"
    python3 -m venv --clear "$python_env"
    "$python_env/bin/pip" install --quiet --disable-pip-version-check --no-compile --requirement python/requirements.txt
    cp python/requirements.txt "$python_env/.from"
}

# Builds the wheel, installs it as anyone would, and tests it.
python_test() {
    local wheels=$python_env/wheels
    rm -rf "$wheels"
    "$python_env/bin/maturin" build --quiet --locked --profile dev --features alike --manifest-path python/Cargo.toml --out "$wheels"
    "$python_env/bin/pip" install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheels"/*.whl
    # Without the folder of the tests in the path: what is tested is the installed package.
    "$python_env/bin/python" -P -B -m pytest --quiet -p no:cacheprovider python/tests "$@"
}

# The same with graphics, for the pictures alone. Built beside the examples, whose libraries it shares.
python_pictures_test() {
    local site=$python_env/pictures
    cargo build --quiet --locked --workspace "${sound[@]}" --features jointplay-python/render --lib --examples
    rm -rf "$site"
    mkdir -p "$site"
    cp -r python/jointplay "$site"
    cp "${CARGO_TARGET_DIR:-target}/debug/libjointplay_python.so" "$site/jointplay/_native.abi3.so"
    PYTHONPATH=$site "$python_env/bin/python" -P -B -m pytest --quiet -p no:cacheprovider python/tests/test_render.py
}
