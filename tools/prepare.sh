# What ./run and ./test need of the machine. Sourced by both, never run by itself.

# System packages (Debian, Ubuntu): a linker; a software graphics driver where there is no GPU; what a window opens at run
# time; the scheduler of the example that spreads a sweep.
packages=(
    gcc libc6-dev
    libvulkan1 mesa-vulkan-drivers libegl1
    libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libwayland-client0
    parallel
)

say() {
    printf '== %s\n' "$*" >&2
}

# Installs the missing packages where that needs no password; else prints the command and goes on.
prepare_packages() {
    command -v dpkg-query > /dev/null && command -v apt-get > /dev/null || return 0
    local missing=() package
    for package in "${packages[@]}"; do
        dpkg-query -W -f='${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
    done
    ((${#missing[@]})) || return 0
    local install=(apt-get install -y --no-install-recommends "${missing[@]}")
    local root=()
    if [[ $(id -u) != 0 ]]; then
        if ! command -v sudo > /dev/null || ! sudo -n true 2> /dev/null; then
            say "missing system packages; if something fails, install them first: sudo ${install[*]}"
            return 0
        fi
        root=(sudo -n)
    fi
    say "installing ${missing[*]}"
    if ! "${root[@]}" apt-get update -qq || ! "${root[@]}" env DEBIAN_FRONTEND=noninteractive "${install[@]}" > /dev/null; then
        say "that did not work; if something fails below, try it by hand: ${install[*]}"
    fi
}

prepare_rust() {
    if ! command -v cargo > /dev/null && [[ -x $HOME/.cargo/bin/cargo ]]; then
        PATH=$HOME/.cargo/bin:$PATH
    fi
    if ! command -v cargo > /dev/null; then
        say "Rust is missing. Install it as https://rustup.rs says, then try again:"
        say "    curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
        exit 1
    fi
}

# The software driver complains on every start without one.
prepare_environment() {
    if [[ -z ${XDG_RUNTIME_DIR:-} ]]; then
        XDG_RUNTIME_DIR=${TMPDIR:-/tmp}/jointplay-runtime-$(id -u)
        mkdir -p -m 700 "$XDG_RUNTIME_DIR"
        export XDG_RUNTIME_DIR
    fi
}

prepare() {
    prepare_packages
    prepare_rust
    prepare_environment
}
