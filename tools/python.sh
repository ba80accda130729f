# Builds and tests the package for Python. Sourced by ./run and ./test, never run by itself.

# Environment in which the package is built and tested, with the packages of python/requirements.txt.
python_env=target/python

# Prepares that environment. Fails if there is no Python that can create one.
prepare_python() {
    python3 -c 'import ensurepip, venv' 2> /dev/null || prepare_packages python3 python3-venv
    # For pyright.
    command -v node > /dev/null || prepare_packages nodejs
    cmp -s python/requirements.txt "$python_env/.from" && return
    say "installing the packages of the Python tests"
    python3 -m venv --clear "$python_env"
    "$python_env/bin/pip" install --quiet --disable-pip-version-check --no-compile --requirement python/requirements.txt
    cp python/requirements.txt "$python_env/.from"
}

# Public robot descriptions: files of packages, for the long tests.
prepare_robots() {
    local packages=(gymnasium==1.4.0 dm_control==1.0.50 example-robot-data==6.0.0)
    [[ $(cat target/robots/.from 2> /dev/null) != "${packages[*]}" ]] || return 0
    rm -rf target/robots
    "$python_env/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-compile --target target/robots "${packages[@]}"
    echo "${packages[*]}" > target/robots/.from
}

# Prepares an environment in folder $1 with what builds wheels.
prepare_maturin() {
    python3 -c 'import ensurepip, venv' 2> /dev/null || prepare_packages python3 python3-venv
    [[ ! -x $1/bin/maturin ]] || return 0
    [[ -x $1/bin/pip ]] || python3 -m venv "$1"
    "$1/bin/pip" install --quiet --disable-pip-version-check "$(grep '^maturin==' "$root/python/requirements.txt")"
}

# Builds the wheel with the environment in folder $1 into folder $2; further arguments go to maturin.
build_wheel() {
    "$1/bin/maturin" build --quiet --locked --manifest-path "$root/python/Cargo.toml" --out "${@:2}"
}

# Checks the types of the package, and of the examples of its document as a user's script.
python_types() {
    local examples=$python_env/examples.py
    sed -n '/^```python$/,/^```$/{/^```/!p;}' docs/python.md > "$examples"
    "$python_env/bin/mypy" --strict --no-error-summary --cache-dir "$python_env/.mypy" python/jointplay "$examples"
    # Without a search for a newer version.
    PYRIGHT_PYTHON_IGNORE_WARNINGS=1 "$python_env/bin/pyright" --project python --warnings --pythonpath "$python_env/bin/python" \
        python/jointplay "$examples"
}

# Builds the wheel, installs it as a user would, and tests it.
python_test() {
    local wheels=$python_env/wheels
    rm -rf "$wheels"
    build_wheel "$python_env" "$wheels" --profile dev --features alike
    "$python_env/bin/pip" install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheels"/*.whl
    python_types
    # -P: without the current folder in the path, the installed package is tested.
    "$python_env/bin/python" -P -B -m pytest --quiet -p no:cacheprovider python/tests "$@"
    # `./run lab` forwards to it.
    JOINTPLAY_LAB=$root/$python_env ./run lab sensitivity four-bar --over 'joint.*.clearance' --rows 8 --duration 5ms --quiet \
        --out "$record/lab" > /dev/null
    [[ -s $record/lab/sensitivity.png ]]
}

# Builds the package with graphics and tests its pictures. Built together with the examples, which share its libraries.
python_pictures_test() {
    local site=$python_env/pictures
    cargo build --quiet --locked --workspace "${features[@]}" --features jointplay-python/render --lib --examples
    rm -rf "$site"
    mkdir -p "$site"
    cp -r python/jointplay "$site"
    cp "${CARGO_TARGET_DIR:-target}/debug/libjointplay_python.so" "$site/jointplay/_native.abi3.so"
    PYTHONPATH=$site "$python_env/bin/python" -P -B -m pytest --quiet -p no:cacheprovider python/tests/test_render.py
}
