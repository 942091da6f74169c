#!/bin/sh
# Put the pinned requirements into the environment named by the argument; make it first when it is missing.
# Needs Python 3.11 to 3.14; uses uv when there is one.
set -eu
env=$1

supported() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' >/dev/null 2>&1
}

if [ ! -x "$env/bin/python" ]; then
    if command -v uv >/dev/null 2>&1; then
        echo "Making the environment $env with uv"
        uv venv --quiet --python '>=3.11,<3.15' "$env"
    else
        python=
        for candidate in python3 python3.14 python3.13 python3.12 python3.11 python; do
            if supported "$candidate"; then python=$candidate && break; fi
        done
        if [ -z "$python" ]; then
            echo "No Python 3.11 to 3.14 was found. Install one, or install uv, and run make again." >&2
            exit 1
        fi
        echo "Making the environment $env with $python"
        "$python" -m venv "$env" || {
            echo "The module venv is incomplete here; on Debian and Ubuntu: apt-get install python3-venv" >&2
            rm -rf "$env"
            exit 1
        }
    fi
fi

supported "$env/bin/python" || {
    echo "The environment $env has a Python other than 3.11 to 3.14; leave it and run make again." >&2
    exit 1
}

echo "Installing requirements.txt into $env"
if command -v uv >/dev/null 2>&1; then
    uv pip install --quiet --python "$env/bin/python" -r requirements.txt
else
    # Modules are compiled when they are first used, not all twelve thousand of them here.
    "$env/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check -r requirements.txt
fi
