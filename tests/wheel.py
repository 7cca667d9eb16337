"""Build the wheel, install it in an empty environment, import the four names and run a study there.

Every file of the packages that is no Python (style, page, scripts, tables) must be found from there too.
"""

import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
NAMES = {"doe", "studies", "surrogates", "workbench"}
FIND = """
import sys
from importlib.resources import files
import matplotlib.pyplot as plt
plt.style.use("workbench.style")
missing = [f for f in sys.argv[1:] if not files(f.split("/")[0]).joinpath(*f.split("/")[1:]).is_file()]
sys.exit(f"not in the installed packages: {missing}" if missing else 0)
"""
MODEL = "def height(x):\n    return 1 - x * x\n"
STUDY = """
[study]
name = "hill"
[model]
kind = "python"
function = "hill.py:height"
[[parameter]]
name = "x"
lower = -1
upper = 2
[[response]]
name = "y"
[design]
kind = "sobol"
runs = 4
[evaluate]
engine = "inline"
"""


def run(*command: object, cwd: Path) -> str:
    """The command's output; its failure ends this script with that output."""
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def data_files() -> list[str]:
    """Files of the packages that hold no Python code, as paths below the project."""
    paths = (path for name in sorted(NAMES) for path in (ROOT / name).rglob("*") if path.is_file())
    compiled = {".py", ".pyc", ".nbi", ".nbc"}
    return sorted(str(path.relative_to(ROOT)) for path in paths if path.suffix not in compiled)


def main() -> None:
    """Raise SystemExit with the reason when the wheel is not what we promise."""
    with tempfile.TemporaryDirectory() as folder:
        away = Path(folder)
        run(sys.executable, "-m", "build", "--wheel", "--outdir", away, ROOT, cwd=away)
        (wheel,) = away.glob("*.whl")
        top = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
        packages = {name for name in top if not name.endswith(".dist-info")}
        if packages != NAMES:
            sys.exit(f"the wheel holds {sorted(packages)}, expected {sorted(NAMES)}")
        venv.create(away / "env", with_pip=True)
        python = away / "env" / "bin" / "python"
        run(python, "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt", wheel, cwd=away)
        run(python, "-c", "import doe, studies, surrogates, workbench, workbench.engine", cwd=away)
        text = run(away / "env" / "bin" / "holdfast", "--help", cwd=away)
        if "screen" not in text:
            sys.exit(f"holdfast --help does not list its commands:\n{text}")
        data = data_files()
        run(python, "-c", FIND, *data, cwd=away)
        (away / "hill.py").write_text(MODEL)
        (away / "study.toml").write_text(STUDY)
        run(away / "env" / "bin" / "holdfast", "run", "study.toml", cwd=away)
        (report,) = away.rglob("report.html")
        css = (ROOT / "workbench/report/page/page.css").read_text().split("{")[0].strip()
        if css not in report.read_text():
            sys.exit("the report of the installed packages carries no style")
    print(f"wheel: four packages, {len(data)} data files and a study with its report in an empty environment")


if __name__ == "__main__":
    main()
