# `./run lab …`: the Python package with all its libraries. Sourced by ./run, never run by itself.

# Environment with the package: one that is ready, or else its own.
lab_env=${JOINTPLAY_LAB:-$root/target/lab}

# Installs the package, again when its sources have changed, and calls `python -m jointplay` with the given arguments.
run_lab() {
    local sources=("$root"/{Cargo.lock,assets,crates,python/{Cargo.toml,jointplay,pyproject.toml,src}})
    if [[ -z ${JOINTPLAY_LAB:-} ]] && [[ ! -e $lab_env/.done || -n $(find "${sources[@]}" -type f -newer "$lab_env/.done" -print -quit) ]]; then
        say "installing the Python package into $lab_env (this takes some minutes the first time)"
        mkdir -p "$lab_env"
        # The time before the sources are read.
        : > "$lab_env/.begun"
        prepare_maturin "$lab_env"
        rm -rf "$lab_env/wheels"
        build_wheel "$lab_env" "$lab_env/wheels" --profile local
        "$lab_env/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps "$lab_env"/wheels/*.whl
        "$lab_env/bin/pip" install --quiet --disable-pip-version-check "$(echo "$lab_env"/wheels/*.whl)[lab]"
        mv "$lab_env/.begun" "$lab_env/.done"
    fi
    # -P: a file of the current folder must not take the place of a library.
    exec "$lab_env/bin/python" -P -m jointplay "$@"
}
