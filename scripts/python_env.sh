# Sourced by the scripts without an ending: builds the program, makes a Python environment, runs a module in it.

# run_module NAME ARGUMENT...: `python -m NAME` of this folder, with what NAME/requirements.txt pins, in target/venv-NAME.
# STRANDLINE names a built program to use; without it target/release/strandline is built first.
run_module() {
    local name=$1 here root target venv wanted
    shift
    here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
    root=$(dirname "$here")
    target=${CARGO_TARGET_DIR:-$root/target}
    venv=$target/venv-$name
    wanted=$here/$name/requirements.txt
    if [[ -z ${STRANDLINE:-} ]]; then
        cargo build --quiet --release --locked --manifest-path "$root/Cargo.toml"
        export STRANDLINE=$target/release/strandline
    fi
    if ! cmp --silent "$wanted" "$venv/installed.txt"; then
        python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "python3 must be 3.11 or newer" >&2; exit 1; }
        python3 -m venv --clear "$venv"
        "$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$wanted"
        cp "$wanted" "$venv/installed.txt"
    fi
    export STRANDLINE_ROOT=$root STRANDLINE_TARGET=$target
    PYTHONPATH=$here exec "$venv/bin/python" -m "$name" "$@"
}
