"""Unit tests with the oldest dependencies that pyproject.toml allows, and on the newest Python there is.

Each runs in an empty environment outside the project. Where the package index does not serve an environment,
or no such Python is installed, a line says that it was skipped; a failing test fails this script.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
OLDEST, NEWEST = (3, 11), ((3, 14), (3, 13), (3, 12))
TOOLS = ("pytest>=8.3", "pytest-timeout>=2.3", "pytest-xdist>=3.6", "hypothesis>=6.120")
PATIENCE = 600  # s for one environment
SELECTED = "not slow and not peer and not bench and not browser and not long"


def installed() -> dict[tuple[int, int], str]:
    """(3, 12) -> command of every Python that starts: on the path, or among those that pyenv holds."""
    commands = [f"python3.{minor}" for minor in range(11, 16)]
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    commands += map(str, sorted(versions.glob("3.*/bin/python")))
    found: dict[tuple[int, int], str] = {}
    for command in filter(shutil.which, [sys.executable, *commands]):
        ask = "import sys; print(*sys.version_info[:2])"
        told = subprocess.run([command, "-c", ask], capture_output=True, text=True)
        if told.returncode == 0:
            found.setdefault(tuple(map(int, told.stdout.split())), command)
    return found


def try_with(python: str, constraints: str, title: str, *warnings: str) -> bool:
    """Make the environment and run the tests there; False when a test failed."""
    with tempfile.TemporaryDirectory() as away:
        env = Path(away, "env")
        subprocess.run([python, "-m", "venv", env], check=True)
        install = [env / "bin/python", "-m", "pip", "install", "-q", "-c", ROOT / constraints]
        try:
            subprocess.run(
                [*install, f"{ROOT}[netcdf]", *TOOLS],
                capture_output=True, text=True, check=True, timeout=PATIENCE,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            print(f"skipped: {title}: the package index did not serve it within {PATIENCE} s")
            return True
        except subprocess.CalledProcessError as done:
            (reason,) = re.findall(r"^ERROR: (.*)$", done.stderr, re.MULTILINE)[:1] or [done.stderr[-300:]]
            print(f"skipped: {title}: the package index does not serve it ({reason})")
            return True
        print(f"{title}: {python}", flush=True)
        variables = {**os.environ, "NUMBA_CACHE_DIR": str(Path(away, "kernels")), "OMP_NUM_THREADS": "1"}
        tests = [env / "bin/python", "-m", "pytest", "-q", "-n", "2", *warnings, "-m", SELECTED, "tests/unit"]
        return subprocess.run(tests, cwd=ROOT, env=variables).returncode == 0


def main() -> int:
    """0 when all that could be tried passed."""
    pythons = installed()
    newest = next((version for version in NEWEST if version in pythons), None)
    passed = True
    if OLDEST in pythons:
        title = "oldest dependencies on Python 3.11"
        # old packages warn of new ones that they were never tried with
        passed &= try_with(pythons[OLDEST], "constraints-oldest.txt", title, "-o", "filterwarnings=default")
    else:
        print("skipped: oldest dependencies: no Python 3.11 is installed")
    if newest:
        title = f"newest Python, {newest[0]}.{newest[1]}"
        passed &= try_with(pythons[newest], "constraints.txt", title)
    else:
        print("skipped: newest Python: none beyond 3.11 is installed")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
