# Prepares Rust for wasm32-unknown-unknown. Sourced by ./run and ./test, after prepare.sh.

wasm_target=wasm32-unknown-unknown

# Whether Rust compiles and links a library that uses the standard library.
wasm_works() {
    local scratch works=1
    scratch=$(mktemp -d)
    printf '%s\n' '#[unsafe(no_mangle)] pub extern "C" fn f(x: u32) -> u32 { format!("{x}").len() as u32 }' > "$scratch/f.rs"
    rustc --edition 2024 --crate-type cdylib --target $wasm_target "$scratch/f.rs" -o "$scratch/f.wasm" 2> /dev/null && works=0
    rm -rf "$scratch"
    return $works
}

# Adds the target if necessary; fails with an explanation if that is not possible.
prepare_wasm() {
    wasm_works && return
    if ! command -v rustup > /dev/null; then
        say "the page needs Rust's standard library for $wasm_target, and there is no rustup to add it: install Rust from"
        say "https://rustup.rs, or that library from the source of this Rust"
        return 1
    fi
    say "rustup target add $wasm_target"
    if ! rustup target add $wasm_target || ! wasm_works; then
        say "Rust still does not compile for $wasm_target; run by hand: rustup target add $wasm_target"
        return 1
    fi
}
