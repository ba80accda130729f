# What ./run and ./test need of the machine. Sourced by both, never run by itself.

# System packages (Debian, Ubuntu): a linker; a software graphics driver where there is no GPU; what a window opens at run
# time; the scheduler of the example that spreads a sweep.
packages=(
    gcc libc6-dev
    libvulkan1 mesa-vulkan-drivers libegl1
    libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libwayland-client0
    parallel
)

# What building with sound needs besides, which a machine can be without.
sound_packages=(libasound2-dev pkg-config)
# What cargo is told where they are there.
sound=()

say() {
    printf '== %s\n' "$*" >&2
}

# Installs those of the given packages that are missing where that needs no password; else prints the command and goes on.
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
            say "missing system packages; if something fails, install them first: sudo ${install[*]}"
            return 0
        fi
        root=(sudo -n)
    fi
    say "installing ${missing[*]}"
    if ! patient_apt "${root[@]}" apt-get update -qq ||
        ! patient_apt "${root[@]}" env DEBIAN_FRONTEND=noninteractive "${install[@]}"; then
        say "that did not work; if something fails below, try it by hand: ${install[*]}"
    fi
}

# Runs apt-get, and waits while another one holds its locks: apt's own DPkg::Lock::Timeout covers only one of the three.
patient_apt() {
    local errors waited=0
    until errors=$("$@" 2>&1 > /dev/null); do
        if [[ $errors != *"Could not get lock"* && $errors != *"Unable to lock"* ]] || ((waited >= 1800)); then
            printf '%s\n' "$errors" >&2
            return 1
        fi
        ((waited)) || say "another installation is under way on this machine: waiting for it to end"
        sleep 2
        waited=$((waited + 2))
    done
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
    # rustup fetches the compiler that rust-toolchain.toml names; without a network the one that is here has to do.
    if ! (cd "$root" && rustc --version) > /dev/null 2>&1 && rustc +stable --version > /dev/null 2>&1; then
        export RUSTUP_TOOLCHAIN=stable
        say "the compiler that rust-toolchain.toml names is not to be had; going on with $(rustc --version)"
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

# What the tests of the page need: Node with the packages of web/package-lock.json, and Chromium; given `firefox`, that too, with a
# screen and what it decodes films with. `lacking` then says in a sentence what could not be had; it is empty if all is there.
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
        lacking="the tests in Firefox need it: install it, or name it: FIREFOX=/path/to/firefox"
    elif ! cmp -s "$root/web/package-lock.json" "$root/web/node_modules/.from"; then
        say "installing what the tests of the page use"
        if npm ci --silent --no-audit --no-fund --prefix "$root/web"; then
            cp "$root/web/package-lock.json" "$root/web/node_modules/.from"
        else
            lacking="the tests of the page need the packages of web/package-lock.json: npm ci --prefix web"
        fi
    fi
}

# Name the browsers, unless the caller did.
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
        # Sound needs nothing there.
        Darwin | MINGW* | MSYS* | CYGWIN*) ;;
        *)
            prepare_packages "${sound_packages[@]}"
            if ! pkg-config --exists alsa 2> /dev/null; then
                say "building without sound: ${sound_packages[*]} are not there"
                return
            fi
            ;;
    esac
    sound=(--features sound)
}

prepare() {
    prepare_packages "${packages[@]}"
    prepare_sound
    prepare_rust
    prepare_environment
}
