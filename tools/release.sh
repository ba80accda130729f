# `./run release`: what is published of a version, in dist/. Sourced by ./run and ./test, after page.sh and python.sh.

windows_target=x86_64-pc-windows-gnu

# Writes the archives into dist/, which is replaced as a whole.
run_release() {
    if (($#)); then
        say "./run release"
        exit 2
    fi
    cd "$root"
    local dist=dist parts=target/release-parts version epoch
    if [[ -e $dist && ! -e $dist/SHA256SUMS ]]; then
        say "dist/ holds no release: move it away first"
        exit 1
    fi
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
    # The times of the files in the archives, so that the same sources give the same archives.
    epoch=$(git log -1 --format=%ct 2> /dev/null || date +%s)
    prepare_maturin target/wheel-tools
    prepare_windows
    rm -rf "$parts"
    mkdir -p "$parts"

    say "the program for Linux"
    cargo build --release --locked "${features[@]}" --features screen-reader
    local linux=$parts/jointplay-$version-linux-x86_64
    release_folder "$linux" target/release/jointplay x86_64-unknown-linux-gnu "${features[@]}" --features screen-reader
    cp tools/release/jointplay.desktop web/icon.svg "$linux"
    archive "$linux"

    say "the command line for Windows"
    cargo build --release --locked --no-default-features --target $windows_target
    local windows=$parts/jointplay-$version-windows-x86_64
    release_folder "$windows" target/$windows_target/release/jointplay.exe $windows_target --no-default-features
    (cd "$parts" && python3 -m zipfile -c "${windows##*/}.zip" "${windows##*/}")

    build_page "$parts/jointplay-$version-page" --compress
    archive "$parts/jointplay-$version-page"

    say "the package for Python"
    build_wheel target/wheel-tools "$parts" --release

    rm -rf "$linux" "$windows" "$parts/jointplay-$version-page"
    (cd "$parts" && sha256sum -- * > SHA256SUMS)
    rm -rf "$dist"
    mv "$parts" "$dist"
    say "in dist/:"
    ls -l "$dist" >&2
}

# Fills folder $1 with program $2 for target $3 and what it may only be passed on with; further arguments are its features.
release_folder() {
    local folder=$1 program=$2 target=$3
    shift 3
    mkdir -p "$folder"
    cp "$program" LICENSE-APACHE LICENSE-MIT tools/release/README.txt "$folder"
    cargo build --locked --quiet --manifest-path tools/web/Cargo.toml --target-dir target/tools
    page_tool licences "$target" "$@" > "$folder/licences.txt"
}

# Packs folder $1 into $1.tar.gz.
archive() {
    tar --create --directory "${1%/*}" --sort=name --mtime="@$epoch" --owner=0 --group=0 --numeric-owner "${1##*/}" | gzip -9n > "$1.tar.gz"
}

prepare_windows() {
    prepare_packages gcc-mingw-w64-x86-64
    rustup target list --installed 2> /dev/null | grep -qx $windows_target || rustup target add $windows_target
}

# The release as those meet it who have no Rust: the Windows program under Wine gives the state of the Linux program and refuses a
# bad value; the wheel works in an environment of its own. `./test long` calls it after the release is built.
release_test() {
    prepare_packages wine64
    local try=$record/release
    mkdir -p "$try"
    tar -xzf dist/jointplay-*-linux-x86_64.tar.gz --strip-components 1 -C "$try"
    (cd "$try" && python3 -m zipfile -e "$root"/dist/jointplay-*-windows-x86_64.zip . && mv jointplay-*-windows-x86_64/jointplay.exe .)
    # Wine 8 lacks this library, which Windows has since version 8.
    x86_64-w64-mingw32-gcc -shared -o "$try/bcryptprimitives.dll" tools/release/prng.c -ladvapi32
    local run=(run spcmm --duration 20ms --summary json --quiet) wine=(env WINEPREFIX="$try/wine" WINEDEBUG=-all /usr/lib/wine/wine64)
    hash_of() { "$@" | python3 -c 'import json, sys; print(json.load(sys.stdin)["state_hash"])'; }
    [[ $(hash_of "${wine[@]}" "$try/jointplay.exe" "${run[@]}") == $(hash_of "$try/jointplay" "${run[@]}") ]]
    local code=0
    "${wine[@]}" "$try/jointplay.exe" run spcmm --set contact.friction=99 --duration 1ms 2> "$try/error" || code=$?
    ((code == 2)) && grep -q 'contact.friction = 99' "$try/error"

    python3 -m venv "$try/env"
    "$try/env/bin/pip" install --quiet --disable-pip-version-check dist/*.whl
    local state='import jointplay as jp; print(jp.Scene.load("spcmm").run(0.02).hash)'
    [[ $(PATH=/usr/bin:/bin "$try/env/bin/python" -P -c "$state") == $(hash_of "$try/jointplay" "${run[@]}") ]]
}
