# Builds and serves the page. Sourced by ./run and ./test, after prepare.sh and wasm.sh; $root is the project's folder.

page_tool() {
    "$root/target/tools/debug/jointplay-web" "$@"
}

# Writes the page into folder $1; further arguments go to the tool.
build_page() {
    say "building the page (the first time takes some minutes)"
    # Messages name the sources of dependencies; where they lie on this machine is nobody's business and makes the page heavier.
    local sources=${CARGO_HOME:-$HOME/.cargo}/registry/src
    # What the optimiser would copy into its callers beyond this makes the page a twentieth heavier and nothing faster; what is
    # marked #[inline], as all arithmetic is, has a limit of its own.
    compile_page web "--remap-path-prefix=$sources=" -Cllvm-args=-inline-threshold=25
    pack_page web "$@"
}

# Writes a page that does the same, compiled as the tests are, and heavier, into folder $1.
build_quick_page() {
    compile_page dev
    pack_page debug "$1"
}

# Compiles it with the profile $1; further arguments go to the compiler.
compile_page() {
    prepare_wasm
    local profile=$1
    # Letters are drawn in vectors of four, which the page would otherwise imitate: slower, and 48 kB more to download. Browsers have
    # them since 2021, Safari since 2023.
    local flags=(-Ctarget-feature=+simd128 "${@:2}")
    CARGO_ENCODED_RUSTFLAGS=$(IFS=$'\x1f' && printf '%s' "${flags[*]}") \
        cargo rustc --locked --manifest-path "$root/Cargo.toml" --profile "$profile" --target $wasm_target --lib --crate-type cdylib
}

pack_page() {
    local profile=$1
    shift
    cargo build --locked --quiet --manifest-path "$root/tools/web/Cargo.toml" --target-dir "$root/target/tools"
    page_tool pack "$root/target/$wasm_target/$profile/jointplay.wasm" "$@"
}

# ./run web [--port PORT] [--host ADDRESS]
serve_page() {
    local folder=$root/target/page port=8420 host=127.0.0.1
    while (($#)); do
        case $1 in
            --port) port=${2:?--port needs a number} ;;
            --host) host=${2:?--host needs an address, such as 0.0.0.0} ;;
            *)
                say "./run web [--port PORT] [--host ADDRESS]"
                exit 2
                ;;
        esac
        shift 2
    done
    build_page "$folder"
    say "the page, until Ctrl-C:"
    page_tool serve "$folder" "$port" "$host"
}

# ./run web [--port PORT] [--host ADDRESS] | --build FOLDER | --bench
run_web() {
    local folder=$root/target/page
    case ${1:-} in
        "" | --port | --host) serve_page "$@" ;;
        --build)
            if (($# != 2)); then
                say "which folder? ./run web --build dist/"
                exit 2
            fi
            build_page "$2" --compress
            say "the page is in $2; any static host can serve it, from any path"
            ;;
        --bench)
            prepare_browser
            if [[ -n $lacking ]]; then
                say "$lacking"
                exit 1
            fi
            build_page "$folder"
            cargo build --release --locked "${sound[@]}" --manifest-path "$root/Cargo.toml"
            node "$root/web/bench.mjs" "$folder" "$root/target/release/jointplay"
            ;;
        *)
            say "./run web [--port PORT] [--host ADDRESS] | --build FOLDER | --bench"
            exit 2
            ;;
    esac
}
