#!/usr/bin/env bash
# The contract tests against the built wheel, in an environment outside the checkout: a wheel that
# ships without its plug-ins cannot pass.
set -euo pipefail
checkout=$(cd "$(dirname "$0")/.." && pwd)
python=${PYTHON:-$checkout/.venv/bin/python}
outside=$(mktemp -d)
trap 'rm -rf "$outside"' EXIT

"$python" -m build --wheel --outdir "$outside/dist" "$checkout"
"$python" -m venv "$outside/venv"
"$outside/venv/bin/pip" install --quiet -c "$checkout/constraints.txt" \
    "$outside"/dist/*.whl pytest hypothesis
cp "$checkout/tests/formulations/test_contract.py" "$outside/"
mkdir "$outside/makers" && cp "$checkout"/tests/makers/{__init__,few_states}.py "$outside/makers/"
cd "$outside"
venv/bin/python - <<'PY'
import dikbench, formulations, scenarios
from pathlib import Path
for package in (dikbench, formulations, scenarios):
    assert "site-packages" in package.__file__, package.__file__
    assert (Path(package.__file__).parent / "py.typed").is_file(), package
assert (Path(formulations.__file__).parent / "REFERENCES.md").is_file()
PY
venv/bin/dikbench list
venv/bin/pytest --import-mode=importlib -o pythonpath=. -o 'markers=long: takes minutes' -m 'not long' test_contract.py
venv/bin/dikbench run smoke --scenario reach --out runs/wheel > /dev/null
test -s runs/wheel/report.md
test -s runs/wheel/report.html
