# Builds and serves the page. Sourced by ./run and ./test, after prepare.sh and wasm.sh; $root is the project's folder.

page_tool() {
    "$root/target/tools/debug/jointplay-web" "$@"
}

# Writes the page into folder $1; further arguments go to the tool.
build_page() {
    say "building the page (the first time takes some minutes)"
    # Panic messages name the sources of dependencies; their full paths would be private, and make the page larger.
    local sources=${CARGO_HOME:-$HOME/.cargo}/registry/src
    compile_page web "--remap-path-prefix=$sources="
    pack_page web "$@"
}

# Writes the page into folder $1, compiled with the profile of the tests: built faster, and larger.
build_quick_page() {
    compile_page dev
    pack_page debug "$1"
}

# Compiles the page's library with the profile $1; further arguments go to the compiler.
compile_page() {
    prepare_wasm
    local profile=$1
    # The text rasteriser uses vectors of four. Without SIMD they are emulated, which is slower and adds 48 kB to the download.
    # Browsers support SIMD since 2021, Safari since 2023.
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
                say "name the folder: ./run web --build dist/"
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
            cargo build --profile local --locked "${features[@]}" --manifest-path "$root/Cargo.toml"
            node "$root/web/bench.mjs" "$folder" "$root/target/local/jointplay"
            ;;
        *)
            say "./run web [--port PORT] [--host ADDRESS] | --build FOLDER | --bench"
            exit 2
            ;;
    esac
}
