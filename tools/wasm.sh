# Makes this Rust compile to wasm32-unknown-unknown. Sourced by ./run and ./test, after prepare.sh.
#
# Already there, else `rustup target add`, else (where rustup cannot download, on Debian and Ubuntu) the standard library
# built from Debian's source package of this very version of Rust, and put where rustup would have put it.

wasm_target=wasm32-unknown-unknown

# Whether this Rust compiles and links a library with the standard library in it.
wasm_works() {
    local scratch works=1
    scratch=$(mktemp -d)
    printf '%s\n' '#[unsafe(no_mangle)] pub extern "C" fn f(x: u32) -> u32 { format!("{x}").len() as u32 }' > "$scratch/f.rs"
    rustc --edition 2024 --crate-type cdylib --target $wasm_target "$scratch/f.rs" -o "$scratch/f.wasm" 2> /dev/null && works=0
    rm -rf "$scratch"
    return $works
}

wasm_from_rustup() {
    command -v rustup > /dev/null || return 1
    say "rustup target add $wasm_target"
    timeout 300 rustup target add $wasm_target && wasm_works
}

# apt with lists and a cache of its own: needs no password and changes nothing in the system.
wasm_apt() {
    local tool=$1
    shift
    "$tool" -qq -o Dir::Etc::SourceList="$wasm_cache/sources.list" -o Dir::Etc::SourceParts=/dev/null \
        -o Dir::State="$wasm_cache/state" -o Dir::State::Lists="$wasm_cache/lists" -o Dir::Cache="$wasm_cache/cache" \
        -o Acquire::Languages=none -o APT::Sandbox::User= -o Debug::NoLocking=true "$@"
}

# Prints the folder with the sources of version $1 of the standard library.
wasm_source() {
    local version=$1 source=$wasm_cache/rustc-$1 mirror suite package full
    if [[ ! -f $source/library/Cargo.lock ]]; then
        mkdir -p "$wasm_cache"/{lists,state,cache/archives}/partial "$wasm_cache/unpacked"
        mirror=$(apt-get indextargets --format '$(REPO_URI)' | sed -n 's,/debian/*$,,p' | head -n 1)
        : > "$wasm_cache/sources.list"
        for suite in trixie-backports forky sid trixie bookworm-security bookworm; do
            package=debian
            [[ $suite == *-security ]] && package=debian-security
            echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg arch=amd64] ${mirror:-http://deb.debian.org}/$package $suite main" \
                >> "$wasm_cache/sources.list"
        done
        wasm_apt apt-get update > /dev/null 2>&1
        for package in rust-src rust-web-src; do
            full=$(wasm_apt apt-cache madison $package 2> /dev/null |
                awk -F'|' -v want="$version+dfsg" '{gsub(/ /, "", $2); if (index($2, want) == 1) {print $2; exit}}')
            [[ -n $full ]] && break
        done
        if [[ -z $full ]]; then
            say "no Debian release has the sources of Rust $version"
            return 1
        fi
        say "downloading $package $full"
        (cd "$wasm_cache" && wasm_apt apt-get download "$package=$full" > /dev/null 2>&1) || return 1
        dpkg-deb --fsys-tarfile "$wasm_cache/$package"_*.deb |
            tar -x -C "$wasm_cache/unpacked" --wildcards './usr/src/rustc*/library/*' || return 1
        mv "$wasm_cache"/unpacked/usr/src/rustc*"$version"* "$source" || return 1
        rm -rf "$wasm_cache/unpacked" "$wasm_cache"/*.deb
    fi
    printf '%s\n' "$source"
}

wasm_from_debian() {
    local version sysroot source library
    if ! command -v apt-get > /dev/null || ! command -v dpkg-deb > /dev/null; then
        return 1
    fi
    version=$(rustc --version | awk '{print $2}')
    sysroot=$(rustc --print sysroot)
    if [[ ! -w $sysroot/lib/rustlib ]]; then
        say "$sysroot cannot be written to"
        return 1
    fi
    wasm_cache=${XDG_CACHE_HOME:-$HOME/.cache}/jointplay-wasm
    source=$(wasm_source "$version") || return 1
    say "building the standard library for $wasm_target"
    # As Rust's own build does: the crates are marked as the standard library's, with hashes of their own.
    env -u CARGO_ENCODED_RUSTFLAGS -u CARGO_BUILD_TARGET RUSTC_BOOTSTRAP=1 __CARGO_DEFAULT_LIB_METADATA=jointplay-wasm \
        RUSTFLAGS="-Zforce-unstable-if-unmarked -Cembed-bitcode=yes" \
        cargo build --quiet --locked --release --target $wasm_target --target-dir "$wasm_cache/target" \
        --manifest-path "$source/library/sysroot/Cargo.toml" || return 1
    library=$sysroot/lib/rustlib/$wasm_target/lib
    rm -rf "$library"
    mkdir -p "$library"
    cp "$wasm_cache/target/$wasm_target"/release/deps/*.rlib "$library/" || return 1
    rm -rf "$wasm_cache/target"
    wasm_works
}

prepare_wasm() {
    wasm_works || wasm_from_rustup || wasm_from_debian || {
        say "this Rust does not compile for $wasm_target; try: rustup target add $wasm_target"
        exit 1
    }
}
