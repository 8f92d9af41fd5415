#!/bin/sh
# Tests this project in any CI: sh ci.sh [COMMAND ..]      (default: make -k test; `setup`: only sets up)
# Makes .venv with what requirements.txt names, runs COMMAND, and leaves in build/ what that wrote (JUnit as *.xml, cases in
# failed/) with summary.md. The exit code is that of COMMAND; 2 if no test ran. Needs git, Python 3.11 and a C compiler.
#   MIROTWIN_FROM   a wheel or a checkout to take instead of requirements.txt
#   MIROTWIN_VENV   where the environment is, instead of .venv
set -eu
venv=${MIROTWIN_VENV:-.venv}

# Installed once where the source cannot change: a git address with its commit, or the one that the caller answers for.
if [ -n "${MIROTWIN_FROM:-}" ]; then wanted="$MIROTWIN_FROM"; else wanted=$(cat requirements.txt); fi
pinned() { [ -n "${MIROTWIN_FROM:-}" ] || grep -Eq '^mirotwin.*@ git[+][^ ]+@[0-9a-f]{40}' requirements.txt; }
if ! { pinned && [ "$wanted" = "$(cat "$venv/mirotwin.from" 2>/dev/null)" ] && "$venv/bin/mirotwin" --version >/dev/null 2>&1; }; then
    "$venv/bin/python" -c '' 2>/dev/null || python3 -m venv --clear "$venv"
    if [ -n "${MIROTWIN_FROM:-}" ]; then
        "$venv/bin/pip" install -q "${MIROTWIN_FROM}[report]" 'pytest>=8.3,<10'
    else
        "$venv/bin/pip" install -q -r requirements.txt
    fi
    printf '%s\n' "$wanted" >"$venv/mirotwin.from"
fi
[ "${1:-}" != setup ] || exit 0

PATH=$(cd "$venv/bin" && pwd):$PATH
export PATH
[ $# -gt 0 ] || set -- make -k test
mkdir -p build
rm -rf build/*.xml build/failed build/summary.md
code=0
"$@" || code=$?
annotations=
[ -z "${GITHUB_ACTIONS:-}" ] || annotations=--annotations
mirotwin summary build --out build/summary.md $annotations || [ $code != 0 ] || code=2
[ -z "${GITHUB_STEP_SUMMARY:-}" ] || cat build/summary.md >>"$GITHUB_STEP_SUMMARY"
exit $code
