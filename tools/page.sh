# Builds and serves the page. Sourced by ./run and ./test, after prepare.sh and wasm.sh; $root is the project's folder.

page_tool() {
    "$root/target/tools/debug/jointplay-web" "$@"
}

# Writes the page into folder $1; further arguments go to the tool.
build_page() {
    prepare_wasm
    say "building the page (the first time takes some minutes)"
    cargo rustc --locked --manifest-path "$root/Cargo.toml" --profile web --target $wasm_target --lib --crate-type cdylib
    cargo build --locked --quiet --manifest-path "$root/tools/web/Cargo.toml" --target-dir "$root/target/tools"
    page_tool pack "$root/target/$wasm_target/web/jointplay.wasm" "$@"
}

# ./run web [--port PORT | --build FOLDER | --bench]
run_web() {
    local folder=$root/target/page
    case ${1:-} in
        "" | --port)
            build_page "$folder"
            say "the page, until Ctrl-C:"
            page_tool serve "$folder" "${2:-8420}"
            ;;
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
            build_page "$folder"
            cargo build --release --locked --manifest-path "$root/Cargo.toml"
            node "$root/web/bench.mjs" "$folder" "$root/target/release/jointplay"
            ;;
        *)
            say "./run web [--port PORT | --build FOLDER | --bench]"
            exit 2
            ;;
    esac
}
