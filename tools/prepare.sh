# Installs what ./run and ./test need. Sourced by both, never run by itself.

# System packages (Debian, Ubuntu): a linker; a software graphics driver for machines without a GPU; libraries that a window loads at
# run time.
packages=(
    gcc libc6-dev
    libvulkan1 mesa-vulkan-drivers libegl1
    libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libwayland-client0
)

# Further packages for sound, which is optional.
sound_packages=(libasound2-dev pkg-config)
# Arguments for cargo: `sound` if they are installed.
features=()

say() {
    printf '== %s\n' "$*" >&2
}

# Installs the missing ones of the given packages if that needs no password; otherwise prints the command and continues.
prepare_packages() {
    command -v dpkg-query > /dev/null && command -v apt-get > /dev/null || return 0
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
    done
    ((${#missing[@]})) || return 0
    local install=(apt-get install -y --no-install-recommends "${missing[@]}")
    local root=()
    if [[ $(id -u) != 0 ]]; then
        if ! command -v sudo > /dev/null || ! sudo -n true 2> /dev/null; then
            say "system packages are missing; if something fails, install them first: sudo ${install[*]}"
            return 0
        fi
        root=(sudo -n)
    fi
    say "installing ${missing[*]}"
    if ! apt_with_wait "${root[@]}" apt-get update -qq ||
        ! apt_with_wait "${root[@]}" env DEBIAN_FRONTEND=noninteractive "${install[@]}"; then
        say "the installation failed; if something fails below, run it by hand: ${install[*]}"
    fi
}

# Runs apt-get, and waits while another process holds its locks: apt's own DPkg::Lock::Timeout covers only one of the three.
apt_with_wait() {
    local errors waited=0
    until errors=$("$@" 2>&1 > /dev/null); do
        if [[ $errors != *"Could not get lock"* && $errors != *"Unable to lock"* ]] || ((waited >= 1800)); then
            printf '%s\n' "$errors" >&2
            return 1
        fi
        ((waited)) || say "waiting for another installation on this machine to end"
        sleep 2
        waited=$((waited + 2))
    done
}

prepare_rust() {
    if ! command -v cargo > /dev/null && [[ -x $HOME/.cargo/bin/cargo ]]; then
        PATH=$HOME/.cargo/bin:$PATH
    fi
    if ! command -v cargo > /dev/null; then
        say "Rust is missing. Install it as described at https://rustup.rs, then try again:"
        say "    curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
        exit 1
    fi
    # rustup downloads the compiler that rust-toolchain.toml names; without a network the installed one is used.
    if ! (cd "$root" && rustc --version) > /dev/null 2>&1 && rustc +stable --version > /dev/null 2>&1; then
        export RUSTUP_TOOLCHAIN=stable
        say "the compiler that rust-toolchain.toml names is not available; continuing with $(rustc --version)"
    fi
}

# Sets XDG_RUNTIME_DIR to a folder of this user: without it the software graphics driver prints a warning at every start. After
# `sudo` or `su` it may name a folder of another user, and anybody can create a folder in /tmp.
prepare_environment() {
    is_own_folder "${XDG_RUNTIME_DIR:-}" && return
    XDG_RUNTIME_DIR=${TMPDIR:-/tmp}/jointplay-runtime-$(id -u)
    mkdir -m 700 "$XDG_RUNTIME_DIR" 2> /dev/null || true
    is_own_folder "$XDG_RUNTIME_DIR" || XDG_RUNTIME_DIR=$(mktemp -d)
    export XDG_RUNTIME_DIR
}
is_own_folder() {
    [[ -d $1 && -O $1 && ! -L $1 ]]
}

# Installs what the tests of the page need: Node with the packages of web/package-lock.json, and Chromium; with the argument
# `firefox` also Firefox, a virtual screen and a film decoder. Sets `lacking` to a sentence about what is missing, or clears it.
prepare_browser() {
    local needed=() with_firefox=${1:-}
    lacking=
    command -v node > /dev/null || needed+=(nodejs)
    command -v npm > /dev/null || needed+=(npm)
    find_chromium || needed+=(chromium)
    if [[ -n $with_firefox ]]; then
        find_firefox || needed+=(firefox-esr)
        command -v Xvfb > /dev/null || needed+=(xvfb)
        /sbin/ldconfig -p | grep -q libavcodec.so || needed+=(libavcodec-extra)
    fi
    ((${#needed[@]} == 0)) || prepare_packages "${needed[@]}"
    if ! command -v node > /dev/null || ! command -v npm > /dev/null; then
        lacking="the tests of the page need Node 18 or newer with npm: install them"
    elif ! find_chromium; then
        lacking="the tests of the page need Chromium: install it, or name it: CHROMIUM=/path/to/chromium"
    elif [[ -n $with_firefox ]] && ! find_firefox; then
        lacking="the tests in Firefox need Firefox: install it, or name it: FIREFOX=/path/to/firefox"
    elif ! cmp -s "$root/web/package-lock.json" "$root/web/node_modules/.from"; then
        say "installing the packages of the page's tests"
        if npm ci --silent --no-audit --no-fund --prefix "$root/web"; then
            cp "$root/web/package-lock.json" "$root/web/node_modules/.from"
        else
            lacking="the tests of the page need the packages of web/package-lock.json: npm ci --prefix web"
        fi
    fi
}

# Find the browsers, unless the caller has named them.
find_chromium() {
    export CHROMIUM=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome)}
    [[ -n $CHROMIUM ]]
}
find_firefox() {
    export FIREFOX=${FIREFOX:-$(command -v firefox-esr || command -v firefox)}
    [[ -n $FIREFOX ]]
}

prepare_sound() {
    case $(uname) in
        # No packages are needed there.
        Darwin | MINGW* | MSYS* | CYGWIN*) ;;
        *)
            prepare_packages "${sound_packages[@]}"
            if ! pkg-config --exists alsa 2> /dev/null; then
                say "building without sound: ${sound_packages[*]} are not installed"
                return
            fi
            ;;
    esac
    features=(--features sound)
}

# Adds what tells a screen reader about the window where assistive technology is in use: on Linux that takes long to build.
prepare_screen_reader() {
    if [[ $(uname) != Linux ]] ||
        busctl --user get-property org.a11y.Bus /org/a11y/bus org.a11y.Status IsEnabled 2> /dev/null | grep -q true; then
        features+=(--features screen-reader)
    fi
}

prepare() {
    prepare_packages "${packages[@]}"
    prepare_sound
    prepare_rust
    prepare_environment
}
